"""Deterministic splits into training and validation photos: by named sources, by site, or by image."""

import hashlib
from collections.abc import Sequence

from diffnav.data.photos import Photo
from diffnav.errors import UserError


def split_photos(
    photos: Sequence[Photo],
    by: str = "site",
    sources: str | Sequence[str] = (),
    fraction: float = 0.1,
    seed: int = 0,
) -> tuple[list[Photo], list[Photo]]:
    """(training, validation), in the given order; the same call always gives the same split.

    by="sources": validation is every photo whose site is one of `sources` or starts with it and an underscore.
    by="site": whole sites, at least one and about `fraction` of all photos; by="image": single photos.

    Raises: UserError if a source has no photo or a side would be empty.
    """
    if by == "sources":
        held_out = _named(photos, sources)
    elif by in ("site", "image"):
        held_out = _drawn(photos, by, fraction, seed)
    else:
        raise UserError(f"split.by must be sources, site or image, got {by!r}")
    training = [photo for photo in photos if photo.name not in held_out]
    validation = [photo for photo in photos if photo.name in held_out]
    if not training or not validation:
        side = "training" if not training else "validation"
        raise UserError(f"the split by {by} leaves no {side} photo of {len(photos)}; change split.by or split.fraction")
    return training, validation


def thin_photos(photos: Sequence[Photo], most: int) -> list[Photo]:
    """At most `most` (1 or more) of the photos, every n-th, so that few still come from all places."""
    return list(photos[:: max(1, -(-len(photos) // most))])


def _named(photos: Sequence[Photo], sources: str | Sequence[str]) -> set[str]:
    held_out: set[str] = set()
    for source in [sources] if isinstance(sources, str) else sources:
        names = {p.name for p in photos if p.site == source or p.site.startswith((f"{source}_", f"{source}/"))}
        if not names:
            sites = ", ".join(sorted({photo.site for photo in photos})[:20])
            raise UserError(f"split.sources names {source}, of which there is no photo; the sites are {sites}")
        held_out |= names
    return held_out


def _drawn(photos: Sequence[Photo], by: str, fraction: float, seed: int) -> set[str]:
    if not 0 < fraction < 1:
        raise UserError(f"split.fraction must lie between 0 and 1, got {fraction}")
    groups: dict[str, list[str]] = {}
    for photo in photos:
        groups.setdefault(photo.site if by == "site" else photo.name, []).append(photo.name)
    # A hash decides, not a shuffle: adding photos moves few of the others.
    order = sorted(groups, key=lambda key: hashlib.sha256(f"{seed}/{key}".encode()).digest())
    held_out: set[str] = set()
    for key in order[:-1]:
        if held_out and len(held_out) + len(groups[key]) / 2 > fraction * len(photos):
            break
        held_out |= set(groups[key])
    return held_out
