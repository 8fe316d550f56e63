"""What every learned matcher must do, checked in each one's test; weights that are not here are skipped."""

import hashlib
import inspect

import pytest
import torch

from conf.command import choice
from diffnav.errors import UserError
from diffnav.matching.ground_truth import correct_matches
from diffnav.pretrained import pretrained_path


def need(*files):
    """Skip the test unless these published weights are found."""
    for file in files:
        try:
            pretrained_path(file, "its authors")
        except UserError as error:
            pytest.skip(str(error))


def save(content, path):
    """The path, as text, of a weights file with this content."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torch.save(content, path)
    return str(path)


def check_arguments(name, matcher_class, **differs):
    """conf/matcher/NAME.yaml holds every argument, with the default unless `differs` says otherwise."""
    cfg = choice("matcher", name)
    defaults = {key: p.default for key, p in inspect.signature(matcher_class).parameters.items()} | differs
    assert {key: value for key, value in cfg.items() if key != "_target_"} == defaults
    assert cfg["_target_"] == f"{matcher_class.__module__}.{matcher_class.__name__}"


def check_missing(build, folder, monkeypatch, file, *words):
    """Without its weights the matcher is one sentence: which file, where it goes, where it comes from."""
    monkeypatch.setenv("DIFFNAV_WEIGHTS", str(folder))
    with pytest.raises(UserError) as caught:
        build()
    said = str(caught.value)
    assert "\n" not in said
    for part in (str(folder / file), "kornia", *words):
        assert part in said


def check_identity(settings, path):
    """The settings name the weights' file and its content, not the folder it lies in."""
    assert settings["weights"] == path.name
    assert settings["weights_sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert str(path.parent) not in str(settings)


def check_features(matcher, picture, width, least):
    """More than `least` features of a picture, plain ones, and the same each time; returns them."""
    found, again = matcher.features(picture), matcher.features(picture)
    check_plain_features(found, matcher.settings["features"], tuple(picture.shape[1:]), width)
    assert len(found) > least
    assert torch.equal(found.keypoints, again.keypoints)
    assert torch.equal(found.descriptors, again.descriptors)
    return found


def check_plain_features(found, most, size, width):
    """Features as everywhere: sorted, inside, of length 1, free of autograd's and inference mode's traces."""
    height, wide = size
    assert 0 < len(found) <= most
    assert found.size == size
    assert (found.scores.diff() <= 0).all()
    assert (found.keypoints >= 0).all()
    assert (found.keypoints <= torch.tensor([wide - 1, height - 1])).all()
    torch.testing.assert_close(found.descriptors.norm(dim=1), torch.ones(len(found)))
    for part, shape in ((found.keypoints, 2), (found.descriptors, width), (found.scores, None)):
        assert part.shape == ((len(found), shape) if shape else (len(found),))
        assert part.dtype == torch.float32
        assert not part.requires_grad
        assert not part.is_inference()


def check_any_size(matcher, width, dark=(0.0, 1.0)):
    """Odd, tiny, black and white pictures: finite features inside the picture, perhaps none, and matches of them."""
    dice = torch.Generator().manual_seed(1)
    for size in ((1, 1), (2, 7), (5, 40), (16, 16), (16, 90), (31, 64), (65, 101)):
        pictures = [torch.full((3, *size), value) for value in dark] + [torch.rand(3, *size, generator=dice)]
        for picture in pictures:
            found = matcher.features(picture)
            assert found.size == size
            assert found.descriptors.shape == (len(found), width)
            assert found.descriptors.isfinite().all()
            assert found.scores.isfinite().all()
            assert (found.keypoints >= 0).all()
            assert (found.keypoints <= torch.tensor(size[::-1]) - 1).all()
            matches = matcher.match(found, found)
            assert len(matches) <= len(found)
            assert matches.points_a.shape == matches.points_b.shape == (len(matches), 2)


def check_moved(matcher, picture, offset, least, within_px=0.1, precision=0.9):
    """A part of a picture is found where it was cut: `least` right matches, which lie on average `within_px` off."""
    x, y = offset
    H_part_whole = torch.tensor([[1.0, 0, x], [0, 1, y], [0, 0, 1]], dtype=torch.float64)
    matches = matcher.match(matcher.features(picture[:, y:, x:]), matcher.features(picture))
    right = correct_matches(matches, H_part_whole)
    assert right.sum() >= least
    assert right.float().mean() > precision
    off = (matches.points_b - matches.points_a - torch.tensor(offset))[right].mean(0)
    assert off.abs().max() < within_px
    check_matches(matches, matcher)


def check_matches(matches, matcher):
    """Matches as everywhere: named, most confident first, no pixel twice."""
    assert (matches.matcher, matches.settings) == (matcher.name, matcher.settings)
    assert ((matches.confidence >= 0) & (matches.confidence <= 1)).all()
    assert (matches.confidence.diff() <= 0).all()
    for points in (matches.points_a, matches.points_b):
        assert points.dtype == torch.float32
        assert len({tuple(p) for p in points.round().tolist()}) == len(points)
