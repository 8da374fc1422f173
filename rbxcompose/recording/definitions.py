"""The text of a message type with all types that it uses, in the format of MCAP's `ros2msg` schemas."""

from __future__ import annotations

from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import INTERFACES, FieldType, parse_type
from rbxcompose.msgs.packages import joined, parts, short


def definition_of(name: str) -> str:
    """Return the text of a type (`nav_msgs/msg/Odometry`), then those of the types in it, each below a line of `=`.

    It is empty for a type without a known definition.
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
    # A part of an action, or a type of another package: its fields are what counts.
    return "".join(f"{_short_type(type_)} {field}\n" for field, type_ in registry.message(name).FIELDS.items())


def _short_type(text: str) -> str:
    base = parse_type(text).base
    return text.replace(base, short(base), 1) if "/" in base else text
