"""What evaluation commands make of their configuration: methods, photos, the facts behind a result."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from hydra.core.hydra_config import HydraConfig
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from conf.command import choice, photos_of, plain, whole_number
from diffnav.data.photos import Photo
from diffnav.data.splits import split_photos, thin_photos
from diffnav.errors import UserError
from diffnav.evaluation.methods import Method, checkpoint_methods, require_distinct
from diffnav.evaluation.provenance import device_name, git_commit, versions
from diffnav.evaluation.seeds import require_controls


def make_methods(cfg: DictConfig, device: torch.device) -> list[Method]:
    """The rows of a table: `always`, `enhancers`, `checkpoint`, then `seeds`; one that is named twice comes once."""
    entries: list[Any] = []
    for entry in [*plain_list(cfg.always), *plain_list(cfg.enhancers)]:
        if entry not in entries:
            entries.append(entry)
    checkpoints = _checkpoints(cfg)
    methods = [configured_method(entry, device) for entry in entries] + checkpoint_methods(checkpoints, device)
    require_distinct(methods)
    names = [method.name for method in methods]
    for reference in plain_list(cfg.get("reference")):
        if reference not in names:
            raise UserError(f"reference={reference} is no row of this table: name one of {', '.join(names)}, or null")
    return methods


def seed_groups(cfg: DictConfig, methods: Sequence[Method]) -> dict[str, list[str]]:
    """The groups of `seeds`: name -> the names of the rows that are its seeds; they must suit `controls`."""
    checkpoints = _checkpoints(cfg)
    names = dict(zip(checkpoints, [method.name for method in methods[-len(checkpoints) :]], strict=False))
    groups = {str(group): [names[str(one)] for one in plain_list(own)] for group, own in (cfg.seeds or {}).items()}
    require_controls(groups, cfg.controls or {})
    return groups


def _checkpoints(cfg: DictConfig) -> list[str]:
    seeds = [one for own in (cfg.get("seeds") or {}).values() for one in plain_list(own)]
    return list(dict.fromkeys(str(checkpoint) for checkpoint in [*plain_list(cfg.checkpoint), *seeds]))


def configured_method(entry: Any, device: torch.device) -> Method:
    """The enhancer NAME of conf/enhancer, or {NAME: {setting: value}}, which is called NAME(setting=value)."""
    label, cfg = named_choice("enhancer", entry)
    enhancer = instantiate(cfg).to(device).eval()
    return Method(label, enhancer, plain(cfg), getattr(enhancer, "sha256", None))


def named_choice(group: str, entry: Any) -> tuple[str, DictConfig]:
    """What a row is called, and its configuration: NAME, or {NAME: {setting: value}}."""
    if isinstance(entry, Mapping) and (len(entry) != 1 or not all(isinstance(v, Mapping) for v in entry.values())):
        raise UserError(f"each {group} is a name or one {{name: {{setting: value}}}}, got {entry}")
    name, overrides = next(iter(entry.items())) if isinstance(entry, Mapping) else (str(entry), {})
    label = f"{name}({', '.join(f'{key}={value}' for key, value in overrides.items())})" if overrides else name
    return label, choice(group, name, OmegaConf.create(dict(overrides)))


def make_photos(cfg: DictConfig) -> list[Photo]:
    """The photos of `data`, or of the `part` of its split, thinned to `limit`."""
    photos: list[Photo] = instantiate(photos_of(cfg))
    if cfg.part not in ("all", "training", "validation"):
        raise UserError(f"part must be all, training or validation, got {cfg.part!r}")
    if cfg.part != "all":
        if "split" not in cfg.data:
            raise UserError(f"part={cfg.part} needs a split, which data={data_choice()} does not have")
        training, validation = split_photos(photos, **cfg.data.split)
        photos = training if cfg.part == "training" else validation
    if cfg.limit is None:
        return photos
    return thin_photos(photos, whole_number("limit", cfg.limit, 1))


def protocol(
    cfg: DictConfig, device: torch.device, methods: Sequence[Method], photos: Sequence[Photo]
) -> dict[str, Any]:
    """What decides the numbers of a result, as plain values; paths below the shared data folder are cut to it."""
    root = cfg.data.photos.get("root")
    shared = Path(cfg.paths.shared)
    if root is not None and Path(root).is_relative_to(shared):
        root = Path(root).relative_to(shared).as_posix()
    stored = all(photo.low is not None for photo in photos)
    return {
        "data": data_choice(),
        "root": root,
        "part": cfg.part,
        "limit": cfg.limit,
        "size": plain_list(cfg.data.size) or None,
        **({"darkness": "as stored" if stored else plain(cfg.darkness)} if "darkness" in cfg else {}),
        "seed": cfg.seed,
        "device": device_name(device),
        "versions": versions(),
        "commit": git_commit(),
        "settings": {method.name: dict(method.settings) for method in methods},
        "weights_sha256": {method.name: method.sha256 for method in methods if method.sha256},
    }


def below_shared(value: Any, cfg: DictConfig) -> Any:
    """Plain values with paths below the shared data folder made relative to it."""
    root = str(Path(cfg.paths.shared))
    if isinstance(value, dict):
        return {key: below_shared(one, cfg) for key, one in value.items()}
    if isinstance(value, list):
        return [below_shared(one, cfg) for one in value]
    return value[len(root) + 1 :] if isinstance(value, str) and value.startswith(root + "/") else value


def data_choice() -> str:
    """The name of the chosen `data` group."""
    return HydraConfig.get().runtime.choices.data


def plain_list(value: Any) -> list[Any]:
    """A setting that may be one value, a list, or null, as a plain list."""
    if OmegaConf.is_config(value):
        value = OmegaConf.to_container(value, resolve=True)
    if value is None:
        return []
    return value if isinstance(value, list) else [value]
