"""One image with many others: what matching one by one gives, and what a loop of OpenCV's own calls gives."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch
from torch import Tensor

from diffnav.matching.matches import Features, Matches
from diffnav.matching.one_to_many import one_to_many
from diffnav.matching.orb_gms import OrbGms
from diffnav.matching.sift import Sift

SIZE = (96, 160)


@pytest.fixture(scope="module")
def pictures(picture: Tensor) -> list[Tensor]:
    """Neighbouring parts of one picture; one with the same part four times, so that descriptors tie; a flat one."""
    parts = [picture[:, top : top + 96, left : left + 160] for top, left in ((0, 0), (4, 8), (30, 60), (80, 100))]
    tile = picture[:, :96, :40].repeat(1, 1, 4)
    return [*parts, tile, torch.full((3, *SIZE), 0.5), picture[:, 20:, 50:]]


@pytest.fixture(scope="module")
def found(pictures: list[Tensor]) -> list[Features]:
    gms = OrbGms(rotation=False)
    return [gms.features(one) for one in pictures]


def same(a: Matches, b: Matches) -> bool:
    tensors = [(a.points_a, b.points_a), (a.points_b, b.points_b), (a.confidence, b.confidence)]
    return all(torch.equal(x, y) for x, y in tensors) and (a.matcher, a.settings) == (b.matcher, b.settings)


def opencv_points(a: Features, b: Features) -> Iterator[tuple[float, ...]]:
    """x, y in a and in b of each match, by OpenCV's own calls; a pixel counts once, for the nearest descriptors."""
    if len(a) == 0 or len(b) == 0:
        return
    nearest = cv2.BFMatcher(cv2.NORM_HAMMING).match(a.descriptors.numpy(), b.descriptors.numpy())
    points = [[cv2.KeyPoint(float(x), float(y), 1) for x, y in one.keypoints.tolist()] for one in (a, b)]
    sizes = [(one.size[1], one.size[0]) for one in (a, b)]
    kept = cv2.xfeatures2d.matchGMS(*sizes, *points, nearest, False, False, 6.0)
    taken: tuple[set, set] = (set(), set())
    for match in sorted(kept, key=lambda one: one.distance):
        ends = points[0][match.queryIdx].pt, points[1][match.trainIdx].pt
        pixels = [tuple(np.round(end)) for end in ends]
        if not any(pixel in own for pixel, own in zip(pixels, taken, strict=True)):
            for pixel, own in zip(pixels, taken, strict=True):
                own.add(pixel)
            yield *ends[0], *ends[1]


def test_equal_to_matching_pair_by_pair(found: list[Features]) -> None:
    for settings in ({"rotation": False}, {"rotation": True, "threshold_factor": 3.0}):
        gms = OrbGms(**settings)
        others = one_to_many(gms, found)
        for query in found:
            # Asked again and again: the others stay as they were prepared.
            matches = list(others.match_each(query))
            assert len(matches) == len(found)
            assert all(same(own, gms.match(query, other)) for own, other in zip(matches, found, strict=True))


def test_equal_to_a_loop_of_opencvs_calls(found: list[Features]) -> None:
    others = one_to_many(OrbGms(rotation=False), found)
    counts = []
    for query in found:
        for matches, other in zip(others.match_each(query), found, strict=True):
            table = torch.cat([matches.points_a, matches.points_b], 1).tolist()
            expected = list(opencv_points(query, other))
            assert [tuple(row) for row in table] == expected
            counts.append(len(expected))
    # It was worth comparing: some pairs match well, some hardly, those with the flat picture not at all.
    assert sum(count == 0 for count in counts) >= 13
    assert sum(count > 100 for count in counts) > len(found)
    descriptors = [own.descriptors.numpy() for own in (found[0], found[4])]
    two = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(*descriptors, 2)
    assert sum(first.distance == second.distance for first, second in two) > 30


def test_another_matcher_is_asked_pair_by_pair(pictures: list[Tensor]) -> None:
    sift = Sift(features=60)
    found = [sift.features(one) for one in pictures]
    matches = list(one_to_many(sift, found[1:]).match_each(found[0]))
    assert all(same(own, sift.match(found[0], other)) for own, other in zip(matches, found[1:], strict=True))
    counts = [len(own) for own in matches]
    assert counts[0] == max(counts) > 10
    assert counts[4] == 0


def test_images_without_features(found: list[Features]) -> None:
    nothing, gms = found[5], OrbGms(rotation=False)
    assert len(nothing) == 0
    for query, others in ((nothing, found), (found[0], [nothing, nothing]), (found[0], [])):
        matches = list(one_to_many(gms, others).match_each(query))
        assert [len(own) for own in matches] == [0] * len(others)
        assert all(own.points_a.shape == (0, 2) for own in matches)


def test_keypoints_outside_of_their_image_are_refused(found: list[Features]) -> None:
    swapped = replace(found[0], size=(160, 96))
    with pytest.raises(ValueError, match="outside of its image, 96 wide and 160 high"):
        one_to_many(OrbGms(), [found[1], swapped])
    with pytest.raises(ValueError, match="outside of its image"):
        list(one_to_many(OrbGms(), found).match_each(swapped))
