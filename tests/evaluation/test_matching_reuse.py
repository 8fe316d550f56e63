"""What the matching experiment keeps: nothing is computed twice, nothing stale is served, a killed run goes on."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from matching_stubs import Brighten, KnownMatcher, contest, photos, picture, turned

from diffnav.darkness import DarknessModel
from diffnav.data.pair_source import PairSource
from diffnav.enhancers.input import Input
from diffnav.evaluation import contest as contest_module
from diffnav.evaluation.match_records import MatchRecord
from diffnav.evaluation.matching import measure_matches
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.records import RecordLog
from diffnav.images import write_image
from diffnav.matching.sift import Sift


def log_in(path: Path | None = None) -> RecordLog[MatchRecord]:
    return RecordLog(path, MatchRecord)


def test_a_second_run_computes_nothing(tmp_path):
    first = measure_matches(turned(), contest({"a": Brighten()}, {"m": KnownMatcher()}), log_in(tmp_path / "r.jsonl"))
    enhancer, matcher, log = Brighten(), KnownMatcher(), log_in(tmp_path / "r.jsonl")
    second = measure_matches(turned(), contest({"b": enhancer}, {"renamed": matcher}), log)
    assert (enhancer.calls, matcher.detected, matcher.matched, log.reused) == (0, [], 0, 3)
    assert [replace(r, method="a", matcher="m") for r in second.flat] == first.flat


@pytest.mark.parametrize(
    "changed",
    [
        lambda: (turned(), contest({"a": Brighten(0.50001)}, {"m": KnownMatcher()})),
        lambda: (turned(), contest({"a": Brighten()}, {"m": KnownMatcher(error_px=5.1)})),
        lambda: (turned(seed=1), contest({"a": Brighten()}, {"m": KnownMatcher()})),
        lambda: (turned(), contest({"a": Brighten()}, {"m": KnownMatcher()}, threshold_px=2.0)),
        lambda: (turned(), contest({"a": Brighten()}, {"m": Sift()})),
    ],
    ids=["weight", "matcher", "pixels", "verification", "code"],
)
def test_no_stale_record_is_served(changed, tmp_path):
    measure_matches(turned(), contest({"a": Brighten()}, {"m": KnownMatcher()}), log_in(tmp_path / "r.jsonl"))
    jobs, fight = changed()
    log = log_in(tmp_path / "r.jsonl")
    measure_matches(jobs, fight, log)
    assert log.reused == 0


def test_one_changed_pixel_is_computed_anew(tmp_path):
    root = tmp_path / "photos"
    for k in range(2):
        write_image(root / f"p{k}.png", picture(k))
    every = [replace(photo, normal=root / f"{photo.name}.png") for photo in photos(2)]
    jobs = [(replace(turned()[0][0], source=PairSource(every, DarknessModel())), photo) for photo in every]
    measure_matches(jobs, contest({"a": Input()}, {"m": KnownMatcher()}), log_in(tmp_path / "r.jsonl"))
    touched = picture(1)
    touched[0, 3, 3] = 1 - touched[0, 3, 3]
    write_image(root / "p1.png", touched)
    log = log_in(tmp_path / "r.jsonl")
    measure_matches(jobs, contest({"a": Input()}, {"m": KnownMatcher()}), log)
    assert log.reused == 1


def test_another_matcher_needs_no_new_enhancement(tmp_path):
    cache = PredictionCache(tmp_path / "cache")
    measure_matches(turned(), contest({"a": Brighten()}, {"m": KnownMatcher()}, cache), log_in(tmp_path / "r.jsonl"))
    again = Brighten()
    result = measure_matches(turned(), contest({"a": again}, {"m": KnownMatcher(right=2)}, cache), log_in())
    assert again.calls == 0
    assert [r.correct for r in result.flat] == [2] * 3


def test_a_killed_run_goes_on(tmp_path, monkeypatch):
    """What was finished is on disk, one line each; a half-written line is made again."""
    path, made = tmp_path / "r.jsonl", contest_module.match_figures

    def stop_at_the_fourth(*arguments):
        if len(path.read_text().splitlines() if path.exists() else []) == 3:
            raise KeyboardInterrupt
        return made(*arguments)

    monkeypatch.setattr(contest_module, "match_figures", stop_at_the_fourth)
    with pytest.raises(KeyboardInterrupt):
        measure_matches(turned(5), contest({"a": Brighten()}, {"m": KnownMatcher()}), log_in(path))
    monkeypatch.undo()
    assert len([json.loads(line) for line in path.read_text().splitlines()]) == 3
    path.write_text(path.read_text()[:-30])
    log = log_in(path)
    assert len(measure_matches(turned(5), contest({"a": Brighten()}, {"m": KnownMatcher()}), log).flat) == 5
    assert log.reused == 2
