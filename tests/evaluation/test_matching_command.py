"""python -m eval.matching from end to end on small pictures: files, schema, figures, kinds of pairs, mistakes."""

import csv
import json
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from matching_stubs import picture
from PIL import Image

from diffnav.checkpoints import checkpoint_sha256, save_enhancer
from diffnav.images import read_image, write_image
from diffnav.retinex.enhancer import RetinexEnhancer
from eval import enhancement
from eval.matching import main

ALWAYS = ["input", "gamma_blind", "gamma_oracle", "clahe", "normal"]
SIZE = (72, 96)
Evaluate = Callable[..., str]


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three pictures of two sites, in a folder whose name needs quoting."""
    folder = tmp_path_factory.mktemp("data") / "my photos, gamma=4"
    for number, name in enumerate(("a_1", "a_2", "b_1")):
        write_image(folder / f"{name}.png", picture(number, SIZE))
    return folder


@pytest.fixture
def evaluate(
    photos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Evaluate:
    """Run the command in this process, on the three pictures, into tmp_path/out; what it prints."""

    def run(*arguments: str, root: Path = photos, command: Callable[[], None] = main) -> str:
        files = [f'data.root="{root}"', f"out={tmp_path / 'out'}", f"cache={tmp_path / 'cache'}"]
        own = ["workers=1", "enhancers=[]", "matchers=[sift,orb]"] if command is main else []
        monkeypatch.setattr(sys, "argv", ["eval.matching", *files, *own, "device=cpu", *arguments])
        command()
        return capsys.readouterr().out

    return run


def summary(tmp_path: Path) -> dict:
    return json.loads((tmp_path / "out" / "matching.json").read_text())


def test_files_and_schema(evaluate: Evaluate, photos: Path, tmp_path: Path) -> None:
    torch.manual_seed(0)
    save_enhancer(tmp_path / "small.pt", RetinexEnhancer(width=4), "joint", {})
    printed = evaluate(f"checkpoint={tmp_path / 'small.pt'}", "seed=3", "figures.matchers=[sift]")
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {
        "matching.json", "matching.md", "per_pair.csv", "records.jsonl", "figure_1_sift.jpg",
    }  # fmt: skip
    assert "36 results, 0 of them from before, 1 figures" in printed
    with Image.open(out / "figure_1_sift.jpg") as figure:
        assert figure.size[0] > 3 * figure.size[1] / 3 > 200
    rows, protocol = (summary(tmp_path)[key] for key in ("rows", "protocol"))
    assert [(row["method"], row["matcher"]) for row in rows] == [
        (method, matcher) for method in [*ALWAYS, "small"] for matcher in ("sift", "orb")
    ]
    for row in rows:
        assert {
            "method", "matcher", "pairs", "mp", "correct", "correct_ci", "precision", "auc1", "auc3", "auc5",
            "seconds_enhance", "seconds_match", "seconds_detect", "inliers", "inlier_ratio", "repeatability", "n",
        } <= row.keys()  # fmt: skip
        assert (row["pairs"], row["n"]) == ("rot180", 3)
        assert row["correct_ci"][0] <= row["correct"] <= row["correct_ci"][1]
        assert row["correct"] <= row["mp"]
        assert set(row["per_source"]) == {"a", "b"}
        assert set(row["versus"]) == {"input", "gamma_blind"} - {row["method"]}
    by_name = {(row["method"], row["matcher"]): row for row in rows}
    # The daylight picture against itself, turned: every keypoint is found again.
    assert by_name["normal", "sift"]["repeatability"] > 0.95
    assert by_name["normal", "sift"]["precision"] > 0.95
    assert by_name["normal", "sift"]["correct"] > by_name["input", "sift"]["correct"]
    assert protocol["weights_sha256"] == {"small": checkpoint_sha256(tmp_path / "small.pt")}
    assert (protocol["n"], protocol["seed"], protocol["root"]) == (3, 3, str(photos))
    assert protocol["pairs"]["kind"] == "rot180"
    assert protocol["matchers"]["sift"]["ratio"] == 0.75
    assert protocol["verification"]["seed"] == 3
    assert protocol["device"].endswith("1 thread(s)")
    with (out / "per_pair.csv").open() as file:
        table = [line for line in csv.DictReader(file) if (line["method"], line["matcher"]) == ("clahe", "orb")]
    assert [line["name"] for line in table] == ["a_1", "a_2", "b_1"]
    mean = sum(int(line["correct"]) for line in table) / 3
    assert by_name["clahe", "orb"]["correct"] == pytest.approx(mean, abs=1e-6)


def test_the_same_command_again_reuses_and_agrees(evaluate: Evaluate, tmp_path: Path) -> None:
    assert "30 results, 0 of them from before" in evaluate("figures.methods=[]")
    first = summary(tmp_path)
    assert "30 results, 30 of them from before" in evaluate("figures.methods=[]")
    assert summary(tmp_path) == first
    # One changed matcher: the other's records stay, and no picture is enhanced again.
    pictures = sorted((tmp_path / "cache").rglob("*.png"))
    changed = evaluate("figures.methods=[]", "matchers=[sift,{orb: {ratio: 0.9}}]")
    assert "30 results, 15 of them from before" in changed
    assert "orb(ratio=0.9)" in changed
    assert sorted((tmp_path / "cache").rglob("*.png")) == pictures


def test_eval_enhancement_and_rot180_share_their_pictures(evaluate: Evaluate, tmp_path: Path) -> None:
    evaluate("figures.methods=[]")
    pictures = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.png")}
    evaluate("enhancers=[normal]", "figures.count=0", f"out={tmp_path / 'table_1'}", command=enhancement.main)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.png")} == pictures


def test_homography_pairs(evaluate: Evaluate, tmp_path: Path) -> None:
    evaluate("pairs=homography", "pairs.scale=[1,1.2]", "pairs.rotation_deg=20", "figures.methods=[]")
    rows = {(row["method"], row["matcher"]): row for row in summary(tmp_path)["rows"]}
    assert rows["normal", "sift"]["pairs"] == "homography"
    assert rows["normal", "sift"]["precision"] > 0.8
    assert summary(tmp_path)["protocol"]["pairs"]["scale"] == [1, 1.2]


def test_real_pairs(evaluate: Evaluate, photos: Path, tmp_path: Path) -> None:
    root = tmp_path / "pairs"
    shutil.copytree(photos, root / "high")
    for path in (root / "high").iterdir():
        write_image(root / "low" / path.name, 0.4 * read_image(path))
    evaluate("pairs=lol", "figures.methods=[]", root=root)
    content = summary(tmp_path)
    assert [row["method"] for row in content["rows"][::2]] == ["input", "gamma_blind", "clahe"]
    assert [sentence.split(":")[0] for sentence in content["protocol"]["left_out"]] == ["gamma_oracle", "normal"]
    assert content["protocol"]["darkness"] == "as stored"
    assert content["protocol"]["data"] == "lol"
    assert "Left out: gamma_oracle: it needs to know" in (tmp_path / "out" / "matching.md").read_text()
    # Views of the same data's bright pictures are darkened by Eq. 9.
    evaluate("data=lol", "pairs=homography", "figures.methods=[]", root=root)
    assert summary(tmp_path)["protocol"]["darkness"]["gamma"] == [3, 5]


def test_sequences(evaluate: Evaluate, tmp_path: Path) -> None:
    for number in (1, 2):
        write_image(tmp_path / "seq" / "wall" / f"img{number}.png", picture(0, SIZE))
    (tmp_path / "seq" / "wall" / "H1to2p").write_text("1 0 0 0 1 0 0 0 1")
    evaluate("pairs=hpatches", "figures.methods=[]", root=tmp_path / "seq")
    rows = {(row["method"], row["matcher"]): row for row in summary(tmp_path)["rows"]}
    assert (rows["normal", "sift"]["n"], rows["normal", "sift"]["precision"]) == (1, 1)


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("matchers=[sifd]", r"unknown matcher 'sifd'; there are .*orb_gms.*sift"),
        ("matchers=[{sift: {ration: 1}}]", "matcher sift has no setting ration; its settings: features, ratio, mutual"),
        ("matchers=[]", "matchers is empty"),
        ("enhancers=[brighter]", "unknown enhancer 'brighter'"),
        ("pairs=rot90", "pairs can be homography, hpatches, lol, rot180"),
        ("pairs.scale=[1,2]", "pairs.scale"),
        ("reference=[input,srie]", "reference=srie is no row"),
        ("workers=0", "workers must be a whole number of 1 or more"),
        ("verification.threshold_px=-1", "verification.threshold_px must be above 0"),
        ("verification.model=fundamental", "verification.model must be homography"),
        ("figures.sites=[z]", "figures.sites names no source"),
        ("figures.methods=[net]", "figures.methods names net, which is not measured here; there are input"),
        ("figures.matchers=[surf]", "figures.matchers names surf"),
    ],
)
def test_mistakes_are_one_sentence(
    argument: str, expected: str, evaluate: Evaluate, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        evaluate(argument)
    assert left.value.code == 2
    (line,) = [line for line in re.split("[\r\n]", capsys.readouterr().err) if line]
    assert re.search(f"^error: .*{expected}", line)


def test_recipes_over_their_seeds(evaluate: Evaluate, tmp_path: Path) -> None:
    """What ships as two recipes: per picture the means of the seeds' own records, and what their control leaves."""
    names = {"ours": ["compact_joint", "lightennet"], "plain": ["compact", "zero_dce"]}
    seeds = f"seeds={{{', '.join(f'{group}: [{a},{b}]' for group, (a, b) in names.items())}}}"
    printed = evaluate(seeds, "controls={ours: plain}", "matchers=[orb]", "figures.methods=[]")
    assert "## Recipes over their seeds" in printed
    with (tmp_path / "out" / "per_pair.csv").open() as file:
        lines = list(csv.DictReader(file))
    means = {
        group: sum(int(line["correct"]) for line in lines if line["method"] in own) / 6 for group, own in names.items()
    }
    assert means["ours"] != means["plain"]
    ours, plain = summary(tmp_path)["seeds"]["orb"]
    assert (ours["group"], ours["control"], ours["seeds"], plain["control"]) == ("ours", "plain", 2, None)
    assert ours["mean"] == pytest.approx(means["ours"], abs=1e-5)
    assert ours["difference"][0] == pytest.approx(means["ours"] - means["plain"], abs=1e-5)
    shutil.rmtree(tmp_path / "out")
    evaluate(seeds, "controls={ours: plain}", "figures.count=0", command=enhancement.main)
    both = json.loads((tmp_path / "out" / "enhancement.json").read_text())["seeds"]
    assert set(both) == {"psnr", "ssim"}
    assert both["ssim"][0]["control"] == "plain"
