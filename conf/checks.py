"""Is a configuration that was put together what its command understands? Checked before anything runs."""

import difflib
from typing import Any

from omegaconf import DictConfig, OmegaConf

from diffnav.errors import UserError


def refuse_misfits(cfg: DictConfig, defaults: DictConfig) -> None:
    """Raise UserError for a setting that is missing, does not exist, or is of another kind than its default."""
    known = _settings(OmegaConf.to_container(defaults))
    # What is null unless given may be given as names of one's own.
    free = tuple(f"{key}." for key, value in known.items() if value is None)
    for key, value in _settings(OmegaConf.to_container(cfg)).items():
        if key.startswith(free):
            continue
        if key not in known:
            near = [one for one in known if one.startswith(f"{key}.")] or difflib.get_close_matches(key, known, 1)
            raise UserError(f"there is no setting {key}" + (f"; did you mean {' or '.join(near)}?" if near else ""))
        if value == "???":
            raise UserError(f"the setting {key} is missing: add {key}=...")
        default = known[key]
        if isinstance(default, list) and default and isinstance(value, list):
            wrong = next((one for one in value if not _fits(one, default[0])), None)
        else:
            wrong = None if _fits(value, default) else value
        if wrong is not None:
            raise UserError(f"{key} cannot be {wrong!r}; it is {default} unless given")


def _settings(tree: Any, prefix: str = "") -> dict[str, Any]:
    """Every setting under its dotted name, references not followed."""
    found: dict[str, Any] = {}
    for key, value in tree.items():
        found |= _settings(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return found


def _fits(value: Any, default: Any) -> bool:
    """Whether a value may stand where a number or a switch is the default; everything else is left to its user."""
    if value is None or not isinstance(default, (bool, int, float)):
        return True
    if isinstance(default, bool) or isinstance(value, bool):
        return isinstance(default, bool) and isinstance(value, bool)
    return isinstance(value, int) or (isinstance(default, float) and isinstance(value, float))
