"""Terms weighed by the gradient that they send into the picture, not by their value; and when the homography joins."""

from collections.abc import Mapping

import torch
from torch import Tensor, nn

# Of the running means: about the last fifty steps.
_MEMORY = 0.98
_NO_GRADIENT = 1e-12


class Balance(nn.Module):
    """Keeps a running mean of each term's gradient norm with respect to the picture; part of a run's saved state.

    names: of the terms, the first being the one that the others are weighed against.
    """

    def __init__(self, names: list[str]) -> None:
        super().__init__()
        self.names = names
        for name in names:
            self.register_buffer(f"norm_{name}", torch.zeros(()))

    def pulls(self, terms: Mapping[str, Tensor], picture: Tensor) -> dict[str, Tensor]:
        """Name -> the gradient of each term with respect to `picture`; remembers their norms."""
        gradients = {}
        for name, term in terms.items():
            (gradients[name],) = torch.autograd.grad(term, picture, retain_graph=True)
            norm: Tensor = getattr(self, f"norm_{name}")
            new = gradients[name].norm()
            norm.copy_(torch.where(norm > 0, _MEMORY * norm + (1 - _MEMORY) * new, new))
        return gradients

    def share(self, name: str, gradient: Tensor) -> Tensor:
        """The factor that gives a term's gradient the norm that the first term's usually has.

        Where the term pulls harder than it usually does, the factor shrinks: no single batch takes over.
        """
        usual: Tensor = getattr(self, f"norm_{name}")
        first: Tensor = getattr(self, f"norm_{self.names[0]}")
        return first / torch.maximum(usual, gradient.norm()).clamp(min=_NO_GRADIENT)


class Curriculum(nn.Module):
    """The homography term joins when matching has become good enough: a factor from 0 to 1; part of the saved state.

    threshold: the running mean of the match loss below which it begins. ramp: steps until the factor is 1.
    """

    def __init__(self, threshold: float = 3.0, ramp: int = 500) -> None:
        super().__init__()
        self.threshold = threshold
        self.ramp = max(ramp, 1)
        self.register_buffer("match_mean", torch.full((), torch.nan))
        self.register_buffer("steps_since", torch.zeros((), dtype=torch.int64))

    def step(self, match: Tensor) -> Tensor:
        """The factor at this step, from the match loss of this step (a scalar)."""
        mean: Tensor = self.match_mean  # type: ignore[assignment]
        since: Tensor = self.steps_since  # type: ignore[assignment]
        match = match.detach()
        mean.copy_(torch.where(mean.isnan(), match, _MEMORY * mean + (1 - _MEMORY) * match))
        since.add_(((mean < self.threshold) | (since > 0)).long())
        return (since / self.ramp).clamp(max=1)


def pulled(value: Tensor, gradient: Tensor, picture: Tensor) -> Tensor:
    """A scalar with this value whose gradient with respect to `picture` is `gradient`, at no further cost."""
    pull = (gradient.detach() * picture).sum()
    return value.detach() + pull - pull.detach()
