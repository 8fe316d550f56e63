"""The matching experiment with a matcher whose matches are known: figures, order, failures, workers."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from matching_stubs import SIZE, Brighten, KnownMatcher, contest, photos, picture, turned

from diffnav.darkness import DarknessModel
from diffnav.data.match_pairs.lol import LolPairs
from diffnav.data.match_pairs.match_pair import MatchPair
from diffnav.data.pair_source import PairSource
from diffnav.enhancers.gamma_blind import GammaBlind
from diffnav.enhancers.gamma_oracle import GammaOracle
from diffnav.enhancers.input import Input
from diffnav.errors import UserError
from diffnav.evaluation.match_records import MatchRecord, find_matches
from diffnav.evaluation.matching import measure_matches
from diffnav.evaluation.records import RecordLog
from diffnav.images import write_image
from diffnav.matching.sift import Sift


def log_in(path: Path | None = None) -> RecordLog[MatchRecord]:
    return RecordLog(path, MatchRecord)


def untimed(records):
    return [
        replace(r, seconds_enhance=None, seconds_detect=None, seconds_match=None, seconds_verify=None) for r in records
    ]


def test_a_record_holds_what_is_known_of_the_matches():
    """Eight of ten matches are right, two are 5 px off; the keypoints are those of both pictures."""
    (record,) = measure_matches(turned(1), contest({"input": Input()}, {"m": KnownMatcher()}), log_in()).flat
    assert (record.method, record.matcher, record.pairs, record.name, record.site) == (
        "input", "m", "rot180", "p0", "site_0",
    )  # fmt: skip
    assert (record.height, record.width, record.keypoints) == (*SIZE, 10)
    assert (record.mp, record.correct, record.precision) == (10, 8, 0.8)
    assert (record.inliers, record.inlier_ratio) == (8, 0.8)
    assert record.corner_error_px == pytest.approx(0, abs=1e-3)
    # Turned, (10, 8) comes to lie at (69, 55), 3 px from (66, 55), and the other way round; no other two meet.
    assert record.repeatability == 4 / 20
    drawn = turned(1)[0][0].read(photos(1)[0]).pair["record"]
    assert record.gamma == drawn.gamma
    assert all(getattr(record, f"seconds_{step}") >= 0 for step in ("enhance", "detect", "match", "verify"))
    assert record.failure is None


def test_too_few_matches_are_no_homography():
    (record,) = measure_matches(turned(1), contest({"input": Input()}, {"m": KnownMatcher(count=3)}), log_in()).flat
    assert (record.correct, record.inliers, record.corner_error_px) == (3, 0, None)


def test_matches_where_the_query_shows_nothing_do_not_count():
    pairs, photo = turned(1)[0]
    pair = pairs.read(photo)
    visible = torch.ones(SIZE, dtype=torch.bool)
    visible[:15] = False
    matcher = KnownMatcher()
    found = find_matches(MatchPair(**{**pair.__dict__, "visible": visible}), pair.reference, matcher, None)
    assert found.matches.points_a.tolist() == [p for p in matcher.features(picture(0)).keypoints.tolist() if p[1] >= 15]
    assert len(found.matches.confidence) == len(found.matches.points_b) == 7


def test_the_enhanced_picture_is_turned_and_the_reference_found_once():
    matcher = KnownMatcher()
    jobs = turned(2)
    measure_matches(jobs, contest({"a": Brighten(0.5), "b": Brighten(0.3)}, {"m": matcher}), log_in())
    pairs = [source.read(photo) for source, photo in jobs]
    seen = [
        mean
        for pair in pairs
        for mean in (pair.reference.mean(), *((pair.pair["low"] ** power).mean() for power in (0.5, 0.3)))
    ]
    # The order within a photo: reference and query of the first method, query of the second.
    assert matcher.detected == pytest.approx([value.item() for value in seen], abs=2e-3)
    assert matcher.matched == 4 + 1, "the first reference is matched once more, for the warm-up"


def test_records_come_photo_by_photo_method_by_method():
    fight = contest({"a": Input(), "b": Brighten()}, {"m": KnownMatcher(), "n": KnownMatcher(right=5)})
    result = measure_matches(turned(2), fight, log_in())
    assert [(r.name, r.method, r.matcher) for r in result.flat] == [
        (name, method, matcher) for name in ("p0", "p1") for method in "ab" for matcher in "mn"
    ]
    assert [r.correct for r in result.flat] == [8, 5] * 4


def test_a_method_that_fails_is_matched_in_the_dark(tmp_path):
    fight = contest({"input": Input(), "a": Brighten(fails=True)}, {"m": Sift()})
    dark, failed = measure_matches(turned(1), fight, log_in(tmp_path / "r.jsonl")).flat
    assert (failed.failure, failed.seconds_enhance, failed.mp) == ("out of memory", None, dark.mp)
    log = log_in(tmp_path / "r.jsonl")
    mended = measure_matches(turned(1), contest({"a": Brighten()}, {"m": Sift()}), log).flat
    assert (mended[0].failure, log.reused) == (None, 0)


def test_a_matcher_that_fails_found_nothing():
    fight = contest({"input": Input()}, {"bad": KnownMatcher(fails=True), "m": KnownMatcher()})
    failed, fine = measure_matches(turned(1), fight, log_in()).flat
    assert (failed.failure, failed.mp, failed.corner_error_px) == ("bad: no memory left", 0, None)
    assert (fine.failure, fine.mp) == (None, 10)


def test_who_needs_the_darkening_is_left_out_of_real_darkness(tmp_path):
    write_image(tmp_path / "low.png", picture(0) * 0.2)
    real = [replace(photos(1)[0], low=tmp_path / "low.png")]
    pairs = LolPairs(PairSource(real, DarknessModel()))
    fight = contest({"input": Input(), "gamma_oracle": GammaOracle(), "b": GammaBlind()}, {"m": KnownMatcher()})
    result = measure_matches([(pairs, real[0])], fight, log_in())
    assert [r.method for r in result.flat] == ["input", "b"]
    (sentence,) = result.left_out
    assert sentence.startswith("gamma_oracle: it needs to know how a picture was darkened")


def test_unusable_photos_are_named(tmp_path):
    (tmp_path / "broken.png").write_bytes(b"\x89PNG broken")
    jobs = turned(1)
    jobs.insert(0, (jobs[0][0], replace(photos(1)[0], name="broken", normal=tmp_path / "broken.png")))
    result = measure_matches(jobs, contest({"input": Input()}, {"m": KnownMatcher()}), log_in())
    assert [len(own) for own in result.records] == [0, 1]
    assert "broken.png" in result.problems[0]
    with pytest.raises(UserError, match=r"none of 1 photos can be used: .*broken\.png"):
        measure_matches(jobs[:1], contest({"input": Input()}, {"m": KnownMatcher()}), log_in())


def test_a_wrong_verification_is_refused_before_anything_runs():
    with pytest.raises(UserError, match=r"verification\.threshold_px"):
        contest({"input": Input()}, {"m": KnownMatcher()}, threshold_px=-1.0)


def test_results_do_not_depend_on_the_workers():
    fight = contest({"input": Input(), "gamma_blind": GammaBlind()}, {"sift": Sift()})
    alone, together = (measure_matches(turned(3), fight, log_in(), workers) for workers in (1, 2))
    assert untimed(alone.flat) == untimed(together.flat)
    assert len(alone.flat) == 6
