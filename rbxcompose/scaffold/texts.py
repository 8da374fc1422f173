"""Texts from templates. Jinja2 only writes new files; it never touches a manifest that is read."""

from __future__ import annotations

import json
import re
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from rbxcompose.config import Place
from rbxcompose.units import ANGLE, LENGTH, format_quantity

_PLAIN_TEXT = re.compile(r"[A-Za-z][A-Za-z0-9 ,.()/'-]*")
_WORDS = frozenset({"true", "false", "null"})


def render(template: str, **answers: object) -> str:
    """Return the text of a template of this package with the answers filled in.

    Raises:
        jinja2.UndefinedError: if the template names an answer that is not given.
    """
    return _ENVIRONMENT.get_template(template).render(answers)


def yaml_text(text: str) -> str:
    """Return a text as a YAML scalar of a Robot or Mission file: in quotes where needed, with dollars doubled."""
    text = text.replace("$", "$$")
    if _PLAIN_TEXT.fullmatch(text) and text.lower() not in _WORDS:
        return text
    return json.dumps(text, ensure_ascii=False)


def yaml_pose(place: Place) -> str:
    """Return a pose as written after the name of a place."""
    x, y = format_quantity(place.x, LENGTH), format_quantity(place.y, LENGTH)
    return f"{{x: {x}, y: {y}, heading: {format_quantity(place.heading, ANGLE)}}}"


def class_name(name: str) -> str:
    """Return a name in the style of Python classes."""
    return "".join(word.capitalize() for word in name.split("_"))


def _environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - it writes YAML and Python, which have no HTML to escape
    )
    made.filters |= {"yaml_text": yaml_text, "yaml_pose": yaml_pose, "class_name": class_name}
    return made


_ENVIRONMENT = _environment()
