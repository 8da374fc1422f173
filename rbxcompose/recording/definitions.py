"""The text of a message type with all that it is made of, as `ros2msg` schemas of MCAP have it."""

from __future__ import annotations

from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import INTERFACES, parse_type
from rbxcompose.msgs.types import Fields

_SEPARATOR = "=" * 80


def definition_of(name: str) -> str:
    """Return the text of a type (`nav_msgs/msg/Odometry`), then those of the types in it, each below a line of `=`.

    It is empty for a type of which we have no definition.
    """
    try:
        types = _with_parts(name)
    except KeyError:
        return ""
    first, *rest = types.items()
    parts = [f"{_SEPARATOR}\nMSG: {_short(one)}\n{_text(one, fields)}" for one, fields in rest]
    return "".join([_text(*first), *parts])


def _with_parts(name: str) -> dict[str, Fields]:
    """Return the fields of a type and of all types that it is made of."""
    found: dict[str, Fields] = {}
    todo = [name]
    while todo:
        one = todo.pop(0)
        if one not in found:
            found[one] = registry.message(one).FIELDS
            types = [parse_type(text) for text in found[one].values()]
            todo += [type_.base for type_ in types if type_.is_message]
    return found


def _text(name: str, fields: Fields) -> str:
    package, kind, bare = name.split("/")
    written = INTERFACES / package / kind / f"{bare}.{kind}"
    if kind == "msg" and written.is_file():
        return written.read_text(encoding="utf-8")
    # A part of an action, or a type of somebody else's package: what counts is in the fields.
    return "".join(f"{_short_type(type_)} {field}\n" for field, type_ in fields.items())


def _short_type(text: str) -> str:
    base = parse_type(text).base
    return text.replace(base, _short(base), 1) if "/" in base else text


def _short(name: str) -> str:
    package, _, bare = name.split("/")
    return f"{package}/{bare}"
