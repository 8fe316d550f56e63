"""The references of a drive: read once, their features found once per matcher and kept on disk."""

import hashlib
import json
import os
import pickle
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tqdm import tqdm

from diffnav.data.driving.driving_set import DrivingSet, Frame
from diffnav.driving.shortlist import picture_descriptor
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.fingerprints import fingerprint
from diffnav.evaluation.workers import spread
from diffnav.images import ImageError
from diffnav.matching.matches import Features

# Of the files; another number finds none of the old ones.
_LAYOUT = 1
_ARRAYS = ("keypoints", "descriptors", "scores")


@dataclass(frozen=True)
class Reference:
    """What is known of one reference.

    size: (h, w). grey: whether its channels are equal. descriptor: of the picture as a whole. features: matcher's
    name -> features. problem: why it cannot be used; the rest is then empty.
    """

    size: tuple[int, int] = (0, 0)
    grey: bool = False
    descriptor: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))
    features: dict[str, Features] = field(default_factory=dict)
    problem: str | None = None


@dataclass(frozen=True)
class ReferenceReader:
    """Finds everything about one reference; a task for `spread`.

    folder: where it is kept, None: nowhere. Yields the `Reference` pickled: multiprocessing's own way would share its
    tensors through files, thousands of them.
    """

    matchers: Sequence[NamedMatcher]
    longest_side: int | None
    folder: Path | None

    def __call__(self, frame: Frame) -> Iterator[bytes]:
        path = self._path(frame)
        known = _load(path, self.matchers)
        if known is not None:
            yield pickle.dumps(known)
            return
        try:
            picture = frame.read(self.longest_side)
        except ImageError as error:
            yield pickle.dumps(Reference(problem=str(error)))
            return
        features = {named.name: named.matcher.features(picture) for named in self.matchers}
        for name, own in features.items():
            if own.image is not None:
                raise UserError(f"matchers={name} has no keypoints that could be kept; use another, e.g. orb_gms")
        grey = bool((picture == picture[:1]).all())
        found = Reference((picture.shape[1], picture.shape[2]), grey, picture_descriptor(picture), features)
        if path is not None:
            _save(path, found)
        yield pickle.dumps(found)

    def _path(self, frame: Frame) -> Path | None:
        if self.folder is None:
            return None
        facts = [_LAYOUT, picture_key(frame, self.longest_side), [named.fingerprint for named in self.matchers]]
        key = hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]
        return self.folder / key[:2] / f"{key}.npz"


def read_references(
    drive: DrivingSet, reader: ReferenceReader, workers: int = 1, progress: bool = False
) -> tuple[DrivingSet, list[Reference]]:
    """The drive without references that cannot be used, which `unmatched` then names, and the others' features.

    Raises: UserError if none can be used, a matcher has no keypoints, or the folder cannot be written.
    """
    # Here, so that the workers need not: each reads source files.
    _ = [named.fingerprint for named in reader.matchers]
    found = [Reference()] * len(drive.references)
    with (
        tqdm(total=len(found), desc="references", unit="picture", disable=not progress) as bar,
        closing(spread(reader, drive.references, workers)) as results,
    ):
        for index, pickled in results:
            found[index] = pickle.loads(pickled)
            bar.update()
    problems = {k: reference.problem for k, reference in enumerate(found) if reference.problem is not None}
    return drive.without(problems), [reference for reference in found if reference.problem is None]


def picture_key(frame: Frame, longest_side: int | None) -> str:
    """A hash of what decides a frame's pixels: its file's bytes, or the code and the arguments that render it."""
    if isinstance(frame.picture, Path):
        try:
            content = hashlib.sha256(frame.picture.read_bytes()).hexdigest()
        except OSError:
            content = str(frame.picture)
    else:
        function: Any = getattr(frame.picture, "func", frame.picture)
        content = fingerprint(hashlib.sha256(pickle.dumps(frame.picture)).hexdigest(), {function.__module__})
    return f"{content}/{longest_side}"


def _save(path: Path, reference: Reference) -> None:
    arrays: dict[str, Any] = {"size": reference.size, "grey": reference.grey, "descriptor": reference.descriptor}
    for name, features in reference.features.items():
        arrays |= {f"{name}/{key}": getattr(features, key).numpy() for key in _ARRAYS}
    aside = path.with_suffix(f".{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with aside.open("wb") as file:
            np.savez(file, **arrays)
        os.replace(aside, path)
    except OSError as error:
        raise UserError(f"{path.parent}: cannot be written ({error.strerror}); choose another cache=") from None


def _load(path: Path | None, matchers: Sequence[NamedMatcher]) -> Reference | None:
    """What was kept; one that is damaged counts as none."""
    if path is None or not path.exists():
        return None
    try:
        with np.load(path) as kept:
            size = int(kept["size"][0]), int(kept["size"][1])
            features = {named.name: _features(kept, named.name, size) for named in matchers}
            return Reference(size, bool(kept["grey"]), kept["descriptor"], features)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _features(kept: Mapping[str, np.ndarray], name: str, size: tuple[int, int]) -> Features:
    keypoints, descriptors, scores = (torch.from_numpy(kept[f"{name}/{key}"]) for key in _ARRAYS)
    return Features(keypoints, descriptors, scores, size)
