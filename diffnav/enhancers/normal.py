"""The daylight image itself, out of the darkening's record: the ceiling of every matching table."""

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from diffnav.darkness import Darkening
from diffnav.enhancers.records import require_records
from diffnav.errors import UserError


class Normal(nn.Module):
    """The daylight images that the records hold: (B, 3, H, W) in [0, 1] -> the same shape.

    Raises: UserError if a record, or the picture in it, is missing or of another size.
    """

    needs_record = True

    def forward(self, image: Tensor, record: Sequence[Darkening] | None = None) -> Tensor:
        return daylight_of(image, record, "normal")


def daylight_of(image: Tensor, record: Sequence[Darkening] | None, enhancer: str) -> Tensor:
    """The daylight pictures in the records, like the batch `image`. Raises: UserError naming the enhancer."""
    pictures = [one.normal for one in require_records(image, record, enhancer)]
    if any(picture is None or picture.shape != image.shape[1:] for picture in pictures):
        raise UserError(f"the enhancer {enhancer} needs the daylight picture, of the same size, in each record")
    return torch.stack(pictures).to(image)  # type: ignore[arg-type]
