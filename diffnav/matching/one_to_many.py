"""One image's features matched with those of many others, which are prepared once for many queries."""

from collections.abc import Iterator, Sequence
from typing import Protocol

from diffnav.matching.hamming_block import HammingBlock
from diffnav.matching.matches import Features, Matcher, Matches
from diffnav.matching.orb_gms import GmsImage, OrbGms


class OneToMany(Protocol):
    """Other images, ready to be matched."""

    def match_each(self, query: Features) -> Iterator[Matches]:
        """The matches between the query and each of the images, in their order."""
        ...


def one_to_many(matcher: Matcher, others: Sequence[Features]) -> OneToMany:
    """What matches a query with each of `others`: exactly as the matcher does one by one, as fast as it can be.

    Raises: ValueError if the matcher refuses features.
    """
    return GmsOneToMany(matcher, others) if isinstance(matcher, OrbGms) else OneByOne(matcher, others)


class OneByOne:
    """Any matcher, asked for one image after the other."""

    def __init__(self, matcher: Matcher, others: Sequence[Features]) -> None:
        self._matcher, self._others = matcher, others

    def match_each(self, query: Features) -> Iterator[Matches]:
        """See `OneToMany`."""
        return (self._matcher.match(query, other) for other in self._others)


class GmsOneToMany:
    """ORB with GMS: the nearest descriptors are found in all images at once."""

    def __init__(self, matcher: OrbGms, others: Sequence[Features]) -> None:
        self._matcher = matcher
        self._images = [GmsImage.of(features) for features in others]
        self._block = HammingBlock([features.descriptors for features in others])

    def match_each(self, query: Features) -> Iterator[Matches]:
        """See `OneToMany`. Raises: ValueError if a keypoint of the query lies outside of its image."""
        image = GmsImage.of(query)
        for other, nearest, bits in zip(self._images, *self._block.nearest(query.descriptors), strict=True):
            yield self._matcher.supported(image, other, nearest, bits)
