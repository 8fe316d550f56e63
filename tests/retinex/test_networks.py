"""The two networks and the enhancers made of them: sizes, wiring, ranges."""

from pathlib import Path

import pytest
import torch
from omegaconf import OmegaConf
from torch import Tensor
from torch.nn import functional as F

from diffnav.errors import UserError
from diffnav.retinex.decom import DecomNet
from diffnav.retinex.enhance import EnhanceNet
from diffnav.retinex.enhancer import DirectEnhancer, RetinexEnhancer

PRESETS = Path(__file__).parents[2] / "conf" / "network"
SWITCHES = [
    {},
    {"padding": "zeros"},
    {"jump": "concat"},
    {"max_channel": False},
    {"up_kernel": 2},
    {"activation": "relu"},
    {"activation": "none"},
]


def conv(inputs: int, outputs: int, kernel: int) -> int:
    return inputs * outputs * kernel**2 + outputs


def counts(*modules: torch.nn.Module) -> list[int]:
    return [sum(p.numel() for p in module.parameters()) for module in modules]


def random_images(*size: int, batch: int = 2, seed: int = 0) -> Tensor:
    return torch.rand(batch, 3, *size, generator=torch.Generator().manual_seed(seed))


def make(kind=RetinexEnhancer, seed: int = 0, **settings):
    """A narrow network in evaluation mode, its weights large enough that every connection shows."""
    torch.manual_seed(seed)
    enhancer = kind(**{"width": 6, **settings}).eval()
    with torch.no_grad():
        for parameter in enhancer.parameters():
            parameter.mul_(1.5)
    return enhancer


def test_paper_sizes_layer_by_layer():
    decom, enhance = DecomNet(), EnhanceNet()
    assert counts(*decom.layers) == [conv(4, 64, 3), *[conv(64, 64, 3)] * 6, conv(64, 4, 3)]
    inputs = [4, 64, 64, 64, 128, 128, 128]
    assert counts(*enhance.blocks) == [conv(i, 64, 3) + conv(64, 64, 3) for i in inputs]
    assert counts(*enhance.downs) == [conv(64, 64, 2)] * 3
    assert counts(*enhance.ups) == [conv(64, 64, 4)] * 3
    assert counts(enhance.fuse, enhance.last) == [conv(256, 64, 3), conv(64, 1, 3)]
    assert counts(decom, enhance) == [226_244, 987_265]
    strides = {(conv.kernel_size, conv.stride) for conv in decom.modules() if isinstance(conv, torch.nn.Conv2d)}
    assert strides == {((3, 3), (1, 1))}, "D1"


def test_sizes_of_the_presets_and_of_the_other_readings():
    assert RetinexEnhancer().parameter_count == 1_213_509
    assert counts(DecomNet(jump="concat"), EnhanceNet(up_kernel=2)) == [410_564, 839_809]
    assert RetinexEnhancer(jump="concat", up_kernel=2).parameter_count == 1_250_373
    presets = {path.stem: RetinexEnhancer(**OmegaConf.load(path)) for path in PRESETS.glob("*.yaml")}
    assert presets["paper"].parameter_count == 1_213_509
    assert presets["compact"].parameter_count == 305_701
    assert 1 / 4 <= 305_701 / 1_213_509 <= 1 / 2
    assert presets["paper"].settings == RetinexEnhancer().settings


def slow_enhancer(weights: dict[str, Tensor], image: Tensor, settings: dict) -> tuple[Tensor, Tensor, Tensor]:
    """R, I and the last layer's output, written out after PAPER.md section 1 from the weights alone."""

    def conv3(x: Tensor, name: str) -> Tensor:
        mode = "replicate" if settings.get("padding", "replicate") == "replicate" else "constant"
        return F.conv2d(F.pad(x, (1, 1, 1, 1), mode), weights[f"{name}.weight"], weights[f"{name}.bias"])

    def block(x: Tensor, k: int) -> Tensor:
        x = F.relu(conv3(x, f"enhance.blocks.{k}.0"))
        return F.relu(conv3(x, f"enhance.blocks.{k}.2"))

    def down(x: Tensor, k: int) -> Tensor:
        return F.conv2d(x, weights[f"enhance.downs.{k}.weight"], weights[f"enhance.downs.{k}.bias"], stride=2)

    def up(x: Tensor, k: int) -> Tensor:
        padding = {4: 1, 2: 0}[settings.get("up_kernel", 4)]
        weight, bias = weights[f"enhance.ups.{k}.weight"], weights[f"enhance.ups.{k}.bias"]
        return F.conv_transpose2d(x, weight, bias, stride=2, padding=padding)

    def repeat(x: Tensor, factor: int) -> Tensor:
        return x.repeat_interleave(factor, 2).repeat_interleave(factor, 3)

    if settings.get("max_channel", True):
        image = torch.cat([image, torch.maximum(torch.maximum(image[:, :1], image[:, 1:2]), image[:, 2:])], 1)
    o = {0: F.relu(conv3(image, "decom.layers.0"))}
    o[1] = F.relu(conv3(o[0], "decom.layers.1"))
    for k in range(2, 7):
        concat = settings.get("jump") == "concat"
        joined = torch.cat([o[k - 2], o[k - 1]], 1) if concat else o[k - 2] + o[k - 1]
        o[k] = F.relu(conv3(joined, f"decom.layers.{k}"))
    out = 1 / (1 + torch.exp(-conv3(o[6], "decom.layers.7")))
    R, I = out[:, :3], out[:, 3:4]

    block1 = block(out, 0)
    block2 = block(down(block1, 0), 1)
    block3 = block(down(block2, 1), 2)
    block4 = block(down(block3, 2), 3)
    up4 = up(block4, 0)
    block5 = block(torch.cat([up4, block3], 1), 4)
    up5 = up(block5, 1)
    block6 = block(torch.cat([up5, block2], 1), 5)
    up6 = up(block6, 2)
    block7 = block(torch.cat([up6, block1], 1), 6)
    fused = torch.cat([block7, repeat(up4, 4), repeat(up5, 2), up6], 1)
    return R, I, conv3(F.relu(conv3(fused, "enhance.fuse")), "enhance.last")


@pytest.mark.parametrize("settings", SWITCHES)
@torch.no_grad()
def test_the_wiring_is_the_papers(settings):
    enhancer, image = make(**settings), random_images(24, 40)
    R, I, last = slow_enhancer(enhancer.state_dict(), image, settings)
    functions = {"sigmoid": torch.sigmoid, "relu": torch.relu, "none": torch.clone}
    Ih = functions[settings.get("activation", "sigmoid")](last)
    parts = enhancer.components(image)
    for name, expected in {"R": R, "I": I, "Ih": Ih, "enhanced": Ih * R}.items():
        torch.testing.assert_close(getattr(parts, name), expected, msg=lambda text, name=name: f"{name}: {text}")
    torch.testing.assert_close(enhancer(image), (Ih * R).clamp(0, 1))
    torch.testing.assert_close(torch.cat(enhancer.decompose(image), 1), torch.cat([R, I], 1))


@torch.no_grad()
def test_the_direct_rival_has_the_same_trunks():
    direct, image = make(DirectEnhancer), random_images(24, 40)
    torch.testing.assert_close(direct(image), slow_enhancer(direct.state_dict(), image, {})[2].sigmoid())
    assert DirectEnhancer().parameter_count == 1_213_509 + 2 * (64 * 9 + 1), "two more output channels"


@pytest.mark.parametrize("kind", [RetinexEnhancer, DirectEnhancer])
@pytest.mark.parametrize("size", [(16, 16), (17, 23), (31, 16), (40, 57)])
@torch.no_grad()
def test_any_size_and_ranges(kind, size):
    enhancer, image = make(kind), random_images(*size)
    enhanced = enhancer(image)
    assert enhanced.shape == image.shape
    assert (enhanced > 0).all()
    assert (enhanced < 1).all()
    # Reflection to the right and below up to a multiple of 8, cropped again.
    rows = [*range(size[0]), *(size[0] - 2 - k for k in range(-size[0] % 8))]
    columns = [*range(size[1]), *(size[1] - 2 - k for k in range(-size[1] % 8))]
    padded = enhancer(image[:, :, rows][:, :, :, columns])
    torch.testing.assert_close(enhanced, padded[:, :, : size[0], : size[1]])
    if kind is RetinexEnhancer:
        parts = enhancer.components(image)
        shapes = [tuple(part.shape[1:]) for part in parts]
        assert shapes == [(3, *size), (1, *size), (1, *size), (3, *size)]
        assert all(part.min() > 0 and part.max() < 1 for part in parts)


@torch.no_grad()
def test_the_papers_image_size():
    compact = RetinexEnhancer(**OmegaConf.load(PRESETS / "compact.yaml")).eval()
    assert compact(random_images(400, 600, batch=1)).shape == (1, 3, 400, 600)


@pytest.mark.parametrize("size", [(15, 16), (16, 8), (1, 1)])
def test_images_below_16_are_refused(size):
    with pytest.raises(ValueError, match=f"16 x 16 or more, got {size[1]} x {size[0]}"):
        make()(random_images(*size))


def test_evaluation_clips_where_the_activation_does_not():
    enhancer, image = make(activation="none", seed=3), random_images(16, 16)
    with torch.no_grad():
        enhancer.enhance.last.weight.mul_(50)
        raw, clipped = enhancer.train()(image), enhancer.eval()(image)
    assert raw.min() < 0 or raw.max() > 1
    torch.testing.assert_close(clipped, raw.clamp(0, 1))


@pytest.mark.parametrize(
    "settings", [{"jump": "sum"}, {"up_kernel": 3}, {"activation": "tanh"}, {"padding": "wrap"}, {"width": 0}]
)
def test_unknown_switches_are_one_sentence(settings):
    with pytest.raises(UserError, match=f"^network.{next(iter(settings))} must be [^\n]+$"):
        RetinexEnhancer(**settings)


def test_exact_reflectance_keeps_every_detail() -> None:
    """R = S / (I + .001), clipped, with Decom-Net's own I; nothing else changes."""
    torch.manual_seed(0)
    plain, exact = RetinexEnhancer(width=4), RetinexEnhancer(width=4, reflectance="exact")
    exact.load_state_dict(plain.state_dict())
    image = 0.4 * torch.rand(1, 3, 16, 24)
    parts, network = exact.components(image), plain.components(image)
    for S, R in zip(image[0].flatten(1).tolist(), parts.R[0].flatten(1).tolist(), strict=True):
        for s, r, i in zip(S, R, network.I.flatten().tolist(), strict=True):
            assert r == pytest.approx(min(s / (i + 0.001), 1), abs=1e-6)
    assert torch.equal(parts.I, network.I)
    torch.testing.assert_close(parts.enhanced, parts.Ih * parts.R)
    assert exact.settings == {**plain.settings, "reflectance": "exact"}


def test_the_residual_begins_as_nothing_and_adds_detail_of_either_sign() -> None:
    torch.manual_seed(0)
    network = RetinexEnhancer(width=4, detail=True)
    image = torch.rand(1, 3, 16, 24)
    parts = network.components(image)
    torch.testing.assert_close(parts.enhanced, parts.Ih * parts.R)
    torch.nn.init.constant_(network.enhance.detail.bias, -0.25)
    moved = network.components(image)
    assert torch.equal(moved.Ih, parts.Ih)
    torch.testing.assert_close(moved.enhanced, parts.Ih * parts.R - 0.25)
    assert network.settings["detail"] is True
    assert "detail" not in RetinexEnhancer(width=4).settings
