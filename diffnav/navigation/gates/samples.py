"""What gates are fitted on: photos taken by day, each under some light, matched as it is and enhanced."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from tqdm import tqdm

from diffnav.darkness import DarknessModel, darken
from diffnav.data.pairs import photo_seed
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.geometry.homography import rotate_180, rotation_180
from diffnav.images import ImageError
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.matches import Matcher
from diffnav.navigation.gates.benefit import log_average_level
from diffnav.navigation.gates.definition import definition

# Daylight, then any darkness from none at all to the paper's, without noise and with that of a sensor at night.
LIGHTS = (
    None,
    DarknessModel(gamma=(1.0, 5.0), quality=(80, 98)),
    DarknessModel(gamma=(1.0, 5.0), quality=(80, 98), shot=(0.0, 0.03), read=(0.0, 0.015)),
)
# Where a match counts as correct.
_CORRECT_PX = 3.0


@dataclass(frozen=True)
class GateSample:
    """One photo: definition by day and darkened as in the paper; and, under a light drawn for it, what both gates see
    and the correct matches of all matchers together, as taken and enhanced.

    gamma: of that light, 1 by day. definition, log_average_level: of the picture under it.
    """

    name: str
    definition_normal: float
    definition_dark: float
    gamma: float
    definition: float
    log_average_level: float
    matches_as_taken: int
    matches_enhanced: int


def gate_samples(
    photos: Sequence[Photo],
    enhancer: nn.Module,
    matchers: Sequence[Matcher],
    seed: int = 0,
    darkness: DarknessModel | None = None,
    lights: Sequence[DarknessModel | None] = LIGHTS,
    device: str | torch.device = "cpu",
) -> tuple[list[GateSample], list[str]]:
    """One sample of each photo, and a sentence on each that cannot be read.

    A picture is matched with its daylight one turned by 180 degrees. All draws follow from `seed` and the photo's name.
    darkness: what the definition gate shall find, by default the paper's. lights: one of them is drawn for a photo,
    None is daylight. Raises: UserError if no photo can be read.
    """
    samples, problems = [], []

    @torch.no_grad()
    def enhance(image: Tensor) -> Tensor:
        return enhancer(image[None].to(device))[0].cpu()

    for photo in tqdm(photos, desc="fitting the gates", unit="photo"):
        try:
            normal = photo.read_normal()
        except ImageError as error:
            problems.append(str(error))
            continue
        drawn = photo_seed(seed, photo.name)
        light = lights[drawn % len(lights)]
        samples.append(_sample(photo.name, normal, enhance, matchers, darkness or DarknessModel(), light, drawn))
    if not samples:
        raise UserError(f"none of {len(photos)} photos can be read to fit the gates on; {'; '.join(problems[:3])}")
    return samples, problems


def _sample(
    name: str,
    normal: Tensor,
    enhance: Callable[[Tensor], Tensor],
    matchers: Sequence[Matcher],
    darkness: DarknessModel,
    light: DarknessModel | None,
    seed: int,
) -> GateSample:
    maximum = normal.max().item()
    record = light.draw(maximum, seed + 1) if light else None
    taken = darken(normal, record) if record else normal
    as_taken, enhanced = _correct([taken, enhance(taken)], normal, matchers)
    return GateSample(
        name=name,
        definition_normal=definition(normal).item(),
        definition_dark=definition(darken(normal, darkness.draw(maximum, seed))).item(),
        gamma=record.gamma if record else 1.0,
        definition=definition(taken).item(),
        log_average_level=log_average_level(taken),
        matches_as_taken=as_taken,
        matches_enhanced=enhanced,
    )


def _correct(pictures: Sequence[Tensor], normal: Tensor, matchers: Sequence[Matcher]) -> list[int]:
    """Correct matches of each picture, turned, with the daylight one; of all matchers together."""
    H = rotation_180((normal.shape[1], normal.shape[2]))
    counts = [0] * len(pictures)
    for matcher in matchers:
        reference = matcher.features(normal)
        for k, picture in enumerate(pictures):
            matches = matcher.match(matcher.features(rotate_180(picture)), reference)
            counts[k] += int(correct_matches(matches, H, _CORRECT_PX).sum())
    return counts
