"""Sequences with homographies in both layouts: the truth on marked points, damaged folders."""

from pathlib import Path

import numpy as np
import pytest
import torch

from diffnav.darkness import DarknessModel
from diffnav.data.hpatches import hpatches_photos
from diffnav.data.match_pairs.hpatches import HpatchesPairs
from diffnav.data.pair_source import PairSource
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.geometry.homography import apply_homography
from diffnav.images import quantise, read_image, write_image
from diffnav.matching.ground_truth import correct_matches
from diffnav.matching.sift import Sift

MARKS = [(55.0, 35.0), (70.0, 60.0), (60.0, 45.0)]
SIZE = (96, 128)
OXFORD = Path("../shared/data/hpatches/oxford")
PLAIN = DarknessModel(quality=(0, 0))


def marked(marks=MARKS):
    """(3, 96, 128): in each channel a bright blob at one mark."""
    y, x = torch.meshgrid(torch.arange(96.0), torch.arange(128.0), indexing="ij")
    return torch.stack([torch.exp(-((x - px) ** 2 + (y - py) ** 2) / 18) for px, py in marks])


def centroids(image):
    y, x = torch.meshgrid(torch.arange(96.0), torch.arange(128.0), indexing="ij")
    weights = (image - 0.2).clamp(min=0)
    return torch.stack([torch.stack([(a * w).sum() / w.sum() for a in (x, y)]) for w in weights])


def sequence(folder, first, second, homography, shift):
    """A sequence of two images; the marks of the second lie `shift` further than those of the first."""
    write_image(folder / first, marked())
    write_image(folder / second, marked([(x + shift[0], y + shift[1]) for x, y in MARKS]))
    (folder / homography).write_text(f"1 0 {shift[0]}\n0 1 {shift[1]}\n0 0 1\n")


@pytest.fixture
def sequences(tmp_path):
    sequence(tmp_path / "wall", "img1.png", "img2.png", "H1to2p", (9, -4))
    sequence(tmp_path / "v_home", "1.ppm", "2.ppm", "H_1_2", (-6, 3))
    return tmp_path


def test_both_layouts_of_sequences(sequences):
    pairs = HpatchesPairs(PairSource(hpatches_photos(sequences), PLAIN))
    assert [(photo.name, photo.site) for photo in pairs.photos] == [("v_home/2", "v_home"), ("wall/img2", "wall")]
    for photo in pairs.photos:
        pair = pairs.read(photo)
        assert torch.equal(pair.reference, quantise(marked()))
        assert torch.equal(pair.pair["normal"], read_image(photo.normal))
        assert pair.pair["record"].gamma >= 3
        found = apply_homography(pair.H_query_reference, centroids(pair.query(pair.pair["normal"])))
        np.testing.assert_allclose(found, MARKS, atol=0.05)


@pytest.mark.parametrize(("content", "expected"), [("1 0 x 0 1 0 0 0 1", "nine numbers"), ("1 0 0 " * 3, "invertible")])
def test_a_damaged_homography_is_one_sentence(content, expected, sequences):
    pairs = HpatchesPairs(PairSource(hpatches_photos(sequences), PLAIN))
    (sequences / "wall" / "H1to2p").write_text(content)
    with pytest.raises(UserError, match=f"H1to2p: .*{expected}"):
        pairs.read(pairs.photos[1])


def test_missing_files_are_one_sentence(sequences):
    pairs = HpatchesPairs(PairSource(hpatches_photos(sequences), PLAIN))
    (sequences / "wall" / "H1to2p").rename(sequences / "wall" / "H_1_2")
    pairs.read(pairs.photos[1])
    (sequences / "wall" / "img1.png").unlink()
    with pytest.raises(UserError, match="no first image"):
        pairs.read(pairs.photos[1])
    (sequences / "wall" / "H_1_2").unlink()
    with pytest.raises(UserError, match="no homography H1to2p or H_1_2"):
        pairs.read(pairs.photos[1])
    (sequences / "wall" / "img2.png").rename(sequences / "wall" / "img1.png")
    with pytest.raises(UserError, match=r"no sequences in .*img1, img2"):
        hpatches_photos(sequences / "wall")


def test_other_photos_and_sizes_are_refused(sequences):
    every = hpatches_photos(sequences)
    with pytest.raises(UserError, match=r"data\.size=null"):
        HpatchesPairs(PairSource(every, PLAIN, size=SIZE))
    with pytest.raises(UserError, match="data=hpatches"):
        HpatchesPairs(PairSource(every, PLAIN)).read(Photo("p", "site", marked))


@pytest.mark.skipif(not OXFORD.is_dir(), reason=f"no {OXFORD}")
def test_published_homographies_are_read_the_right_way_round():
    """boat 3 is zoomed and turned: with the true homography most of SIFT's matches are right, inverted none is."""
    every = hpatches_photos(OXFORD)
    assert len(every) == 25
    pair = HpatchesPairs(PairSource(every, PLAIN)).read(next(p for p in every if p.name == "boat/img3"))
    sift = Sift()
    matches = sift.match(sift.features(pair.query(pair.pair["normal"])), sift.features(pair.reference))
    assert correct_matches(matches, pair.H_query_reference).float().mean() > 0.7
    assert correct_matches(matches, pair.H_query_reference.inverse()).float().mean() < 0.1
