"""Nearest binary descriptors in many images at once: Hamming distances as products of matrices, exactly."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

# Images compared in one product: it should stay in the processor's cache.
_IMAGES = 32
# bfloat16 counts to 256 exactly.
_BFLOAT16_BITS = 256


class HammingBlock:
    """Binary descriptors of several images, ready to be searched.

    A bit is 1 or -1 in a query and half of that here, and one more column adds half the number of bits: the product
    of two descriptors is then the number of bits in which they agree. Whole numbers to 256 are exact in bfloat16,
    which processors with AVX-512 multiply several times faster than OpenCV counts bits.

    Args: descriptors: of each image (K, D) uint8, 8 bits each; K may be 0 and differ.
    """

    def __init__(self, descriptors: Sequence[Tensor]) -> None:
        self.bits = 8 * (descriptors[0].shape[1] if descriptors else 0)
        fast = torch.backends.cpu.get_cpu_capability().startswith("AVX512")
        self._kind = torch.bfloat16 if fast and self.bits <= _BFLOAT16_BITS else torch.float32
        self._most = max((len(own) for own in descriptors), default=0)
        self._rows = torch.zeros(len(descriptors), self._most, self.bits + 1, dtype=self._kind)
        for rows, own in zip(self._rows, descriptors, strict=True):
            # What is left of a shorter image agrees in no bit and comes last: it wins against nothing.
            rows[: len(own)] = _columns(own, 0.5, self.bits / 2).to(self._kind)

    def __len__(self) -> int:
        return len(self._rows)

    def nearest(self, descriptors: Tensor) -> tuple[Tensor, Tensor]:
        """Of each query descriptor (N, D) the nearest in each of the R images: (R, N) which, (R, N) bits that differ.

        Equal to `two_nearest_hamming` image by image, of equally near ones the first. An image without descriptors
        has 0 and all bits.
        """
        query = _columns(descriptors, 1.0, 1.0).to(self._kind)
        if 0 in (len(query), self._most):
            nothing = torch.zeros(len(self), len(query))
            return nothing.long(), nothing + self.bits
        parts = [self._nearest(query, rows) for rows in self._rows.split(_IMAGES)]
        which, agreeing = (np.concatenate(column) for column in zip(*parts, strict=True))
        return torch.from_numpy(which), self.bits - torch.from_numpy(agreeing)

    def _nearest(self, query: Tensor, rows: Tensor) -> tuple[np.ndarray, np.ndarray]:
        agreeing = query @ rows.flatten(0, 1).T
        # None is negative: bfloat16's order is then that of its bits as whole numbers, which numpy compares fast.
        order = (agreeing.view(torch.int16) if self._kind == torch.bfloat16 else agreeing).numpy()
        which = order.reshape(len(query), len(rows), self._most).argmax(2)
        most = agreeing.view(len(query), len(rows), self._most).gather(2, torch.from_numpy(which)[..., None])
        return which.T, most[..., 0].float().numpy().T


def _columns(descriptors: Tensor, size: float, last: float) -> Tensor:
    """(N, bits + 1) float32: size where a bit is set and -size where not, then `last`."""
    bits = np.unpackbits(descriptors.cpu().numpy(), axis=1).astype(np.float32)
    return torch.from_numpy(np.concatenate([(2 * bits - 1) * size, np.full((len(bits), 1), last, np.float32)], 1))
