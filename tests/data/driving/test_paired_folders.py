"""Any two folders: pairs by name and by times in names, sub-folders as records."""

from pathlib import Path

import pytest

from diffnav.data.driving.paired import paired_drive
from diffnav.errors import UserError


def test_equal_names_whatever_the_ending(grow) -> None:
    root = grow("left/9.png", "left/10.png", "left/11.png", "right/10.jpg", "right/9.jpg", "right/12.jpg")
    drive = paired_drive(root / "left", str(root / "right"))
    assert [(q.name, q.picture) for q in drive.queries] == [
        ("left/9", root / "left/9.png"),
        ("left/10", root / "left/10.png"),
    ]
    assert [r.name for r in drive.references] == ["right/9", "right/10"]
    assert drive.unmatched == [
        "left/11: no reference in record drive named 11; left out",
        "right/12: no query in record drive named 12; left out",
    ]
    assert drive.consecutive
    assert not paired_drive(root / "left", root / "right", consecutive=False).consecutive


def test_sub_folders_are_records(grow) -> None:
    root = grow("l/day 1/0.png", "l/day 2/0.png", "r/day 1/0.png", "r/day 2/0.png", "l/day 3/0.png")
    drive = paired_drive(root / "l", root / "r")
    assert drive.counts == {"day 1": 1, "day 2": 1}
    assert [q.name for q in drive.queries] == ["left/day 1/0", "left/day 2/0"]
    assert len(drive.unmatched) == 1


@pytest.mark.parametrize(
    ("left", "right", "unit"),
    [
        (["1602074967000000000", "1602074967100000000"], ["1602074967099000000", "1602074967400000000"], 1e-9),
        (["1602074967000000", "1602074967100000"], ["1602074967099000", "1602074967400000"], 1e-6),
        (["100.0", "100.1"], ["100.099", "100.4"], 1e-9),
    ],
)
def test_jittered_times_in_every_unit(left, right, unit: float, grow) -> None:
    root = grow(*(f"left/{name}.png" for name in left), *(f"right/{name}.png" for name in right))
    drive = paired_drive(root / "left", root / "right", tolerance_s=0.002, time_unit_s=unit)
    assert [(q.moment, r.moment) for q, r in zip(drive.queries, drive.references, strict=True)] == [(left[1], right[0])]
    assert len(drive.unmatched) == 2
    with pytest.raises(UserError, match="no picture has a partner"):
        paired_drive(root / "left", root / "right")


def test_mistakes_are_one_sentence(grow, tmp_path: Path) -> None:
    root = grow("left/a.png", "right/b.png")
    with pytest.raises(UserError, match=r"queries: 1 pictures, e\.g\. left/a; references: 1 pictures, e\.g\. right/b"):
        paired_drive(root / "left", root / "right")
    with pytest.raises(UserError, match=r"no folder .*nowhere"):
        paired_drive(root / "left", tmp_path / "nowhere")
    with pytest.raises(UserError, match=r"data\.left and data\.right are one folder"):
        paired_drive(root / "left", root / "right" / ".." / "left")
    with pytest.raises(UserError, match=r"a\.png: its name is no time"):
        paired_drive(root / "left", root / "right", tolerance_s=1.0)
    with pytest.raises(UserError, match=r"time_unit_s must be above 0"):
        paired_drive(root / "left", root / "right", tolerance_s=1.0, time_unit_s=0)
    (root / "left/a.jpg").write_bytes((root / "left/a.png").read_bytes())
    with pytest.raises(UserError, match=r"a\.jpg and .*a\.png are one camera's of one moment"):
        paired_drive(root / "left", root / "right")
