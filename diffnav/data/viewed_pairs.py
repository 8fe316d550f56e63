"""Training pairs with a second view: the homography and the exposure that the daylight patch is seen again with."""

import math

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import Dataset

from diffnav.data.match_pairs.random_views import RandomViews
from diffnav.data.pairs import Pair, TrainingPairs
from diffnav.errors import UserError


class ViewedPair(Pair):
    """A pair, and how to see its daylight patch again.

    H_view_normal: (3, 3) float64, maps pixels of the view to the patch's; both have the patch's size. exposure: scalar,
    the exponent on the view's brightness.
    """

    H_view_normal: Tensor
    exposure: Tensor


class ViewedPairs(Dataset[ViewedPair]):
    """The samples of `pairs`, unchanged, each with a view of its own; a pure function of (seed, number).

    views: any turn, scale and perspective. exposure: the exponent is drawn from (low, high), evenly on a logarithmic
    scale. Raises: UserError if exposure is no range of positive numbers.
    """

    def __init__(self, pairs: TrainingPairs, views: RandomViews, exposure: tuple[float, float] = (0.8, 1.25)) -> None:
        if len(exposure) != 2 or not 0 < exposure[0] <= exposure[1] < math.inf:
            raise UserError(f"views.exposure must be two numbers above 0, low and high; got {list(exposure)}")
        self.pairs = pairs
        self.views = views
        self.exposure = exposure

    def __len__(self) -> int:
        return len(self.pairs)

    def __getitem__(self, number: int) -> ViewedPair:
        size = (self.pairs.patch, self.pairs.patch)
        H_view_normal = self.views.draw(size, self.pairs.seed, f"sample {number}")
        dice = np.random.default_rng([self.pairs.seed, number, 2])
        exponent = math.exp(dice.uniform(*np.log(self.exposure)))
        pair = self.pairs[number]
        return {**pair, "H_view_normal": H_view_normal, "exposure": torch.tensor(exponent)}
