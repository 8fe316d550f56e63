"""Queries made ready: read, measured, brightened where the gate says so, or refused in a sentence."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import pytest
import torch
from made_noise import noise
from torch import Tensor

from diffnav.data.queries.query import Query
from diffnav.images import write_image
from diffnav.navigation.fix import Fix
from diffnav.navigation.gates.gate import DefinitionGate, Never
from diffnav.navigation.preparation import Preparation

TIME = datetime(2024, 5, 1, 12, 0, 0)


def brighten(image: Tensor) -> Tensor:
    return image.sqrt()


def query_of(image: Tensor | Path | Callable[[], Tensor]) -> Query:
    if isinstance(image, Tensor):
        picture = image
        return Query("photo", lambda: picture, time=TIME)
    return Query("photo", image, time=TIME)


def test_a_dark_picture_is_enhanced_and_a_bright_one_is_not() -> None:
    """Their definitions (Eq. 10) differ by the square of 1/16 and 1, and the threshold lies between."""
    bright = noise((40, 50), 1)
    preparation = Preparation(DefinitionGate(5.0), brighten)
    for image, dark in ((bright, False), (bright / 16, True)):
        prepared = preparation(query_of(image))
        expected = brighten(image) if dark else image
        assert prepared.image is not None
        assert torch.equal(prepared.image, expected)
        assert prepared.facts["enhanced"] == dark
        fix = prepared.no_fix("nowhere", matches=7)
        assert fix == Fix(
            "photo", "no_fix", ("nowhere",), matches=7, enhanced=dark, definition=prepared.facts["definition"],
            milliseconds=prepared.watch.milliseconds, time=TIME,
        )  # fmt: skip
        assert (fix.definition or 0) < 5 if dark else (fix.definition or 0) > 5
        assert set(fix.milliseconds) == ({"read", "gate", "enhance"} if dark else {"read", "gate"})


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (noise((31, 90), 1), "photo: 90 x 31 pixels, fewer than 32 a side; give a larger picture"),
        (noise((90, 5), 1), "photo: 5 x 90 pixels, fewer than 32"),
        (torch.zeros(3, 64, 64), "photo: the picture is of one colour; nothing in it can be matched"),
        (torch.ones(3, 64, 64), "one colour"),
        (torch.tensor([0.9, 0.1, 0.4])[:, None, None].expand(3, 64, 64), "one colour"),
        (Path("does") / "not.jpg", "not.jpg: no such file"),
    ],
    ids=["low", "narrow", "black", "white", "orange", "missing"],
)
def test_what_cannot_be_matched_is_an_answer_with_its_reason(image: Tensor | Path, reason: str) -> None:
    prepared = Preparation(Never(), brighten)(query_of(image))
    assert prepared.image is None
    fix = prepared.no_fix()
    assert (fix.status, fix.query, fix.time, fix.place) == ("no_fix", "photo", TIME, None)
    assert len(fix.reasons) == 1
    assert reason in fix.reasons[0]
    assert prepared.again().no_fix().reasons == fix.reasons


def test_a_damaged_file_is_an_answer_too(tmp_path: Path) -> None:
    file = tmp_path / "broken.png"
    write_image(file, noise((64, 64), 2))
    file.write_bytes(file.read_bytes()[:2000])
    (reason,) = Preparation(Never(), brighten)(query_of(file)).no_fix().reasons
    assert reason.startswith(f"{file}: damaged image")


def test_two_levels_of_8_bit_are_enough() -> None:
    """The darkest that could be matched: levels 0 and 1, or two levels at the bright end."""
    for level in (0, 254):
        image = torch.full((3, 64, 64), level / 255)
        image[1, 20:30, 20:30] = (level + 1) / 255
        assert Preparation(Never(), brighten)(query_of(image)).image is not None


def test_each_answer_has_its_own_times() -> None:
    prepared = Preparation(Never(), brighten)(query_of(noise((40, 50), 1)))
    one, other = prepared.again(), prepared.again()
    with one.watch.stage("match"):
        pass
    assert set(one.no_fix().milliseconds) == {"read", "gate", "match"}
    assert set(other.no_fix().milliseconds) == set(prepared.no_fix().milliseconds) == {"read", "gate"}
    assert one.no_fix().milliseconds["read"] == prepared.watch.milliseconds["read"]
    assert one.image is prepared.image
