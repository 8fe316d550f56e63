"""What the matching experiments make of their configuration: matchers, the contest, its protocol, what is shown."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import torch
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import choices, plain, whole_number
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.evaluation.contest import Contest, NamedMatcher
from diffnav.evaluation.match_records import CORRECT_PX
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.workers import available_cores
from eval.session import named_choice, plain_list, protocol

Named = TypeVar("Named", Method, NamedMatcher)


def make_contest(cfg: DictConfig, methods: Sequence[Method]) -> Contest:
    """What meets in a matching experiment: the methods, `matchers`, `verification`, the cache of enhanced pictures."""
    cache = PredictionCache(Path(str(cfg.cache)).expanduser() if cfg.cache else None)
    verification = plain(cfg)["verification"]
    return Contest(methods, make_matchers(cfg.matchers), instantiate(cfg.verification), verification, cache)


def make_matchers(entries: Any) -> list[NamedMatcher]:
    """The matchers of conf/matcher that `entries` names: NAME or {NAME: {setting: value}}; each once."""
    chosen = dict(named_choice("matcher", entry) for entry in plain_list(entries))
    if not chosen:
        raise UserError(f"matchers is empty; name some of {', '.join(choices('matcher'))}")
    return [NamedMatcher(label, instantiate(cfg)) for label, cfg in chosen.items()]


def worker_count(cfg: DictConfig, device: torch.device) -> int:
    """How many processes `workers` means."""
    if cfg.workers is None:
        # On a GPU each process holds all networks in its memory.
        return min(available_cores(), 4) if device.type == "cuda" else available_cores()
    return whole_number("workers", cfg.workers, 1)


def contest_protocol(
    cfg: DictConfig, device: torch.device, contest: Contest, photos: Sequence[Photo], workers: int
) -> dict[str, Any]:
    """What decides the numbers of a matching experiment, as plain values."""
    return {
        "pairs": {"kind": HydraConfig.get().runtime.choices.pairs, **plain(cfg)["pairs"]},
        "correct_px": CORRECT_PX,
        "matchers": {named.name: dict(named.matcher.settings) for named in contest.matchers},
        "verification": dict(contest.verification),
        "workers": workers,
        **protocol(cfg, device, contest.methods, photos),
    }


def shown_methods(cfg: DictConfig, methods: Sequence[Method]) -> list[Method]:
    """The methods of the figures: those that are named, or input, gamma_blind and the last row."""
    if cfg.figures.methods is not None:
        return select("figures.methods", methods, cfg.figures.methods)
    return [method for method in methods if method.name in ("input", "gamma_blind") or method is methods[-1]]


def select(key: str, available: Sequence[Named], wanted: Any) -> list[Named]:
    """Those whose names the setting `key` lists, in its order; all for null. Raises: UserError for another name."""
    if wanted is None:
        return list(available)
    by_name = {one.name: one for one in available}
    for name in plain_list(wanted):
        if name not in by_name:
            raise UserError(f"{key} names {name}, which is not measured here; there are {', '.join(by_name)}")
    return [by_name[name] for name in plain_list(wanted)]
