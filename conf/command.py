"""From the command line to a checked configuration; a user's mistake becomes one sentence and exit code 2."""

import difflib
import functools
import os
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import hydra
import torch
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, OverrideParseException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from conf.checks import refuse_misfits
from diffnav.errors import UserError

CONF = Path(__file__).parent
# Commands write where `run=` and `out=` say: no folder, no log file of Hydra's own.
QUIET = [
    "hydra/job_logging=disabled",
    "hydra/hydra_logging=disabled",
    "hydra.output_subdir=null",
    "hydra.run.dir=.",
    "hydra.sweep.dir=.",
    "hydra.sweep.subdir=.",
]


def command(name: str) -> Callable[[Callable[[DictConfig], Any]], Callable[[], None]]:
    """Make `main(cfg)` a command that is configured by conf/NAME.yaml and `key=value` arguments.

    Unknown settings fail. UserError, Hydra's own complaints and Ctrl-C end with one sentence on standard error.
    """

    def decorate(main: Callable[[DictConfig], Any]) -> Callable[[], None]:
        @functools.wraps(main)
        def job(cfg: DictConfig) -> Any:
            try:
                refuse_misfits(cfg, _defaults(name))
                return main(cfg)
            except Exception as error:
                # Hydra's own handling of a job's exception prints more than the sentence.
                _leave(error)

        hydra_main = hydra.main(version_base="1.3", config_path=str(CONF), config_name=name)(job)

        def run() -> None:
            # Otherwise Hydra catches configuration errors itself and prints a hint at this very variable.
            os.environ["HYDRA_FULL_ERROR"] = "1"
            sys.argv[1:1] = QUIET
            try:
                hydra_main()
            except KeyboardInterrupt:
                sys.exit("interrupted")
            except BrokenPipeError:
                # The reader of our output went away (`| head`); Python would complain again when it flushes.
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                sys.exit(1)
            except Exception as error:
                _leave(error)

        return run

    return decorate


def plain(cfg: DictConfig) -> dict[str, Any]:
    """The resolved configuration as plain nested values."""
    return OmegaConf.to_container(cfg, resolve=True, throw_on_missing=True)  # type: ignore[return-value]


def pick_device(name: str) -> torch.device:
    """The device that `device=auto|cpu|cuda` means. Raises: UserError."""
    if name not in ("auto", "cpu", "cuda"):
        raise UserError(f"device must be auto, cpu or cuda, got {name!r}")
    if name == "cuda" and not torch.cuda.is_available():
        raise UserError("device=cuda, but torch sees no CUDA device; use device=cpu or install a CUDA build of torch")
    return torch.device("cuda" if name != "cpu" and torch.cuda.is_available() else "cpu")


def is_bf16(precision: str) -> bool:
    """Whether `precision=float32|bf16` means bf16. Raises: UserError."""
    if precision not in ("float32", "bf16"):
        raise UserError(f"precision must be float32 or bf16, got {precision!r}")
    return precision == "bf16"


def picture_size(key: str, value: Any) -> tuple[int, int] | None:
    """The (h, w) that the setting `key` means, None for null. Raises: UserError."""
    if value is None:
        return None
    sides = list(value) if isinstance(value, Sequence) else []
    if len(sides) != 2 or any(type(side) is not int or side < 16 for side in sides):
        raise UserError(f"{key} must be [height, width], each 16 or more, or null; got {value}")
    return sides[0], sides[1]


def whole_number(key: str, value: Any, least: int) -> int:
    """The value of the setting `key`. Raises: UserError if it is no whole number from `least` on."""
    if type(value) is not int or value < least:
        raise UserError(f"{key} must be a whole number of {least} or more, got {value!r}")
    return value


def choices(group: str) -> list[str]:
    """The names that exist in a group of configurations."""
    return sorted(path.stem for path in (CONF / group).glob("*.yaml"))


def choice(group: str, name: str, overrides: DictConfig | None = None) -> DictConfig:
    """conf/GROUP/NAME.yaml, with overrides of settings that it has. Raises: UserError, listing what exists."""
    if name not in choices(group):
        raise UserError(f"unknown {group} {name!r}; there are {', '.join(choices(group))}")
    cfg = OmegaConf.load(CONF / group / f"{name}.yaml")
    for key in overrides or {}:
        if key not in cfg or key == "_target_":
            known = ", ".join(str(setting) for setting in cfg if setting != "_target_") or "none"
            raise UserError(f"{group} {name} has no setting {key}; its settings: {known}")
    return OmegaConf.merge(cfg, overrides or {})  # type: ignore[return-value]


def photos_of(cfg: DictConfig) -> DictConfig:
    """What `data` says of its photos. Raises: UserError where it is a driving set, which has pairs of cameras."""
    if "photos" not in cfg.data:
        name = HydraConfig.get().runtime.choices.data
        others = [one for one in choices("data") if "photos" in OmegaConf.load(CONF / "data" / f"{one}.yaml")]
        raise UserError(f"data={name} is a driving set, which eval.driving takes; choose one of {', '.join(others)}")
    return cfg.data.photos


def _defaults(name: str) -> DictConfig:
    """conf/NAME.yaml with the groups that the command line chose, and nothing else of it."""
    given = HydraConfig.get().overrides.task
    return hydra.compose(name, [one for one in given if (CONF / one.lstrip("+").split("=")[0].split("@")[0]).is_dir()])


def _leave(error: Exception) -> None:
    """Print one sentence and exit, or let a programming error through with its traceback."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, UserError):
            print(f"error: {cause}", file=sys.stderr)
            sys.exit(2)
        cause = cause.__cause__ or cause.__context__
    if isinstance(error, (HydraException, OmegaConfBaseException)):
        print(f"error: {_sentence(error)}", file=sys.stderr)
        sys.exit(2)
    raise error


def _sentence(error: Exception) -> str:
    """Hydra's complaint in one sentence, with the nearest existing setting."""
    text = str(error)
    unknown = re.search(r"Could not override '([^']+)'", text) or re.search(r"Key '([^']+)' is not in struct", text)
    if unknown:
        key = unknown.group(1)
        near = difflib.get_close_matches(key, _known_settings(), 1)
        hint = f"; did you mean {near[0]}?" if near else "; --cfg job shows the settings that exist"
        return f"there is no setting {key}{hint}"
    missing = re.search(r"Could not find '([^']+)'\s+Available options in '([^']+)':\s+(.*?)\n\s*Config", text, re.S)
    if missing:
        wanted, group, names = missing.groups()
        return f"unknown {wanted.replace('/', '=')}; {group} can be {', '.join(names.split())}"
    unchosen = re.search(r"You must specify '([^']+)'.*Available options:\s+(.*)", text, re.S)
    if unchosen:
        group, names = unchosen.groups()
        return f"the setting {group} is missing: add {' or '.join(f'{group}={name}' for name in names.split())}"
    mandatory = re.search(r"Missing mandatory value: (\S+)", text)
    if mandatory:
        return f"the setting {mandatory.group(1)} is missing: add {mandatory.group(1)}=..."
    called = re.search(r"Error in call to target '([^']+)':\s*(.*)", text, re.S)
    if called:
        target, reason = called.groups()
        return f"a setting of {target.rsplit('.', 1)[-1]} has a value that it cannot take: {reason.splitlines()[0]}"
    line = " ".join(text.split("\n")[0].split())
    if text.startswith("Ambiguous value"):
        return f"{line}; write key=[a,b] for a list, or quote a value with commas twice: 'key=\"a, b\"'"
    if isinstance(error, OverrideParseException):
        return f"{line}; quote a value with spaces, commas or = twice: 'key=\"a b, c=d\"'"
    return line


def _known_settings() -> list[str]:
    if not HydraConfig.initialized():
        texts = [path.read_text() for path in CONF.rglob("*.yaml")]
        names = {match.group(1) for text in texts for match in re.finditer(r"^\s*(\w+):", text, re.M)}
        groups = {path.parent.relative_to(CONF).as_posix() for path in CONF.rglob("*/*.yaml")}
        return sorted(names | groups | {f"{g}.{n}" for g in groups for n in names})
    return []
