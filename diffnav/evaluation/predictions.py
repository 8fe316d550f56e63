"""Enhanced images, and where they are kept on disk: found again by what made them; a name is not a key."""

import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from torch import Tensor

from diffnav.data.pairs import WholePair
from diffnav.errors import UserError
from diffnav.images import ImageError, read_image, write_image


@dataclass(frozen=True)
class Prediction:
    """What a method made of a picture. image: (3, H, W), on the grid of 8 bit. seconds: it took, after warm-up.

    state: figures of R, I and Ih (`component_state`), empty where there are none. device: that it took them on.
    """

    image: Tensor
    seconds: float
    state: dict[str, float] = field(default_factory=dict)
    device: str = ""

    def figures(self) -> dict[str, Any]:
        """Everything but the picture."""
        return {"seconds": self.seconds, "state": self.state, "device": self.device}


def pair_digest(pair: WholePair) -> str:
    """A hash of a pair's pixels and of how it was darkened, not of its name."""
    digest = hashlib.sha256()
    for image in (pair["low"], pair["normal"]):
        digest.update(f"{tuple(image.shape)}".encode())
        digest.update(image.contiguous().numpy().tobytes())
    record = pair["record"]
    digest.update(json.dumps(record.numbers() if record else None, sort_keys=True).encode())
    return digest.hexdigest()


def prediction_key(fingerprint: str, digest: str) -> str:
    """The key of what the method with this fingerprint makes of the pair with this digest: 32 hexadecimal digits."""
    return hashlib.sha256(f"{fingerprint}/{digest}".encode()).hexdigest()[:32]


class PredictionCache:
    """Predictions in a folder, each a lossless PNG with a JSON file beside it; with `folder` None none is kept.

    Raises: UserError if the folder cannot be made.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        if folder is not None:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise UserError(f"{folder}: cannot be made ({error.strerror}); choose another cache=") from None

    def get(self, key: str) -> Prediction | None:
        """The stored prediction, or None; one that is damaged or half written counts as none."""
        paths = self._paths(key)
        if paths is None:
            return None
        picture, figures = paths
        try:
            return Prediction(read_image(picture), **json.loads(figures.read_text()))
        except (ImageError, OSError, ValueError, TypeError):
            return None

    def put(self, key: str, prediction: Prediction) -> None:
        """Store a prediction. Raises: UserError if the folder cannot be written."""
        paths = self._paths(key)
        if paths is None:
            return
        picture, figures = paths
        write_image(picture, prediction.image)
        # Named after the process: evaluations that run at the same time share the folder.
        aside = figures.with_suffix(f".{os.getpid()}.part")
        aside.write_text(json.dumps(prediction.figures()))
        os.replace(aside, figures)

    def _paths(self, key: str) -> tuple[Path, Path] | None:
        if self.folder is None:
            return None
        # Two levels, so that no folder grows to a million files.
        base = self.folder / key[:2] / key
        return base.with_suffix(".png"), base.with_suffix(".json")
