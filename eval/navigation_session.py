"""What eval.navigation makes of its configuration: maps, queries, the trial, the facts behind a result."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import torch
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import plain, whole_number
from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.darkened import DarkenedQuery
from diffnav.data.queries.query import Query
from diffnav.data.queries.sets import QuerySet
from diffnav.errors import UserError
from diffnav.evaluation.contest import NamedMatcher
from diffnav.evaluation.methods import Method
from diffnav.evaluation.navigation.searcher import Searcher
from diffnav.evaluation.navigation.trial import Trial
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.provenance import device_name, git_commit, versions
from diffnav.navigation.gates.gate import Gate
from diffnav.navigation.track import Motion
from eval.session import below_shared, named_choice, plain_list


def make_maps(cfg: DictConfig) -> list[GeoMap]:
    """The maps of the group `maps`."""
    if "path" in cfg.maps and cfg.maps.path is None:
        raise UserError("map is missing: name an image with a georeference, or a folder of maps, as map=PATH")
    maps: list[GeoMap] = instantiate(cfg.maps)
    return maps


def make_queries(cfg: DictConfig, maps: Sequence[GeoMap]) -> QuerySet:
    """The queries of the group `query_set`, thinned to `limit`."""
    found: QuerySet = instantiate(cfg.query_set)(maps, instantiate(cfg.darkness), cfg.seed)
    if "dark" in _conditions(cfg) and not any(isinstance(query, DarkenedQuery) for query in found.queries):
        raise UserError("conditions asks for dark pictures, and these photos have none; add query_set.darken=true")
    if cfg.limit is None:
        return found
    return QuerySet(thinned(found.queries, whole_number("limit", cfg.limit, 1)), found.problems)


def thinned(queries: Sequence[Query], limit: int) -> list[Query]:
    """At most `limit` of the queries, spread evenly."""
    if len(queries) <= limit:
        return list(queries)
    return [queries[(2 * k + 1) * len(queries) // (2 * limit)] for k in range(limit)]


def make_searchers(cfg: DictConfig) -> list[Searcher]:
    """Each of `modes` with each of `matchers`; correlation has no matcher."""
    parts = {name: instantiate(cfg[name]) for name in ("search", "correlation", "plausibility")}
    tiles = instantiate(cfg.tiles)
    searchers = []
    for mode in dict.fromkeys(plain_list(cfg.modes)):
        if mode == "correlation":
            searchers.append(Searcher(mode, None, None, cfg.index, tiles, **parts))
            continue
        pairs = zip(_matchers(cfg, cfg.features), _matchers(cfg, cfg.tiles.features), strict=True)
        searchers += [Searcher(mode, query, tile, cfg.index, tiles, **parts) for query, tile in pairs]
    if not searchers:
        raise UserError("modes or matchers is empty; the default is modes=[shortlist] matchers=[sift]")
    return searchers


def make_trial(cfg: DictConfig, maps: Sequence[GeoMap], methods: Sequence[Method], gate: Gate) -> Trial:
    """The task that answers the queries."""
    if not methods:
        raise UserError("there is no row to fill: name one with checkpoint=, enhancers= or always=[input]")
    cache = Path(str(cfg.cache)).expanduser()
    return Trial(
        maps=maps,
        methods=methods,
        searchers=make_searchers(cfg),
        gate=gate,
        known=instantiate(cfg.prior),
        conditions=_conditions(cfg),
        features=cache / "features",
        cache=PredictionCache(cache),
        motion=None if cfg.motion is None else _motion(plain(cfg)["motion"]),
        seed=cfg.seed,
    )


def navigation_protocol(
    cfg: DictConfig, device: torch.device, trial: Trial, queries: QuerySet, workers: int
) -> dict[str, Any]:
    """What decides the numbers of a result, as plain values; paths below the shared data folder are cut to it."""
    facts = below_shared(plain(cfg), cfg)
    # Where pictures are kept decides nothing.
    facts["maps"].pop("cache", None)
    choices = HydraConfig.get().runtime.choices
    kept = ("maps", "query_set", "darkness", "conditions", "gate", "matchers", "modes", "index", "features", "tiles",
            "search", "correlation", "plausibility", "prior", "motion", "limit", "seed")  # fmt: skip
    return {
        "kinds": {"maps": choices.maps, "query_set": choices.query_set},
        **{key: facts[key] for key in kept},
        "queries": len(queries.queries),
        "problems": list(queries.problems),
        "gate_threshold": getattr(trial.gate, "threshold", None),
        "map_tiles": [len(trial.searchers[0].tiles.windows(one)) for one in trial.maps],
        "workers": workers,
        "device": device_name(device),
        "versions": versions(),
        "commit": git_commit(),
        "weights_sha256": {method.name: method.sha256 for method in trial.methods if method.sha256},
    }


def _conditions(cfg: DictConfig) -> list[str]:
    """`conditions`, each once. Raises: UserError for another than day and dark."""
    conditions = list(dict.fromkeys(str(one) for one in plain_list(cfg.conditions)))
    if not set(conditions) <= {"day", "dark"}:
        raise UserError(f"conditions must be of day and dark, got {conditions}")
    return conditions


def _motion(settings: Any) -> Motion:
    known = [setting.name for setting in fields(Motion)]
    fits = isinstance(settings, Mapping) and set(settings) <= set(known)
    if not fits or not all(isinstance(value, int | float) for value in settings.values()):
        raise UserError(f"motion must be {{}} or numbers for some of {', '.join(known)}; got {settings}")
    return Motion(**settings)


def _matchers(cfg: DictConfig, features: int | None) -> list[NamedMatcher]:
    """The matchers of conf/matcher that `matchers` names, each once; with so many features, unless it says itself."""
    found = {}
    for entry in plain_list(cfg.matchers):
        label, own = named_choice("matcher", entry)
        given = next(iter(entry.values())) if isinstance(entry, Mapping) else {}
        # LightGlue has it of its extractor.
        for part, settings in ((own, given), (own.get("extractor", {}), given.get("extractor", {}))):
            if features is not None and "features" in part and "features" not in settings:
                part.features = whole_number("features", features, 1)
        found[label] = NamedMatcher(label, instantiate(own))
    return list(found.values())
