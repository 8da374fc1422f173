"""Pure core: the text of an interface with those of all messages inside it, joined as in ROS 2 and MCAP."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from rbxcompose.msgs.definitions import FieldType

_SEPARATOR = "=" * 80


def parts(name: str, types_of: Callable[[str], Iterable[FieldType]]) -> list[str]:
    """Return the names of all messages inside an interface, each once, containers first.

    `types_of` maps the name of an interface to the types of its fields.
    """
    found: dict[str, None] = {}
    left = [name]
    while left:
        fresh = dict.fromkeys(type_.base for type_ in types_of(left.pop(0)) if type_.is_message)
        new = [one for one in fresh if one not in found]
        found.update(dict.fromkeys(new))
        left += new
    return list(found)


def joined(name: str, made_of: Iterable[str], text_of: Callable[[str], str]) -> str:
    """Return the text of an interface and those of all messages inside it, each below a line of `=`."""
    texts = [f"{_SEPARATOR}\nMSG: {short(one)}\n{text_of(one)}" for one in made_of]
    return "".join([text_of(name), *texts])


def short(name: str) -> str:
    """Return `geometry_msgs/Twist` for `geometry_msgs/msg/Twist`."""
    package, _, bare = name.split("/")
    return f"{package}/{bare}"
