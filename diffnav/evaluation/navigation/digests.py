"""Hashes of what decides an answer: a query with all that is known of it, the code that makes it, a map."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from datetime import datetime
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from torch import Tensor

from diffnav.data.maps.geo_map import GeoMap
from diffnav.data.queries.query import Query
from diffnav.evaluation.fingerprints import fingerprint


def query_digest(query: Query) -> str:
    """A hash of a query: the content of its file, or what a made picture is drawn from and by which code; its facts."""
    makers = {type(query).__module__}
    if isinstance(query.image, partial):
        makers.add(query.image.func.__module__)
    return _hashed([_plain(query), code_digest(frozenset(makers))])


def map_digest(geo_map: GeoMap) -> str:
    """A hash of a map: its name, its picture's content and where its pixels lie."""
    return _hashed(_plain(geo_map))


@cache
def code_digest(modules: frozenset[str]) -> str:
    """A hash of the code of these modules, of all in this package that they draw from, and of the libraries."""
    return fingerprint({}, modules)


def _hashed(facts: Any) -> str:
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """A value as JSON has it, files by their content; equal values give equal ones, in any process."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Path):
        return _of_file(value)
    if isinstance(value, Tensor | np.ndarray):
        return [str(value.dtype), value.tolist()]
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, Sequence):
        return [_plain(one) for one in value]
    return _of_object(value)


def _of_object(value: Any) -> Any:
    if isinstance(value, GeoMap):
        # How it is read follows from its content.
        return ["map", value.name, value.fingerprint, _plain(value.georeference)]
    if isinstance(value, partial):
        return [_plain(value.func), _plain(value.args), _plain(value.keywords)]
    if is_dataclass(value):
        return [_name(type(value)), {one.name: _plain(getattr(value, one.name)) for one in fields(value)}]
    if callable(value) and "<" not in getattr(value, "__qualname__", "<"):
        return _name(value)
    # Of what nothing is known no two are equal: it is asked anew.
    return [_name(type(value)), repr(value)]


def _name(value: Callable[..., Any]) -> str:
    return f"{value.__module__}.{value.__qualname__}"


def _of_file(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "unreadable"
