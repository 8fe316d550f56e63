"""LightGlue: a network that matches the keypoints of another one, with attention within and between the images."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import kornia.feature
import torch
from torch import Tensor

from diffnav.errors import UserError
from diffnav.matching.learned import device_of, freeze, open_weights
from diffnav.matching.matches import Features, Matcher, Matches
from diffnav.matching.nearest import count_positions_once, matches_at

RELEASES = "github.com/cvg/LightGlue, release v0.1_arxiv, or what kornia's LightGlue('disk'), ('aliked') download"
SHORTENED = "onnx/lighterglue_L3.onnx of github.com/noahzhy/xfeat_lightglue_onnx, converted"


class LightGlue:
    """The features of `extractor`, matched by attention; made of weights trained for these very features.

    extractor: finds the features; how it would match them is not used. weights: file, below the folder of published
    weights or with its whole path; it says how large the network is. name: of the row. min_confidence: a match is
    kept above it. device: where the network runs.

    Every layer runs and every keypoint stays: stopping early would save little at 500 features.
    Source: Lindenberger et al. 2023; for XFeat "LighterGlue", Potje et al. 2024.
    """

    def __init__(
        self,
        extractor: Matcher,
        weights: str,
        name: str = "lightglue",
        min_confidence: float = 0.1,
        device: str = "cpu",
    ) -> None:
        if not 0 <= min_confidence < 1:
            raise UserError(f"matcher.min_confidence must be in [0, 1), got {min_confidence}")
        found = open_weights(weights, SHORTENED if "lighterglue_L3" in Path(weights).name else RELEASES)
        state = kornia_names(found.content, found.path)
        sizes = network_sizes(state, found.path)
        # A picture of one pixel has no features, but descriptors of a width.
        width = extractor.features(torch.zeros(3, 1, 1)).descriptors.shape[1]
        if width != sizes["input_dim"]:
            raise UserError(
                f"{found.path}: made for {sizes['input_dim']}-D descriptors, but matcher.extractor gives {width}-D; "
                "give weights that were trained for it"
            )
        self.network = build_network(state, sizes, found.path, min_confidence, device)
        self.name = name
        self._extractor = extractor
        self.settings: dict[str, Any] = {
            "extractor": {"name": extractor.name, **extractor.settings}, "min_confidence": min_confidence,
            **found.settings,
        }  # fmt: skip

    def features(self, image: Tensor) -> Features:
        """The extractor's features of an image (3, H, W) in [0, 1]."""
        return self._extractor.features(image)

    @torch.no_grad()
    def match(self, a: Features, b: Features) -> Matches:
        """The matches that the network is sure enough of, each position counted once."""
        found = self.network({"image0": self._input(a), "image1": self._input(b)})
        indices, confidence = found["matches"][0].cpu(), found["scores"][0].cpu()
        indices, confidence = count_positions_once(a, b, indices, confidence.clamp(0, 1))
        return matches_at(a, b, indices, confidence, self.name, self.settings)

    def _input(self, features: Features) -> dict[str, Tensor]:
        """One image as the network takes it; its sizes are (w, h)."""
        device = device_of(self.network)
        return {
            "keypoints": features.keypoints[None].to(device),
            "descriptors": features.descriptors[None].to(device),
            "image_size": torch.tensor([features.size[::-1]], dtype=torch.float32, device=device),
        }


def build_network(
    state: Mapping[str, Tensor], sizes: Mapping[str, int], path: Path, min_confidence: float, device: str
) -> kornia.feature.LightGlue:
    """kornia's network of these sizes (`network_sizes`), frozen, filled from the file `path`. Raises: UserError."""
    network = kornia.feature.LightGlue(
        None,  # type: ignore[arg-type]  # with a name in its place kornia would download
        **sizes,
        depth_confidence=-1,
        width_confidence=-1,
        filter_threshold=min_confidence,
        flash=False,
    )
    # Only the last layer's assignment runs where no match is decided, and no keypoint dropped, before.
    early = tuple(f"log_assignment.{i}." for i in range(sizes["n_layers"] - 1))
    return freeze(network, state, path, device, may_lack=("confidence_thresholds", "token_confidence.", *early))


def kornia_names(content: Any, path: Path) -> dict[str, Tensor]:
    """A published LightGlue's state dict under the names of kornia's class. Raises: UserError if it is none.

    The authors' files say self_attn.3 for transformers.3.self_attn; LighterGlue's hold "matcher." before each name.
    """
    if not isinstance(content, Mapping):
        raise UserError(f"{path}: not the weights of a LightGlue")
    prefix = "matcher." if any(name.startswith("matcher.") for name in content) else ""
    return {
        re.sub(r"^(self|cross)_attn\.(\d+)\.", r"transformers.\2.\1_attn.", name.removeprefix(prefix)): tensor
        for name, tensor in content.items()
        if name.startswith(prefix)
    }


def network_sizes(state: Mapping[str, Tensor], path: Path) -> dict[str, int]:
    """The sizes of the network that the state dict was made by, as kornia's arguments. Raises: UserError."""
    numbers = [int(name.split(".")[1]) for name in state if name.startswith("transformers.")]
    encoding = state.get("posenc.Wr.weight")
    first = state.get("transformers.0.self_attn.out_proj.weight")
    if not numbers or encoding is None or first is None:
        raise UserError(f"{path}: not the weights of a LightGlue")
    width = len(first)
    # The encoding has one row for each pair of a head's channels; equal widths need no projection.
    return {
        "input_dim": state["input_proj.weight"].shape[1] if "input_proj.weight" in state else width,
        "descriptor_dim": width,
        "num_heads": width // (2 * len(encoding)),
        "n_layers": 1 + max(numbers),
    }
