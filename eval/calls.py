"""The kit's own commands, called as a user would call them."""

import json
import shlex
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

from diffnav.errors import UserError


def call(module: str, settings: Mapping[str, Any]) -> str:
    """Run `python -m MODULE key=value ...` with its output shown; the command line as a user would type it.

    Strings and lists of strings are quoted for Hydra, other values are written as they are.

    Raises: UserError if it fails; it has said why itself.
    """
    arguments = [f"{key}={_quoted(value)}" for key, value in settings.items()]
    line = shlex.join(["python", "-m", module, *arguments])
    print(f"\n$ {line}", flush=True)
    if subprocess.run([sys.executable, "-m", module, *arguments]).returncode:
        raise UserError(f"this command failed, see above: {line}")
    return line


def _quoted(value: Any) -> str:
    if isinstance(value, list):
        return f"[{','.join(_quoted(item) for item in value)}]"
    plain = not isinstance(value, str) or value.replace("_", "").replace("-", "").isalnum()
    return str(value) if plain else json.dumps(value)
