"""The text of a message type with all types that it uses, as `ros2msg` schemas of MCAP have it."""

from __future__ import annotations

from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import INTERFACES, FieldType, parse_type
from rbxcompose.msgs.joined import joined, parts, short


def definition_of(name: str) -> str:
    """Return the text of a type (`nav_msgs/msg/Odometry`), then those of the types in it, each below a line of `=`.

    It is empty for a type of which we have no definition.
    """
    try:
        return joined(name, parts(name, _types), _text)
    except KeyError:
        return ""


def _types(name: str) -> list[FieldType]:
    return [parse_type(text) for text in registry.message(name).FIELDS.values()]


def _text(name: str) -> str:
    package, kind, bare = name.split("/")
    written = INTERFACES / package / kind / f"{bare}.{kind}"
    if kind == "msg" and written.is_file():
        return written.read_text(encoding="utf-8")
    # A part of an action, or a type of somebody else's package: what counts is in the fields.
    return "".join(f"{_short_type(type_)} {field}\n" for field, type_ in registry.message(name).FIELDS.items())


def _short_type(text: str) -> str:
    base = parse_type(text).base
    return text.replace(base, short(base), 1) if "/" in base else text
