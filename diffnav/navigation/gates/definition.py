"""How much detail a picture shows: the paper's definition, Eq. 10."""

from kornia.color import rgb_to_grayscale
from torch import Tensor
from torch.nn.functional import pad


def definition(image: Tensor, literal_sum: bool = False) -> Tensor:
    """Df, the mean absolute Laplacian of the grey picture in 0..255: a scalar, or (B,) of a batch.

    Args:
        image: (3, H, W) or (B, 3, H, W) in [0, 1].
        literal_sum: the sum of Eq. 10 as it is printed, which grows with the picture, instead of the mean.

    Returns: 0 for a constant picture. Darkness lowers it, and so do flat scenes; noise raises it.
    Raises: ValueError for another shape.
    Source: Eq. 10; the 4-neighbour Laplacian is our choice.
    """
    magnitude = laplacian(image).abs()
    return magnitude.sum((-2, -1)) if literal_sum else magnitude.mean((-2, -1))


def laplacian(image: Tensor) -> Tensor:
    """The 4-neighbour Laplacian of the grey picture in 0..255, the border replicated: (H, W), or (B, H, W)."""
    if image.ndim not in (3, 4) or image.shape[-3] != 3:
        raise ValueError(f"need a picture (3, H, W) or (B, 3, H, W), got {tuple(image.shape)}")
    batch = image if image.ndim == 4 else image[None]
    grey = pad(255 * rgb_to_grayscale(batch), (1, 1, 1, 1), mode="replicate")[:, 0]
    neighbours = grey[:, :-2, 1:-1] + grey[:, 2:, 1:-1] + grey[:, 1:-1, :-2] + grey[:, 1:-1, 2:]
    G = neighbours - 4 * grey[:, 1:-1, 1:-1]
    return G if image.ndim == 4 else G[0]
