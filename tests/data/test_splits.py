"""Splits into training and validation: deterministic, and no site on both sides."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diffnav.data.photos import Photo
from diffnav.data.splits import split_photos
from diffnav.errors import UserError


def make_photos(**sites: int) -> list[Photo]:
    return [Photo(f"{site}_{k:03}", site, None) for site, count in sites.items() for k in range(count)]


def sites_of(photos: list[Photo]) -> set[str]:
    return {photo.site for photo in photos}


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(1, 20), min_size=2, max_size=12),
    st.sampled_from(["site", "image"]),
    st.floats(0.02, 0.9),
    st.integers(0, 1000),
)
def test_drawn_splits_partition_the_photos(counts, by, fraction, seed):
    photos = make_photos(**{f"s{k}": count for k, count in enumerate(counts)})
    training, validation = split_photos(photos, by=by, fraction=fraction, seed=seed)
    assert training
    assert validation
    assert sorted(p.name for p in training + validation) == sorted(p.name for p in photos)
    names = [photo.name for photo in photos]
    for side in (training, validation):
        places = [names.index(photo.name) for photo in side]
        assert places == sorted(places), "the given order is kept"
    if by == "site":
        assert not sites_of(training) & sites_of(validation)
        unit = max(counts)
    else:
        unit = 1
    # Whole groups come as near as they can: at most one group beside the target.
    assert abs(len(validation) - fraction * len(photos)) <= unit
    assert split_photos(photos, by=by, fraction=fraction, seed=seed) == (training, validation)


def test_a_drawn_split_depends_on_the_seed_and_on_names_alone():
    photos = make_photos(a=10, b=10, c=10, d=10)
    splits = {tuple(p.name for p in split_photos(photos, "image", seed=seed)[1]) for seed in range(10)}
    assert len(splits) > 5
    shuffled = sorted(photos, key=lambda photo: photo.name[::-1])
    assert {p.name for p in split_photos(photos)[1]} == {p.name for p in split_photos(shuffled)[1]}


def test_added_photos_move_few_of_the_others():
    photos = make_photos(a=50)
    before = {p.name for p in split_photos(photos, "image", fraction=0.2)[1]}
    after = {p.name for p in split_photos([*photos, *make_photos(b=5)], "image", fraction=0.2)[1]}
    # A new shuffle would move about 16.
    assert len({name for name in before ^ after if name.startswith("a")}) <= 5


def test_named_sources_are_held_out_whole():
    photos = make_photos(lewis=2, lewis_park=3, lewisham=2, palm=2) + make_photos(**{"palm/north": 2, "other": 4})
    training, validation = split_photos(photos, "sources", ["lewis", "palm"])
    assert sites_of(validation) == {"lewis", "lewis_park", "palm", "palm/north"}
    assert sites_of(training) == {"lewisham", "other"}
    for one in ("palm", ["palm"], ("palm",)):
        assert sites_of(split_photos(photos, "sources", one)[1]) == {"palm", "palm/north"}


def test_wrong_settings_are_one_sentence():
    photos = make_photos(a=3, b=3)
    for arguments, words in (
        ({"by": "colour"}, "split.by must be sources, site or image, got 'colour'"),
        ({"by": "sources"}, "leaves no validation photo of 6"),
        ({"by": "sources", "sources": ["a", "b"]}, "leaves no training photo of 6"),
        ({"by": "sources", "sources": ["c"]}, "split.sources names c, of which there is no photo; the sites are a, b"),
        ({"fraction": 0}, "split.fraction must lie between 0 and 1, got 0"),
        ({"fraction": 1.0}, "split.fraction"),
    ):
        with pytest.raises(UserError) as caught:
            split_photos(photos, **arguments)
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)
    for few, by in itertools.product((make_photos(a=1), []), ("site", "image")):
        with pytest.raises(UserError, match="leaves no"):
            split_photos(few, by)
    with pytest.raises(UserError, match="the split by site leaves no validation photo of 5"):
        split_photos(make_photos(a=5), "site")
