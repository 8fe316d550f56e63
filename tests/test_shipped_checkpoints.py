"""The checkpoints inside the package: their cards, their size, and that they do what they are shipped for."""

import json

import pytest
import torch

from diffnav.checkpoints import checkpoint_sha256, load_enhancer, read_checkpoint, shipped_checkpoints
from diffnav.darkness import DarknessModel, darken, invert_gamma
from diffnav.data.scenes import SceneWindows
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.retinex.state import component_state, illumination_is_alive
from diffnav.scores import psnr

SHIPPED = sorted(shipped_checkpoints())
# The published designs beside them are shipped as they are, to compare with.
OURS = [name for name in SHIPPED if read_checkpoint(name)["kind"] in ("retinex", "direct")]


@pytest.fixture(scope="module")
def pairs():
    """Three windows of the embedded world, which no training saw, dark and in daylight."""
    pictures = [image for _, image in SceneWindows(seed=11, count=3, size=(128, 192))]
    darks = [darken(picture, DarknessModel().draw(picture.max().item(), seed)) for seed, picture in enumerate(pictures)]
    return torch.stack(darks), torch.stack(pictures)


def test_the_promised_checkpoints_ship():
    assert {"compact", "compact_joint", "lightennet", "zero_dce"} <= set(SHIPPED)
    assert {"compact", "compact_joint", "matcher", "matcher_enhance_only"} <= set(OURS)


@pytest.mark.parametrize("name", SHIPPED)
def test_each_has_a_card_with_its_hash_and_is_small(name):
    path = shipped_checkpoints()[name]
    assert checkpoint_sha256(name) in path.with_suffix(".md").read_text()
    assert path.stat().st_size <= 6_000_000


@pytest.mark.parametrize("name", SHIPPED)
def test_each_card_says_how_large_it_is_and_how_it_was_trained(name):
    card = shipped_checkpoints()[name].with_suffix(".md").read_text()
    provenance = read_checkpoint(name)["provenance"]
    config = json.loads(provenance["config"])
    assert f"{load_enhancer(name).parameter_count:,} parameters" in card
    assert f"run={provenance['run']}" in card
    assert f"{provenance['step']:,}" in card
    assert f"{config['training']['steps']:,} steps" in card
    assert f"batch {config['training']['batch']} of {config['data']['patch']}x{config['data']['patch']}" in card
    assert config["precision"] in card


@pytest.mark.parametrize("name", OURS)
def test_each_of_ours_brightens_better_than_a_fourth_root(name, pairs):
    low, normal = pairs
    with torch.no_grad():
        enhanced = load_enhancer(name)(low)
    assert (psnr(enhanced, normal) - psnr(invert_gamma(low, 4.0), normal)).mean() > 0


@pytest.mark.parametrize("name", OURS)
def test_the_illumination_of_each_retinex_is_alive(name, pairs):
    enhancer = load_enhancer(name)
    if not isinstance(enhancer, RetinexEnhancer):
        pytest.skip(f"{name} has no illumination")
    with torch.no_grad():
        state = component_state(enhancer.components(pairs[0]))
    assert illumination_is_alive({key: value.item() for key, value in state.items()}), state
