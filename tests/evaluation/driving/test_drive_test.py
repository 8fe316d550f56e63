"""What one query leaves on record, against loops over pairs of pictures that are written here."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import torch
from driving_stubs import Brighten, answers, drive_test, gms, methods, noise_drive, told, view
from torch import Tensor

from diffnav.darkness import DarknessModel, darken
from diffnav.data.driving.driving_set import DrivingSet
from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import photo_seed
from diffnav.driving.shortlist import picture_descriptor
from diffnav.enhancers.input import Input
from diffnav.enhancers.normal import Normal
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.images import resize, write_image
from diffnav.matching.matches import Features, Matches
from diffnav.matching.sift import Sift
from diffnav.matching.verification import verify


def dark(task: DriveTest, number: int) -> tuple[Tensor, float]:
    """A query as Eq. 9 leaves it at night, and the gamma: drawn by its name, stored in 8 bit."""
    frame, model = task.drive.queries[number], DarknessModel(gamma=(3, 4))
    daylight = frame.read()
    record = model.draw(daylight.max().item(), photo_seed(7, frame.name))
    return darken(daylight, record), record.gamma


def naive_matches(picture: Tensor, drive: DrivingSet, named: NamedMatcher) -> list[Matches]:
    """With each reference, one after the other, every one of them read and searched for features here."""
    matcher = named.matcher
    features = matcher.features(picture)
    return [matcher.match(features, matcher.features(one.read())) for one in drive.references]


def levels(image: Tensor) -> Tensor:
    return (image * 255).round() / 255


def test_records_are_those_of_a_naive_loop_over_pairs(task: DriveTest) -> None:
    right = {}
    for number, query in enumerate(task.drive.queries):
        low, gamma = dark(task, number)
        pictures = {"input": low, "gamma_blind": levels(low**0.25), "normal": query.read()}
        records = answers(task, number)
        assert [(one.method, one.matcher) for one in records] == [
            (method, matcher) for method in pictures for matcher in ("orb_gms", "sift")
        ]
        for record, named in zip(records, list(task.matchers) * 3, strict=True):
            matches = naive_matches(pictures[record.method], task.drive, named)
            assert record.counts == [len(own) for own in matches]
            ranked = sorted(range(4), key=lambda k: (-record.counts[k], k))[:2]
            verified = partial(verify, model="fundamental")
            assert record.inliers == [
                [k, int(verified(matches[k]).inliers.sum())] for k in ranked if record.counts[k] > 0
            ]
            assert record.rows == []
            assert (record.name, record.record, record.truth) == (query.name, "road", number)
            assert (record.gamma, record.failure) == (gamma, None)
            assert min(record.seconds_enhance, record.seconds_features, record.seconds_match) >= 0
            right.setdefault((record.method, record.matcher), []).append(record.answer("matches") == number)
    # It was worth comparing.
    assert all(right["normal", "orb_gms"] + right["normal", "sift"])


def test_the_darkness_is_the_queries_own(task: DriveTest, drive: DrivingSet) -> None:
    """Drawn by name: that of one query does not depend on which others there are."""
    task = replace(task, methods=task.methods[:1], matchers=task.matchers[1:], verified=0)
    gammas = [answers(task, k)[0].gamma for k in range(4)]
    assert len(set(gammas)) == 4
    part = drive_test(drive.without({0: "gone"}), task.methods, task.matchers)
    assert [answers(part, k)[0].gamma for k in range(3)] == gammas[1:]
    other = replace(task, pairs=PairSource([], DarknessModel(gamma=(3, 4)), 8))
    assert answers(other, 0)[0].gamma != gammas[0]


def test_a_shortlist_matches_the_most_alike_and_marks_the_others(task: DriveTest) -> None:
    task = replace(task, methods=task.methods[:1])
    short = replace(task, shortlist=2)
    descriptors = [picture_descriptor(one.read()) for one in task.drive.references]
    for number in range(4):
        query = dark(task, number)[0]
        likeness = [float(picture_descriptor(query) @ one) for one in descriptors]
        asked = sorted(range(4), key=lambda k: -likeness[k])[:2]
        for full, record in zip(answers(task, number), answers(short, number), strict=True):
            assert record.counts == [full.counts[k] if k in asked else -1 for k in range(4)]
            assert {k for k, _ in record.inliers} == {k for k in asked if full.counts[k] > 0}
            assert all(dict(full.inliers).get(k, count) == count for k, count in record.inliers)
    # One longer than the drive is none at all.
    assert [told(one) for one in answers(replace(task, shortlist=9), 1)] == [told(one) for one in answers(task, 1)]


def test_rectified_cameras_count_the_matches_that_keep_their_row(task: DriveTest) -> None:
    rectified = replace(task, drive=replace(task.drive, rectified=True))
    query = rectified.drive.queries[1]
    for record, named in zip(answers(rectified, 1)[4:], task.matchers, strict=True):
        matches = naive_matches(query.read(), task.drive, named)
        kept = [
            sum(abs(a - b) <= 1.5 for a, b in zip(m.points_a[:, 1], m.points_b[:, 1], strict=True)) for m in matches
        ]
        assert record.method == "normal"
        assert record.rows == [[k, kept[k]] for k, _ in record.inliers]
        assert record.answer("rows") == 1


def test_verification_is_left_out_where_it_is_not_asked_for(task: DriveTest) -> None:
    assert all(record.inliers == [] for record in answers(replace(task, verified=0), 0))
    # More than there are: all that matched.
    for record in answers(replace(task, verified=99), 0):
        assert {k for k, _ in record.inliers} == {k for k, count in enumerate(record.counts) if count > 0}


def test_larger_pictures_are_shrunk(drive: DrivingSet) -> None:
    rows = methods(normal=Normal())
    (record,) = answers(drive_test(drive, rows, longest_side=120), 2)
    matcher = gms(threshold_factor=2.0).matcher
    small = [resize(one.read(), (72, 120)) for one in (drive.queries[2], *drive.references)]
    # The query is daylight as it was stored before it was darkened, in 8 bit.
    query, *references = [matcher.features(levels(small[0])), *map(matcher.features, small[1:])]
    assert record.counts == [len(matcher.match(query, other)) for other in references]


def test_an_unreadable_query_is_a_failure_and_the_others_go_on(tmp_path: Path) -> None:
    drive = noise_drive(3, tmp_path)
    broken = tmp_path / "left" / "1.png"
    broken.write_bytes(broken.read_bytes()[:3000])
    task = drive_test(drive, methods(input=Input(), normal=Normal()))
    for record in answers(task, 1):
        assert (record.counts, record.inliers, record.gamma, record.seconds) == ([], [], None, None)
        assert record.failure.startswith(f"{broken}: damaged image")
        assert record.answer("matches") is None
    whole = drive_test(noise_drive(3), methods(input=Input(), normal=Normal()))
    for number in (0, 2):
        assert [told(one) for one in answers(task, number)] == [told(one) for one in answers(whole, number)]


class Fails(Sift):
    """Fails on one picture, in finding or in matching its features."""

    def __init__(self, at: str) -> None:
        super().__init__(features=50)
        self.at = at

    def features(self, image: Tensor) -> Features:
        if self.at == "features" and torch.equal(image, view(24)):
            raise MemoryError
        return super().features(image)

    def match(self, a: Features, b: Features) -> Matches:
        if self.at == "match" and torch.equal(a.keypoints, super().features(view(24)).keypoints):
            raise ValueError("too  many\nkeypoints")
        return super().match(a, b)


@pytest.mark.parametrize(("at", "why"), [("features", "MemoryError"), ("match", "too many keypoints")])
def test_a_method_or_matcher_that_fails_is_named(at: str, why: str, drive: DrivingSet) -> None:
    rows = methods(normal=Normal(), weak=Brighten(fails=True))
    task = drive_test(drive, rows, [NamedMatcher("sift", Fails(at)), gms()])
    fine, failed = answers(task, 0), answers(task, 1)
    assert [one.failure for one in fine] == [None, None, *["weak: out of memory"] * 2]
    assert [one.failure for one in failed] == [f"sift: {why}", None, *["weak: out of memory"] * 2]
    assert (failed[0].counts, failed[0].seconds_features, failed[1].truth) == ([], None, 1)
    # The method's picture was made all the same.
    assert failed[0].seconds_enhance is not None
    assert failed[0].gamma == failed[2].gamma


def test_matches_for_a_figure_are_those_of_the_record(task: DriveTest) -> None:
    record = answers(task, 1)[2]
    for reference in range(4):
        pair, image, matches = task.matches(1, "gamma_blind", "orb_gms", reference)
        assert len(matches) == record.counts[reference]
    low, gamma = dark(task, 1)
    assert torch.equal(pair["low"], low)
    assert torch.equal(image, levels(low**0.25))
    assert pair["record"].gamma == gamma
    weak = replace(task, methods=methods(weak=Brighten(fails=True)))
    with pytest.raises(UserError, match="weak: out of memory"):
        weak.matches(0, "weak", "sift", 0)


def test_pictures_of_different_sizes(tmp_path: Path) -> None:
    drive = noise_drive(2, tmp_path)
    write_image(tmp_path / "right" / "1.png", view(20)[:, :80, :150])
    (record,) = answers(drive_test(drive, methods(normal=Normal())), 1)
    matches = naive_matches(drive.queries[1].read(), drive, gms(threshold_factor=2.0))
    assert record.counts == [len(own) for own in matches]
    assert record.answer("matches") == 1
