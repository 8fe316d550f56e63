"""What every matcher with keypoints must do, checked in each one's test."""

import inspect

import torch
from hydra.utils import instantiate

from conf.command import choice
from diffnav.geometry.homography import rotate_180, rotation_180
from diffnav.matching.ground_truth import correct_matches, match_errors_px


def check_configuration(name, matcher_class, **differs):
    """conf/matcher/NAME.yaml holds every argument, with the default unless `differs` says otherwise."""
    cfg = choice("matcher", name)
    defaults = {key: p.default for key, p in inspect.signature(matcher_class).parameters.items()} | differs
    assert {key: value for key, value in cfg.items() if key != "_target_"} == defaults
    matcher = instantiate(cfg)
    assert type(matcher) is matcher_class
    assert matcher.settings == defaults


def check_features(many, few, size, width, dtype):
    """Features of a picture of `size` (h, w), and 40 at most of the same."""
    height, wide = size
    assert 200 < len(many) <= 500
    assert 30 < len(few) <= 40
    assert many.size == size
    assert many.keypoints.shape == (len(many), 2)
    assert many.descriptors.shape == (len(many), width)
    assert many.descriptors.dtype == dtype
    for found in (many, few):
        assert (found.scores.diff() <= 0).all()
        assert (found.keypoints >= 0).all()
        assert (found.keypoints < torch.tensor([wide, height])).all()


def check_half_a_turn(matcher, picture, least, within_px):
    """A picture matches itself turned: `least` matches, nearly all right, half of them within `within_px`."""
    matches = matcher.match(matcher.features(rotate_180(picture)), matcher.features(picture))
    turn = rotation_180((picture.shape[1], picture.shape[2]))
    assert len(matches) > least
    assert correct_matches(matches, turn).float().mean() > 0.97
    assert match_errors_px(matches, turn).median() < within_px
    assert matches.matcher == matcher.name
    assert matches.settings == matcher.settings
    assert ((matches.confidence >= 0) & (matches.confidence <= 1)).all()
    for points in (matches.points_a, matches.points_b):
        assert len({tuple(p) for p in points.round().tolist()}) == len(points)


def check_nothing(matcher, picture, width, dtype):
    """Pictures without structure, and too small ones, have no features and no matches."""
    something = matcher.features(picture)
    for size in ((1, 1), (2, 7), (16, 16), (20, 300), (120, 90)):
        nothing = matcher.features(torch.full((3, *size), 0.25))
        assert len(nothing) == 0
        assert nothing.keypoints.shape == (0, 2)
        assert nothing.descriptors.shape == (0, width)
        assert nothing.descriptors.dtype == dtype
        assert nothing.size == size
        for a, b in ((nothing, nothing), (nothing, something), (something, nothing)):
            matches = matcher.match(a, b)
            assert matches.points_a.shape == matches.points_b.shape == (0, 2)
            assert matches.confidence.shape == (0,)
            assert matches.confidence.dtype == torch.float32
