"""One process or many: what `torchrun` sets up, seen from the training loop."""

import os
from dataclasses import dataclass

import torch

# Its default arguments hold the process group of the time when it is first imported. DistributedDataParallel would
# import it after the group began: the group, never released, would keep threads that abort the process at its end.
import torch.distributed.nn
from torch import Tensor, distributed, nn


@dataclass(frozen=True)
class Crew:
    """The processes that train together. rank: this one's number; size: how many there are."""

    rank: int = 0
    size: int = 1

    @property
    def leads(self) -> bool:
        """Whether this process logs, validates and saves."""
        return self.rank == 0

    def wrap(self, stage: nn.Module) -> nn.Module:
        """The stage with gradients averaged over all processes."""
        return nn.parallel.DistributedDataParallel(stage) if self.size > 1 else stage

    def mean(self, value: Tensor) -> Tensor:
        """The mean of a scalar over all processes."""
        if self.size > 1:
            distributed.all_reduce(value)
            value = value / self.size
        return value

    def any(self, flag: bool) -> bool:
        """Whether the flag is set in any process (so that all stop together)."""
        if self.size == 1:
            return flag
        votes = torch.tensor(float(flag))
        if distributed.get_backend() == "nccl":
            votes = votes.cuda()
        distributed.all_reduce(votes)
        return votes.item() > 0

    def wait(self) -> None:
        """Return when every process has come here."""
        if self.size > 1:
            distributed.barrier()


def join_crew(device: torch.device) -> Crew:
    """The crew that `torchrun` started, joined by gloo (CPU) or nccl (CUDA); without it, a crew of one."""
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        return Crew()
    if device.type == "cuda":
        torch.cuda.set_device(int(os.environ.get("LOCAL_RANK", "0")))
    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    return Crew(distributed.get_rank(), size)


def leave_crew(crew: Crew) -> None:
    """End the process group, if there is one."""
    if crew.size > 1:
        distributed.destroy_process_group()
