"""python -m eval.driving from end to end on small drives: files, schema, a second run."""

import csv
import json
from pathlib import Path

import pytest
from PIL import Image

from diffnav.checkpoints import checkpoint_sha256

# What the experiment promises of every row.
ROW = {
    "method", "matcher", "queries", "references", "accuracy", "accuracy_ci", "accuracy_pm1", "accuracy_5m", "mp",
    "gap_closed", "seconds",
}  # fmt: skip
FILES = {
    "driving.json", "driving.md", "per_query.csv", "records.jsonl", "figure_11.jpg", "similarity.png",
}  # fmt: skip
MATCHER = "orb_gms(rotation=False, threshold_factor=2.0)"


def lines(folder: Path) -> list[dict[str, str]]:
    with (folder / "per_query.csv").open() as file:
        return list(csv.DictReader(file))


def test_table_3_on_the_embedded_street(localise, tmp_path: Path) -> None:
    settings = {
        "data": "scenes_drive", "data.left": ..., "data.right": ..., "data.count": 4, "data.size": "[128,192]",
        "always": ..., "matchers": ..., "figures": 1, "checkpoint": "zero_dce", "seed": 3,
        "cache": tmp_path / "cache",
    }  # fmt: skip
    printed = localise(**settings).out
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == FILES
    assert "street_0: 4 pairs" in printed
    assert "16 answers, 0 of them from before" in printed
    content = json.loads((out / "driving.json").read_text(), parse_constant=pytest.fail)
    rows, protocol = content["rows"], content["protocol"]
    names = ["input", "gamma_blind", "normal", "zero_dce"]
    rankings = ("matches", "inliers", "rows")
    assert [(row["method"], row["ranking"]) for row in rows] == [(n, r) for r in rankings for n in names]
    table = lines(out)
    assert len(table) == 16
    for row in rows:
        assert row.keys() >= ROW
        assert (row["matcher"], row["queries"], row["references"]) == ("orb_gms(rotation=False)", 4, 4)
        assert row["accuracy_ci"][0] <= row["accuracy"] <= row["accuracy_ci"][1]
        assert row["accuracy"] <= row["accuracy_pm1"] <= 1
        assert row["accuracy"] <= row["accuracy_2m"] <= row["accuracy_5m"] == 1
        assert row["seconds"] > 0
        # Aggregated anew from the lines of the queries.
        own = [line for line in table if line["method"] == row["method"]]
        right = [line[f"answer_by_{row['ranking']}"] == line["partner"] for line in own]
        assert row["accuracy"] == sum(right) / 4
        near = [line[f"moments_off_by_{row['ranking']}"] in ("0", "1") for line in own]
        assert row["accuracy_pm1"] == sum(near) / 4
        if row["ranking"] == "matches":
            assert row["mp"] == sum(int(line["matches"]) for line in own) / 4
    # Frames are 1.5 m apart, and so are their pictures' places.
    for line in table:
        assert float(line["metres_off_by_matches"]) == pytest.approx(1.5 * int(line["moments_off_by_matches"]), abs=0.1)
    by_name = {row["method"]: row for row in rows[:4]}
    assert by_name["normal"]["mp"] > by_name["input"]["mp"]
    assert (protocol["data"]["kind"], protocol["data"]["count"], protocol["seed"]) == ("scenes_drive", 4, 3)
    assert protocol["pairs_by_record"] == {"street_0": 4}
    assert protocol["matchers"]["orb_gms(rotation=False)"]["rotation"] is False
    assert protocol["weights_sha256"] == {"zero_dce": checkpoint_sha256("zero_dce")}
    page = (out / "driving.md").read_text()
    assert "Acc 0.388" in page
    assert "| input" in page
    with Image.open(out / "figure_11.jpg") as figure:
        assert figure.size[0] > 3 * figure.size[1] > 600

    pictures = sorted((tmp_path / "cache").rglob("*.*"))
    records = (out / "records.jsonl").read_text()
    assert "16 answers, 16 of them from before" in localise(**settings | {"figures": 0}).out
    assert json.loads((out / "driving.json").read_text()) == content
    assert sorted((tmp_path / "cache").rglob("*.*")) == pictures
    assert (out / "records.jsonl").read_text() == records


def test_any_two_folders(localise, summary, tmp_path: Path) -> None:
    assert "drive: 4 pairs" in localise().out
    rows = summary()["rows"]
    assert {row["matcher"] for row in rows} == {MATCHER}
    # No places are known of the pictures, but their order is.
    assert {(row["accuracy_5m"], row["accuracy_pm1"] is None) for row in rows} == {(None, False)}
    by_name = {(row["method"], row["ranking"]): row for row in rows}
    assert by_name["normal", "matches"]["accuracy"] == 1
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES - {"figure_11.jpg", "similarity.png"}
    localise(**{"data.consecutive": "false", "verified": 0, "out": tmp_path / "scenes"})
    rows = summary("scenes")["rows"]
    assert {(row["ranking"], row["accuracy_pm1"]) for row in rows} == {("matches", None)}
    assert "moments off" not in (tmp_path / "scenes" / "driving.md").read_text()


def test_a_changed_setting_makes_what_it_decides_and_nothing_else(localise, summary) -> None:
    assert "8 answers, 0 of them from before" in localise().out
    before = summary()["rows"]
    assert "8 answers, 0 of them from before" in localise(seed=1).out
    assert "12 answers, 8 of them from before" in localise(always="[input,normal,gamma_blind]").out
    both = "[{orb_gms: {rotation: false, threshold_factor: 2.0}},{sift: {features: 50}}]"
    assert "16 answers, 8 of them from before" in localise(matchers=both).out
    assert "8 answers, 8 of them from before" in localise().out
    assert summary()["rows"] == before


def test_a_shortlist_and_smaller_pictures(localise, summary, tmp_path: Path) -> None:
    localise(shortlist=2)
    records = [json.loads(line) for line in (tmp_path / "out" / "records.jsonl").read_text().splitlines()]
    assert {sum(count >= 0 for count in record["counts"]) for record in records} == {2}
    assert summary()["protocol"]["shortlist"] == 2
    localise(longest_side=140, out=tmp_path / "small")
    assert summary("small")["protocol"]["longest_side"] == 140
    assert summary("small")["rows"] != summary()["rows"]


def test_every_second_moment(localise, summary) -> None:
    printed = localise(step=2)
    assert "drive: 2 pairs" in printed.out
    content = summary()
    assert {(row["queries"], row["references"]) for row in content["rows"]} == {(2, 2)}
    assert content["protocol"]["remarks"] == ["one moment in 2 of each record"]
    assert "note: one moment in 2 of each record" in printed.err
