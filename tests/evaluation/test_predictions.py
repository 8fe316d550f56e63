"""Keys change with everything that could change a picture, and with nothing else; the cache gives back what it got."""

import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import nn

import diffnav
from diffnav.checkpoints import checkpoint_sha256, save_enhancer
from diffnav.darkness import Darkening
from diffnav.data.pairs import WholePair
from diffnav.enhancers.clahe import Clahe
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.input import Input
from diffnav.errors import UserError
from diffnav.evaluation.fingerprints import modules_behind
from diffnav.evaluation.methods import Method, checkpoint_methods, require_distinct
from diffnav.evaluation.predictions import Prediction, PredictionCache, pair_digest, prediction_key
from diffnav.evaluation.provenance import git_commit, versions
from diffnav.evaluation.workers import one_thread
from diffnav.images import quantise
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer

RECORD = Darkening(4.0, 0.9, seed=5)


def pair(**changes: object) -> WholePair:
    low = torch.rand(3, 8, 10, generator=torch.Generator().manual_seed(1))
    whole = {"low": low, "normal": low.sqrt(), "name": "a", "site": "b", "record": RECORD}
    return {**whole, **changes}  # type: ignore[typeddict-item,return-value]


def network(seed: int = 0, **settings: object) -> RetinexEnhancer:
    torch.manual_seed(seed)
    return RetinexEnhancer(width=4, **settings).eval()  # type: ignore[arg-type]


def of(enhancer: nn.Module, name: str = "a", **settings: object) -> Method:
    return Method(name, enhancer, settings)


def test_a_pair_is_known_by_its_pixels_and_its_darkening() -> None:
    digest = pair_digest(pair())
    assert digest == pair_digest(pair(name="other", site="elsewhere"))
    touched = pair()["low"].clone()
    touched[2, 7, 9] += 1 / 255
    others = [
        pair(low=touched),
        pair(normal=touched),
        pair(low=pair()["low"].reshape(3, 10, 8)),
        pair(record=replace(RECORD, gamma=4.1)),
        pair(record=replace(RECORD, seed=6)),
        pair(record=None),
    ]
    assert len({digest, *map(pair_digest, others)}) == len(others) + 1


def test_a_method_is_known_by_weights_settings_and_code() -> None:
    same = [of(network(), "a"), of(network(), "b")]
    assert same[0].fingerprint == same[1].fingerprint
    touched = network()
    with torch.no_grad():
        next(touched.parameters()).view(-1)[0] += 1e-6
    others = [
        of(network(1)),
        of(touched),
        of(network(), tile_pixels=100),
        of(GammaBlind(), gamma=4.0),
        of(GammaBlind(), gamma=3.0),
        of(Input()),
        of(Clahe()),
    ]
    assert len({same[0].fingerprint, *(method.fingerprint for method in others)}) == len(others) + 1


def test_a_method_is_known_by_the_code_it_draws_from() -> None:
    """gamma_blind calls `invert_gamma`: both files are part of it, and Decom-Net's is part of a network."""
    gamma = modules_behind({"diffnav.enhancers.gamma_blind"})
    assert {"diffnav.enhancers.gamma_blind", "diffnav.darkness"} <= gamma
    assert "diffnav.retinex.decom" not in gamma
    retinex = modules_behind({type(part).__module__ for part in network().modules()})
    assert {"diffnav.retinex.enhancer", "diffnav.retinex.decom", "diffnav.retinex.tiles"} <= retinex


def test_threads_change_the_time_not_the_picture() -> None:
    """So predictions of eval.matching, whose workers have one thread, serve eval.enhancement."""
    before = of(network()).fingerprint
    with one_thread():
        assert of(network()).fingerprint == before


def test_a_key_needs_both_sides() -> None:
    keys = {prediction_key(a, b) for a in ("x", "y") for b in ("x", "y")}
    assert len(keys) == 4
    assert all(len(key) == 32 for key in keys)


def test_the_cache_gives_back_what_it_got(tmp_path: Path) -> None:
    cache = PredictionCache(tmp_path / "a folder")
    image = quantise(torch.rand(3, 9, 7))
    assert cache.get("ab" * 16) is None
    cache.put("ab" * 16, Prediction(image, 0.25, {"R_mean": 0.5}, "a machine"))
    stored = PredictionCache(tmp_path / "a folder").get("ab" * 16)
    assert stored is not None
    assert torch.equal(stored.image, image)
    assert (stored.seconds, stored.state, stored.device) == (0.25, {"R_mean": 0.5}, "a machine")
    assert cache.get("ac" * 16) is None


def test_damaged_and_half_written_predictions_count_as_none(tmp_path: Path) -> None:
    cache = PredictionCache(tmp_path)
    for suffix, rest in ((".png", b"\x89PNG"), (".json", b'{"seconds"')):
        cache.put("cd" * 16, Prediction(torch.zeros(3, 4, 4), 1.0))
        assert cache.get("cd" * 16) is not None
        (tmp_path / "cd" / ("cd" * 16)).with_suffix(suffix).write_bytes(rest)
        assert cache.get("cd" * 16) is None


def test_no_folder_keeps_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    cache = PredictionCache(None)
    cache.put("k", Prediction(torch.zeros(3, 4, 4), 1.0))
    assert cache.get("k") is None
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cache="):
        PredictionCache(tmp_path / "file" / "below")


def test_checkpoints_are_named_after_run_or_file(tmp_path: Path) -> None:
    (tmp_path / "run_a").mkdir()
    for place in ("run_a/best.pt", "bright.pt"):
        save_enhancer(tmp_path / place, network(), "joint", {})
    device = torch.device("cpu")
    rows = checkpoint_methods([str(tmp_path / "run_a"), str(tmp_path / "bright.pt")], device)
    assert [row.name for row in rows] == ["run_a", "bright"]
    assert rows[0].sha256 == checkpoint_sha256(tmp_path / "run_a")
    assert rows[0].parameters == sum(p.numel() for p in network().parameters())
    assert rows[0].megabytes == rows[0].parameters * 4 / 1e6
    twice = checkpoint_methods([str(tmp_path / "run_a"), str(tmp_path / "run_a" / "best.pt")], device)
    assert len({row.name for row in twice}) == 2


def test_a_missing_checkpoint_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no checkpoint nowhere"):
        checkpoint_methods(["nowhere"], torch.device("cpu"))
    save_enhancer(tmp_path / "decom.pt", network(), "decom", {})
    with pytest.raises(UserError, match="Decom-Net alone"):
        checkpoint_methods([str(tmp_path / "decom.pt")], torch.device("cpu"))


def test_two_rows_of_one_name_are_one_sentence() -> None:
    with pytest.raises(UserError, match="two rows would be called a"):
        require_distinct([of(Input()), of(Clahe())])


def test_a_direct_network_is_a_method_too(tmp_path: Path) -> None:
    save_enhancer(tmp_path / "direct.pt", DirectEnhancer(width=4), "direct", {})
    (row,) = checkpoint_methods([str(tmp_path / "direct.pt")], torch.device("cpu"))
    assert row.settings["width"] == 4


def test_versions_and_commit() -> None:
    found = versions()
    assert found["torch"] == torch.__version__ or found["torch"] in torch.__version__
    assert found["diffnav"] == diffnav.__version__
    root = Path(diffnav.__file__).parents[1]
    head = subprocess.run(["git", "-C", str(root), "rev-parse", "HEAD"], capture_output=True, text=True)
    if head.returncode:
        pytest.skip("not a git clone")
    commit = git_commit()
    assert commit is not None
    assert commit.removesuffix("+changes") == head.stdout.strip()
