"""Dark and daylight pairs: exact patches, pure functions of their number, the same view on both sides."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from diffnav.darkness import Darkening, DarknessModel, apply_gamma, darken
from diffnav.data.pairs import TrainingPairs, WholePairs, dark_window
from diffnav.data.photos import Photo
from diffnav.data.store import PhotoStore
from diffnav.images import from_uint8, write_image

VARIED = DarknessModel((2.0, 5.5), (70, 98), (0.0, 0.01), (0.0, 0.004), (1.0, 9.0), 0.05)
PLAIN = DarknessModel(quality=(0, 0))


def make_levels(height: int, width: int, seed: int = 0) -> np.ndarray:
    """(H, W, 3) uint8, coarse blocks and noise: chroma and luma that JPEG changes."""
    dice = np.random.default_rng(seed)
    coarse = dice.integers(0, 200, (height // 5 + 1, width // 5 + 1, 3)).repeat(5, 0).repeat(5, 1)
    return (coarse[:height, :width] + dice.integers(0, 56, (height, width, 3))).astype(np.uint8)


def make_store(*sizes: tuple[int, int]) -> PhotoStore:
    pictures = [from_uint8(make_levels(*size, seed=k)) for k, size in enumerate(sizes)]
    photos = [Photo(f"photo{k}", "photo", lambda made=made: made) for k, made in enumerate(pictures)]
    return PhotoStore(photos, None, smallest=16)


@settings(max_examples=120, deadline=None)
@given(st.data())
def test_dark_window_is_a_cut_of_the_whole_darkened_picture(data):
    height, width = (data.draw(st.integers(33, 150), label=name) for name in ("height", "width"))
    patch = data.draw(st.integers(8, 33), label="patch")
    ends = st.sampled_from(["first", "last", "any"])
    top, left = (
        {"first": 0, "last": size - patch, "any": data.draw(st.integers(0, size - patch))}[data.draw(ends)]
        for size in (height, width)
    )
    record = Darkening(
        gamma=data.draw(st.floats(0.5, 5)),
        maximum=0.9,
        quality=data.draw(st.sampled_from([0, 5, 30, 75, 95, 100])),
        cast=data.draw(st.sampled_from([(1.0, 1.0, 1.0), (1.05, 1.0, 0.95)])),
    )
    levels = make_levels(height, width)
    whole = darken(from_uint8(levels), record)
    window = dark_window(levels, top, left, patch, record)
    assert torch.equal(window, whole[:, top : top + patch, left : left + patch])


@pytest.mark.parametrize("blur_px", [1.5, 9.0, 31.0, 33.0, 50.0])
@pytest.mark.parametrize("quality", [0, 60])
def test_dark_window_reaches_as_far_as_the_blur(blur_px, quality):
    levels = make_levels(230, 260)
    for seed in range(6):
        dice = np.random.default_rng(seed)
        top, left = int(dice.integers(0, 230 - 40 + 1)), int(dice.integers(0, 260 - 40 + 1))
        record = Darkening(2.0, 1.0, quality, blur_px=blur_px, blur_deg=float(dice.uniform(0, 180)))
        whole = darken(from_uint8(levels), record)[:, top : top + 40, left : left + 40]
        assert torch.equal(dark_window(levels, top, left, 40, record), whole)


def equal(a: dict, b: dict) -> bool:
    return all(torch.equal(a[key], b[key]) for key in ("low", "normal"))


@pytest.mark.parametrize("augment", [True, False])
def test_a_sample_is_a_pure_function_of_seed_and_number(augment):
    def pairs(seed: int = 4) -> TrainingPairs:
        return TrainingPairs(make_store((40, 50), (33, 60), (64, 32)), VARIED, 32, seed, augment)

    first, second = pairs(), pairs()
    numbers = list(range(12))
    forwards = {number: first[number] for number in numbers}
    backwards = {number: second[number] for number in reversed([*numbers, 5, 0, 11])}
    assert all(equal(forwards[number], backwards[number]) for number in numbers)
    assert not any(equal(forwards[number], pairs(seed=5)[number]) for number in numbers)
    assert not any(equal(forwards[a], forwards[b]) for a in numbers for b in numbers if a < b)
    assert forwards[0]["low"].shape == forwards[0]["normal"].shape == (3, 32, 32)


def flat_store(count: int) -> PhotoStore:
    """Photos of one grey level each, so that a patch tells where it comes from."""
    photos = [Photo(str(k), "flat", lambda k=k: torch.full((3, 40, 40), (100 + 10 * k) / 255)) for k in range(count)]
    return PhotoStore(photos, None, smallest=16)


def test_an_epoch_visits_each_photo_once_in_a_new_order():
    pairs = TrainingPairs(flat_store(7), PLAIN, 16, seed=1)
    assert len(pairs) == 7
    epochs = [
        [round(pairs[number]["normal"][0, 0, 0].item() * 255) for number in range(start, start + 7)]
        for start in (0, 7, 14)
    ]
    assert all(sorted(epoch) == [100 + 10 * k for k in range(7)] for epoch in epochs)
    assert len({tuple(epoch) for epoch in epochs}) == 3


def test_darkness_is_drawn_anew_or_once_per_photo():
    def two_tone(k: int) -> torch.Tensor:
        # White at the border keeps M at 1; patches of 16 lie inside or show both.
        image = torch.full((3, 40, 40), (150 + 10 * k) / 255)
        image[:, 0] = 1
        return image

    photos = [Photo(str(k), "s", lambda k=k: two_tone(k)) for k in range(5)]
    store = PhotoStore(photos, None, smallest=16)

    def darkness_of(augment: bool) -> dict[int, set[int]]:
        pairs = TrainingPairs(store, PLAIN, 16, seed=2, augment_darkness=augment)
        found: dict[int, set[int]] = {}
        for number in range(8 * 5):
            sample = {key: (image * 255).round().int()[0, 8, 8].item() for key, image in pairs[number].items()}
            found.setdefault(sample["normal"], set()).add(sample["low"])
        return found

    once, anew = darkness_of(False), darkness_of(True)
    assert once.keys() == anew.keys() == {150, 160, 170, 180, 190}
    assert all(len(values) == 1 for values in once.values())
    assert all(len(values) > 3 for values in anew.values())
    gammas = {round(np.log(min(low) / 255) / np.log(normal / 255), 1) for normal, low in once.items()}
    assert len(gammas) > 2, "photos differ in their gamma"


def test_low_and_normal_show_the_same_view():
    """Without JPEG and noise each dark pixel is a function of its daylight pixel, wherever flips have put it."""
    store = make_store((48, 40), (40, 48))
    pairs = TrainingPairs(store, DarknessModel((2.0, 2.0), (0, 0)), 24, seed=3)
    for number in range(40):
        low, normal = pairs[number]["low"], pairs[number]["normal"]
        maxima = [(apply_gamma(normal, Darkening(2.0, maximum)) - low).abs().max() for maximum in store.maximum]
        assert min(maxima) <= 0.5 / 255 + 1e-6


def test_patches_are_flipped_turned_and_spread_evenly():
    ramp = torch.zeros(3, 40, 40)
    ramp[0], ramp[1] = torch.arange(40) / 100, torch.arange(40)[:, None] / 100
    pairs = TrainingPairs(PhotoStore([Photo("a", "a", lambda: ramp)], None, 16), PLAIN, 24, seed=0)
    poses, corners = Counter(), set()
    for number in range(400):
        normal = pairs[number]["normal"]
        along = normal[:2, :, -1].mean(1) - normal[:2, :, 0].mean(1)
        down = normal[:2, -1].mean(1) - normal[:2, 0].mean(1)
        poses[tuple(torch.cat([along, down]).sign().int().tolist())] += 1
        corners.add((normal[0].min().item(), normal[1].min().item()))
    assert len(poses) == 8
    assert all(25 <= count <= 80 for count in poses.values()), "50 expected; .1 % of fair draws lie outside"
    assert {min(xs) for xs in zip(*corners, strict=True)} == {0}
    assert len(corners) > 150


def stored_pair(folder: Path, record: Darkening | None) -> Photo:
    write_image(folder / "day.png", from_uint8(make_levels(40, 48, 1)))
    write_image(folder / "night.png", from_uint8(make_levels(40, 48, 2)))
    return Photo("real", "real", folder / "day.png", folder / "night.png", record)


def test_stored_dark_pictures_are_used_as_they_are(tmp_path):
    record = Darkening(4.0, 0.8)
    store = PhotoStore([stored_pair(tmp_path, record)], None, 16)
    whole = WholePairs(store, VARIED)[0]
    assert torch.equal(whole["low"], from_uint8(make_levels(40, 48, 2)))
    assert whole["record"] == record
    assert torch.equal(whole["record"].normal, whole["normal"])
    assert WholePairs(PhotoStore([stored_pair(tmp_path, None)], None, 16), VARIED)[0]["record"] is None
    patch = TrainingPairs(store, VARIED, 40, seed=0)
    joint = {tuple(p) for p in np.concatenate([make_levels(40, 48, 1), make_levels(40, 48, 2)], 2).reshape(-1, 6)}
    for number in range(5):
        seen = torch.cat([patch[number]["normal"], patch[number]["low"]]) * 255
        assert {tuple(p) for p in seen.round().int().permute(1, 2, 0).reshape(-1, 6).tolist()} <= joint


def test_whole_pairs_do_not_depend_on_the_other_photos():
    few, many = make_store((40, 48)), make_store((40, 48), (33, 50), (64, 64))
    one, other = WholePairs(few, VARIED, seed=3)[0], WholePairs(many, VARIED, seed=3)[0]
    assert equal(one, other)
    assert one["record"] == other["record"]
    assert (one["name"], one["site"]) == ("photo0", "photo")
    assert len({WholePairs(many, VARIED, seed=3)[k]["record"].gamma for k in range(3)}) == 3
    assert WholePairs(many, VARIED, seed=4)[0]["record"].gamma != one["record"].gamma


def test_whole_pairs_follow_their_record_and_crop_the_centre():
    store = make_store((41, 48))
    whole, cut = WholePairs(store, VARIED)[0], WholePairs(store, VARIED, crop=(20, 100))[0]
    normal = from_uint8(make_levels(41, 48))
    assert torch.equal(whole["normal"], normal)
    assert whole["record"].maximum == normal.max()
    assert torch.equal(whole["low"], darken(normal, whole["record"]))
    assert torch.equal(cut["low"], whole["low"][:, 10:30])
    assert torch.equal(cut["normal"], normal[:, 10:30])
    assert torch.equal(cut["record"].normal, cut["normal"])
    assert cut["record"] == whole["record"], "M stays that of the whole picture"
