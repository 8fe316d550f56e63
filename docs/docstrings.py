"""The house's docstrings as the reference's parser takes them: an argument a line, a paragraph for each short note."""

import re
from typing import Any

import griffe

_SECTION = re.compile(r"^(?:Args|Attributes):\n(?:(?: +.*)?\n?)*", re.M)
_JOINT = re.compile(r"^( +)(\w+(?:, \w+)+): (.*(?:\n\1 +.*)*)", re.M)
_NOTE = re.compile(r"^(Args|Returns|Raises|Source): (?=\S)", re.M)


class HouseStyle(griffe.Extension):
    """Rewrites every docstring before it is parsed."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring is not None:
            obj.docstring.value = notes_apart(one_line_each(obj.docstring.value))


def one_line_each(docstring: str) -> str:
    """The docstring with arguments that share a line (`points_a, points_b: ...`) repeated, each with its text."""

    def repeat(found: re.Match[str]) -> str:
        indent, names, text = found.groups()
        return "\n".join(f"{indent}{name}: {text}" for name in names.split(", "))

    return _SECTION.sub(lambda section: _JOINT.sub(repeat, section.group()), docstring)


def notes_apart(docstring: str) -> str:
    """The docstring with notes of one line (`Raises: UserError if ...`) as paragraphs, their names bold."""
    return _NOTE.sub(r"\n**\1:** ", docstring)
