"""What the matching experiment matches: a dark picture to enhance, a daylight reference, the truth between them."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from torch import Tensor

from diffnav.data.pairs import WholePair
from diffnav.data.photos import Photo


@dataclass(frozen=True)
class MatchPair:
    """One query and its reference.

    pair: the dark picture that is enhanced. reference: daylight, (3, H, W). H_query_reference: (3, 3) float64, exact.
    view: the enhanced picture -> the query (3, h, w), e.g. half a turn; None where it is matched as it is.
    visible: (h, w) bool, the query's pixels that show the scene, where not all do; what lies in the others is an
    artefact and counts for nothing.
    """

    pair: WholePair
    reference: Tensor
    H_query_reference: Tensor
    view: Callable[[Tensor], Tensor] | None = None
    visible: Tensor | None = None

    def query(self, enhanced: Tensor) -> Tensor:
        """The picture that is matched, (3, h, w), from the enhanced one."""
        return enhanced if self.view is None else self.view(enhanced)

    def digest(self) -> str:
        """A hash of everything that the matches follow from, but for the enhanced picture; not of names."""
        digest = hashlib.sha256()
        # The dark picture's own view tells what `view` does, its code included.
        for part in (self.query(self.pair["low"]), self.reference, self.H_query_reference, self.visible):
            if part is not None:
                digest.update(f"{part.dtype} {tuple(part.shape)}".encode())
                digest.update(part.contiguous().numpy().tobytes())
        return digest.hexdigest()


class MatchPairs(Protocol):
    """A way to make queries and references of photos. kind: its name in tables and of its YAML."""

    kind: str

    @property
    def photos(self) -> Sequence[Photo]:
        """The photos that `read` takes."""
        ...

    def read(self, photo: Photo) -> MatchPair:
        """The query and reference of one photo. Raises: UserError if it cannot be used."""
        ...


def size_of(image: Tensor) -> tuple[int, int]:
    """(h, w) of an image (3, h, w)."""
    return image.shape[1], image.shape[2]
