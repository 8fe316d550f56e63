"""The records of how a batch was darkened, for the enhancers that cannot do without them."""

from collections.abc import Sequence

from torch import Tensor

from diffnav.darkness import Darkening
from diffnav.errors import UserError


def require_records(image: Tensor, record: Sequence[Darkening] | None, enhancer: str) -> Sequence[Darkening]:
    """The records, one per image of the batch (B, 3, H, W). Raises: UserError naming the enhancer if one is missing."""
    if record is None or len(record) != len(image) or any(one is None for one in record):
        raise UserError(
            f"the enhancer {enhancer} needs the record of how each picture was darkened, which real dark pictures "
            "do not have: leave it out, or give daylight pictures to darken"
        )
    return record
