"""python -m eval.enhancement from end to end on three tiny pictures: files, schema, figures, a user's mistakes."""

import csv
import json
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from PIL import Image

from diffnav.checkpoints import checkpoint_sha256, save_enhancer
from diffnav.darkness import DarknessModel, darken
from diffnav.data.pairs import photo_seed
from diffnav.images import read_image, write_image
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer
from diffnav.scores import psnr, ssim
from eval.enhancement import main

ALWAYS = ["input", "gamma_blind", "gamma_oracle", "clahe"]
SIZES = {"a_1": (24, 32), "a_2": (33, 20), "b_1": (24, 32)}
Evaluate = Callable[..., str]


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three pictures of two sites, in a folder whose name needs quoting."""
    folder = tmp_path_factory.mktemp("data") / "my photos, gamma=4"
    for number, (name, size) in enumerate(SIZES.items()):
        y, x = torch.meshgrid(torch.arange(size[0]), torch.arange(size[1]), indexing="ij")
        waves = [0.55 + 0.4 * torch.sin((x + number) / (4 + k)) * torch.cos(y / 5) for k in range(3)]
        write_image(folder / f"{name}.png", torch.stack(waves))
    return folder


@pytest.fixture(scope="module")
def networks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("networks")
    torch.manual_seed(0)
    save_enhancer(folder / "small.pt", RetinexEnhancer(width=4), "joint", {})
    save_enhancer(folder / "plain.pt", DirectEnhancer(width=4), "direct", {})
    save_enhancer(folder / "decom.pt", RetinexEnhancer(width=4), "decom", {})
    return folder


@pytest.fixture
def evaluate(
    photos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Evaluate:
    """Run the command in this process, on the three pictures, into tmp_path/out; what it prints."""

    def run(*arguments: str, root: Path = photos) -> str:
        fixed = [f'data.root="{root}"', f"out={tmp_path / 'out'}", "device=cpu"]
        monkeypatch.setattr(sys, "argv", ["eval.enhancement", *fixed, *arguments])
        main()
        return capsys.readouterr().out

    return run


def mistake(evaluate: Evaluate, capsys: pytest.CaptureFixture[str], *arguments: str, root: Path | None = None) -> str:
    """The one sentence that a mistake ends with."""
    with pytest.raises(SystemExit) as left:
        evaluate(*arguments, **({"root": root} if root else {}))
    assert left.value.code == 2
    lines = [line for line in re.split("[\r\n]", capsys.readouterr().err) if line and "enhancing" not in line]
    assert len(lines) == 1, lines
    assert lines[0].startswith("error: ")
    return lines[0]


def summary(tmp_path: Path) -> dict:
    return json.loads((tmp_path / "out" / "enhancement.json").read_text())


def test_everything_from_one_command(evaluate: Evaluate, networks: Path, photos: Path, tmp_path: Path) -> None:
    checkpoints = f"checkpoint=[{networks / 'small.pt'},{networks / 'plain.pt'}]"
    printed = evaluate(checkpoints, "seed=3", "figures.count=2")
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {
        *("enhancement.json", "enhancement.md", "per_image.csv", "records.jsonl"),
        *("figure_5_small.png", "figure_6.png", "figure_9.jpg"),
    }
    for name in ("figure_5_small.png", "figure_6.png", "figure_9.jpg"):
        with Image.open(out / name) as picture:
            assert min(picture.size) > 200
            assert len(picture.convert("RGB").resize((40, 40)).getcolors(1_600)) > 20
    rows, protocol = (summary(tmp_path)[key] for key in ("rows", "protocol"))
    assert [row["method"] for row in rows] == [*ALWAYS, "small", "plain"]
    for row in rows:
        assert {"method", "psnr", "psnr_ci", "ssim", "ssim_ci", "seconds", "parameters", "n"} <= row.keys()
        assert row["n"] == 3
        assert row["psnr_ci"][0] <= row["psnr"] <= row["psnr_ci"][1]
        assert row["ssim_ci"][0] <= row["ssim"] <= row["ssim_ci"][1]
        assert set(row["per_source"]) == {"a", "b"}
        assert row["method"] in printed
    small = sum(p.numel() for p in RetinexEnhancer(width=4).parameters())
    assert [row["parameters"] for row in rows] == [0, 0, 0, 0, small, rows[5]["parameters"]]
    assert rows[4]["megabytes"] == pytest.approx(small * 4e-6, abs=1e-3)
    assert {f"{part}_{what}" for part in ("R", "I", "Ih") for what in ("mean", "std", "saturated")} == set(
        rows[4]["state"]
    )
    assert protocol["weights_sha256"] == {n: checkpoint_sha256(networks / f"{n}.pt") for n in ("small", "plain")}
    assert (protocol["n"], protocol["seed"], protocol["root"]) == (3, 3, str(photos))
    assert protocol["darkness"]["gamma"] == [3.0, 5.0]
    assert protocol["versions"]["torch"]
    assert protocol["device"]


def test_rows_are_the_means_of_independent_scores(evaluate: Evaluate, photos: Path, tmp_path: Path) -> None:
    evaluate("enhancers=[normal]", "seed=3", "figures.count=0")
    oracle, normal_rows = [], []
    for name in SIZES:
        normal = read_image(photos / f"{name}.png")
        drawn = DarknessModel().draw(normal.max().item(), photo_seed(3, name))
        bright = drawn.maximum * (darken(normal, drawn) / drawn.maximum) ** (1 / drawn.gamma)
        oracle.append((psnr(bright[None], normal[None]).item(), ssim(bright[None], normal[None]).item()))
        normal_rows.append((120.0, 1.0))
    rows = {row["method"]: row for row in summary(tmp_path)["rows"]}
    for method, scores in (("gamma_oracle", oracle), ("normal", normal_rows)):
        means = [sum(column) / 3 for column in zip(*scores, strict=True)]
        assert [rows[method]["psnr"], rows[method]["ssim"]] == pytest.approx(means, abs=1e-3)
    with (tmp_path / "out" / "per_image.csv").open() as file:
        table = [line for line in csv.DictReader(file) if line["method"] == "gamma_oracle"]
    assert [line["name"] for line in table] == list(SIZES)
    assert [float(line["psnr"]) for line in table] == pytest.approx([score[0] for score in oracle], abs=1e-3)
    assert [(int(line["height"]), int(line["width"])) for line in table] == list(SIZES.values())


def test_the_same_command_again_reuses_and_agrees(evaluate: Evaluate, networks: Path, tmp_path: Path) -> None:
    arguments = (f"checkpoint={networks / 'small.pt'}", "figures.count=0")
    assert "15 results, 0 of them from before" in evaluate(*arguments)
    first = summary(tmp_path)
    assert "15 results, 15 of them from before" in evaluate(*arguments)
    assert summary(tmp_path) == first
    assert "12 results, 0 of them from before" in evaluate("seed=1", "figures.count=0")


def test_the_markdown_page(evaluate: Evaluate, networks: Path, photos: Path, tmp_path: Path) -> None:
    broken = tmp_path / "photos"
    shutil.copytree(photos, broken)
    (broken / "c_1.jpg").write_bytes(b"no picture")
    evaluate(f"checkpoint={networks / 'small.pt'}", "figures.count=0", root=broken)
    page = (tmp_path / "out" / "enhancement.md").read_text()
    rows = {row["method"]: row for row in summary(tmp_path)["rows"]}
    low, high = rows["clahe"]["psnr_ci"]
    assert f"{rows['clahe']['psnr']:.2f} [{low:.2f}, {high:.2f}]" in page
    source = rows["small"]["per_source"]["a"]
    assert f"{source['psnr']:.2f} / {source['ssim']:.3f}" in page
    assert "Is the Retinex alive?" in page
    assert f"{rows['small']['state']['Ih_mean']:.3f} ± {rows['small']['state']['Ih_std']:.3f}" in page
    assert "c_1.jpg" in page
    assert summary(tmp_path)["protocol"]["n"] == 3
    # The paper's own figures stand in a table of their own.
    table_1 = page.split("## ")[0]
    assert "21.07" not in table_1
    assert "21.07" in page


def test_settings_of_an_enhancer_and_double_names(evaluate: Evaluate, tmp_path: Path) -> None:
    evaluate("enhancers=[clahe,{clahe: {grid: 1}}]", "figures.count=0")
    rows, protocol = (summary(tmp_path)[key] for key in ("rows", "protocol"))
    assert [row["method"] for row in rows] == [*ALWAYS, "clahe(grid=1)"]
    assert protocol["settings"]["clahe(grid=1)"]["grid"] == 1
    assert rows[3]["psnr"] != rows[4]["psnr"]


def test_real_pairs(evaluate: Evaluate, photos: Path, tmp_path: Path) -> None:
    root = tmp_path / "pairs"
    shutil.copytree(photos, root / "high")
    for path in (root / "high").iterdir():
        write_image(root / "low" / path.name, 0.4 * read_image(path))
    evaluate("data=lol", "figures.count=1", root=root)
    rows = {row["method"]: row for row in summary(tmp_path)["rows"]}
    assert (rows["gamma_oracle"]["psnr"], rows["gamma_oracle"]["n"]) == (None, 0)
    assert "real dark pictures" in rows["gamma_oracle"]["failures"][0]["why"]
    assert summary(tmp_path)["protocol"]["darkness"] == "as stored"
    dark = [psnr(*(read_image(root / side / f"{name}.png")[None] for side in ("low", "high"))).item() for name in SIZES]
    assert rows["input"]["psnr"] == pytest.approx(sum(dark) / 3, abs=1e-3)


def test_limit_and_part(evaluate: Evaluate, tmp_path: Path) -> None:
    evaluate("limit=2", "figures.count=0")
    assert summary(tmp_path)["rows"][0]["n"] == 2
    evaluate("data=folder", "part=validation", "data.size=null", "figures.count=0")
    held_out = summary(tmp_path)["rows"][0]["per_source"]
    assert len(held_out) == 1


def test_the_embedded_world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = f"out={tmp_path / 'out'}"
    world = ["data=scenes", "data.photos.count=1", "data.photos.size=[32,48]", "figures.count=0", out, "device=cpu"]
    monkeypatch.setattr(sys, "argv", ["eval.enhancement", *world])
    main()
    assert summary(tmp_path)["rows"][0]["n"] == 1
    assert summary(tmp_path)["protocol"]["root"] is None


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("checkpoint=nowhere", "no checkpoint nowhere"),
        ("enhancers=[brighter]", r"unknown enhancer 'brighter'; there are .*clahe.*gamma_blind"),
        ("enhancers=[{clahe: {clip: 3}}]", "has no setting clip; its settings: clip_limit, grid, channel"),
        ("limit=0", "limit must be"),
        ("part=validation", "needs a split"),
        ("reference=srie", "reference=srie is no row"),
        ("figures.sites=[z]", "figures.sites names no source"),
    ],
)
def test_mistakes_are_one_sentence(
    argument: str, expected: str, evaluate: Evaluate, capsys: pytest.CaptureFixture[str]
) -> None:
    assert re.search(expected, mistake(evaluate, capsys, argument))


def test_mistakes_about_files_are_one_sentence(
    evaluate: Evaluate, networks: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "Decom-Net alone" in mistake(evaluate, capsys, f"checkpoint={networks / 'decom.pt'}")
    assert "no folder" in mistake(evaluate, capsys, root=tmp_path / "nothing")
    (tmp_path / "empty").mkdir()
    assert "no images" in mistake(evaluate, capsys, root=tmp_path / "empty")
    (tmp_path / "file").write_text("")
    assert "choose another out=" in mistake(evaluate, capsys, f"out={tmp_path / 'file' / 'below'}")
