"""The public data sets' folders, as trees of pictures of 4 x 4 pixels."""

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from diffnav.darkness import Darkening
from diffnav.data.lol import lol_photos
from diffnav.data.rsod import rsod_photos
from diffnav.data.scene_photos import scene_photos
from diffnav.data.store import PhotoStore
from diffnav.data.visdrone import visdrone_photos
from diffnav.data.written import written_photos
from diffnav.errors import UserError

SHARED = Path(__file__).parents[3] / "shared" / "data"


@pytest.fixture
def tree(tmp_path: Path) -> Callable[..., Path]:
    """Make small pictures at these paths, each of its own grey, below a folder."""

    def grow(*paths: str) -> Path:
        for level, path in enumerate(paths):
            (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(np.full((4, 4, 3), level, np.uint8)).save(tmp_path / path)
        return tmp_path

    return grow


class TestVisDrone:
    NAMES = ("0000001_02999_d_0000005", "0000001_03499_d_0000006", "9999937_00000_d_0000001")

    def test_part_of_parent(self, tree) -> None:
        train = [f"VisDrone2018-DET-train/images/{name}.jpg" for name in self.NAMES]
        root = tree(*train, "VisDrone2018-DET-val/images/0000022_00500_d_0000005.jpg")
        (root / "VisDrone2018-DET-train/annotations").mkdir()
        (root / "VisDrone2018-DET-train/annotations" / f"{self.NAMES[0]}.txt").write_text("684,8,273,116,0,0,0,0")
        photos = visdrone_photos(root)
        assert [photo.normal for photo in photos] == [root / path for path in train]
        assert [photo.site for photo in photos] == ["0000001", "0000001", "9999937"]
        both = visdrone_photos(root, ("train", "val"))
        assert [photo.site for photo in both] == ["0000001", "0000001", "9999937", "0000022"]
        assert len({photo.name for photo in both}) == 4
        assert {photo.low for photo in both} == {None}

    def test_part_itself_and_the_later_release(self, tree) -> None:
        root = tree(*(f"VisDrone2019-DET-train/images/{name}.jpg" for name in self.NAMES))
        itself = visdrone_photos(root / "VisDrone2019-DET-train", ("val",))
        assert [photo.normal for photo in itself] == [photo.normal for photo in visdrone_photos(str(root))]

    def test_missing_part_describes_the_tree(self, tree) -> None:
        root = tree("VisDrone2018-DET-train/images/0000001_02999_d_0000005.jpg")
        for where, part in ((root, "val"), (root / "nowhere", "train")):
            with pytest.raises(
                UserError, match=rf"no folder .*DET-{part}.images: VisDrone2018-DET is folders .*images;"
            ):
                visdrone_photos(where, (part,))
        with pytest.raises(UserError, match=r"data\.photos\.parts names no part"):
            visdrone_photos(root, ())


class TestRSOD:
    def test_four_folders(self, tree) -> None:
        paths = [
            f"{name}/JPEGImages/{name}_{n}.jpg"
            for name in ("aircraft", "playground", "overpass", "oiltank")
            for n in (1, 2)
        ]
        root = tree(*paths)
        (root / "aircraft/Annotation/xml").mkdir(parents=True)
        (root / "aircraft/Annotation/xml/aircraft_1.xml").write_text("<annotation/>")
        photos = rsod_photos(root)
        assert [photo.normal for photo in photos] == [root / path for path in paths]
        assert [photo.site for photo in photos[::2]] == ["aircraft", "playground", "overpass", "oiltank"]
        assert [photo.site for photo in rsod_photos(root, ["oiltank"])] == ["oiltank", "oiltank"]

    def test_missing_folder_describes_the_tree(self, tree) -> None:
        root = tree("aircraft/JPEGImages/aircraft_1.jpg")
        with pytest.raises(
            UserError, match=r"no folder .*playground.JPEGImages: RSOD is folders aircraft, playground,"
        ):
            rsod_photos(root)
        with pytest.raises(UserError, match=r"data\.photos\.classes names no class"):
            rsod_photos(root, [])


class TestLOL:
    @pytest.mark.parametrize(
        ("dark", "bright"), [("low", "high"), ("low", "normal"), ("under", "over"), ("Low", "Normal")]
    )
    def test_pairs_by_stem_whatever_the_ending(self, tree, dark: str, bright: str) -> None:
        root = tree(f"{dark}/9.png", f"{dark}/10.png", f"{bright}/10.jpg", f"{bright}/9.jpg")
        found = {photo.name: (photo.low, photo.normal) for photo in lol_photos(root)}
        assert found == {
            "9": (root / dark / "9.png", root / bright / "9.jpg"),
            "10": (root / dark / "10.png", root / bright / "10.jpg"),
        }

    def test_unmatched_pictures_are_listed_and_never_zipped(self, tree) -> None:
        """One missing on each side: equal counts, so that zipping sorted lists would go unnoticed."""
        root = tree("low/a.png", "low/b.png", "low/c.png", "high/a.jpg", "high/c.jpg", "high/d.jpg")
        store = PhotoStore(lol_photos(root), None, 1)
        assert [photo.name for photo in store.photos] == ["a", "c"]
        assert [int(low[0, 0, 0]) for low in store.low] == [0, 2]
        assert store.problems == [f"{root}/high/b.png: no such file", f"{root}/low/d.jpg: no such file"]

    def test_mistakes_describe_the_tree(self, tree, tmp_path: Path) -> None:
        (tmp_path / "other").mkdir()
        for where in (tmp_path / "other", tmp_path / "nowhere"):
            with pytest.raises(
                UserError, match=r"no pairs in .*: dark pictures belong in its folder low .* under and over"
            ):
                lol_photos(where)
        root = tree("low/low1.png", "high/normal1.png")
        with pytest.raises(UserError, match=r"share no file name \(low1 and normal1\)"):
            lol_photos(root)
        with pytest.raises(UserError, match=r"x\.jpg and .*x\.png have one name"):
            lol_photos(tree("low/x.png", "low/x.jpg", "high/x.jpg"))

    @pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared images beside the repository")
    @pytest.mark.parametrize(("name", "count"), [("lol_eval15", 15), ("mefb_brackets", 11)])
    def test_the_shared_pairs(self, name: str, count: int) -> None:
        photos = lol_photos(SHARED / "lowlight" / name)
        assert len(photos) == count
        assert all(photo.low.is_file() and photo.normal.is_file() for photo in photos)
        assert all(photo.low.stem == photo.normal.stem for photo in photos)


LINE = {
    "name": "a/x", "site": "a", "low": "low/a/x.jpg", "normal": "normal/a/x.jpg", "source": "a/x.png",
    "low_sha256": "0", "normal_sha256": "1", "source_sha256": "2", "gamma": 3.25, "maximum": 0.5, "quality": 90,
    "seed": 7, "shot": 0.01, "read": 0.002, "blur_px": 4.5, "blur_deg": 30.0, "cast": [1.0, 0.9, 1.1], "A": 4.757,
}  # fmt: skip


class TestWritten:
    def manifest(self, folder: Path, *lines: str) -> Path:
        (folder / "manifest.jsonl").write_text("".join(lines))
        return folder

    def test_low_normal_and_record(self, tmp_path: Path) -> None:
        later = json.dumps({**LINE, "gamma": 4.0}) + "\n"
        other = json.dumps({**LINE, "name": "b"}) + "\n"
        root = self.manifest(tmp_path, other, json.dumps(LINE) + "\n", later, '{"name": "half')
        first, second = written_photos(root)
        assert (first.name, first.site) == ("a/x", "a")
        assert (first.low, first.normal) == (root / "low/a/x.jpg", root / "normal/a/x.jpg")
        noise = {"shot": 0.01, "read": 0.002, "blur_px": 4.5, "blur_deg": 30.0, "cast": (1.0, 0.9, 1.1)}
        assert first.record == Darkening(gamma=4.0, maximum=0.5, quality=90, seed=7, **noise)
        assert second.record == Darkening(gamma=3.25, maximum=0.5, quality=90, seed=7, **noise)
        # A = M^(1 - gamma) = .5^-3.
        assert pytest.approx(8.0) == first.record.A

    def test_mistakes_are_one_sentence(self, tmp_path: Path) -> None:
        with pytest.raises(UserError, match=r"no manifest\.jsonl in .*: a written data set is folders low and normal"):
            written_photos(tmp_path)
        with pytest.raises(UserError, match="lists no picture"):
            written_photos(self.manifest(tmp_path, ""))
        for damaged in ("{}\n", "[1]\n", "not json\n", "3\n"):
            with pytest.raises(UserError, match="line 2 is damaged"):
                written_photos(self.manifest(tmp_path, json.dumps(LINE) + "\n", damaged))


class TestScenes:
    def test_windows_are_photos_that_travel_to_workers(self) -> None:
        photos = scene_photos(3, seed=4, size=(24, 40))
        again = pickle.loads(pickle.dumps(photos))
        images = [photo.read_normal() for photo in photos]
        assert all(torch.equal(image, photo.read_normal()) for image, photo in zip(images, again, strict=True))
        assert {image.shape for image in images} == {(3, 24, 40)}
        assert not torch.equal(images[0], images[1])
        # On the grid of 8 bit, as a file would be.
        assert all(torch.equal((image * 255).round() / 255, image) for image in images)

    def test_seed_and_count(self) -> None:
        few, many, other = (scene_photos(count, seed, (16, 16)) for count, seed in ((2, 0), (3, 0), (2, 1)))
        assert [photo.name for photo in few] == [photo.name for photo in many[:2]]
        assert len({photo.name for photo in many} | {photo.site for photo in other}) == 5
        assert torch.equal(few[1].read_normal(), many[1].read_normal())
        assert not torch.equal(few[1].read_normal(), other[1].read_normal())

    def test_none_is_refused(self) -> None:
        with pytest.raises(UserError, match=r"data\.photos\.count must be 1 or more"):
            scene_photos(0)
