"""Fields of messages by their path: `pose.position.x`."""

from __future__ import annotations

from collections.abc import Collection

from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldShape, FieldType, parse_type


class NoFieldError(Exception):
    """Raised when a message has no field of a name; `fields` are those of the message `message`."""

    def __init__(self, message: str, name: str, fields: Collection[str]) -> None:
        super().__init__(f"{message} has no field '{name}'")
        self.message = message
        self.name = name
        self.fields = fields


def field_type(message: str, path: str) -> FieldType:
    """Return the type of a field of a message; a field of a field is written with a dot.

    Raises:
        NoFieldError: if there is none.
    """
    first, *others = path.split(".")
    fields = registry.message(message).FIELDS
    if first not in fields:
        raise NoFieldError(message, first, fields)
    found = parse_type(fields[first])
    if not others:
        return found
    if not found.is_message or found.shape is not FieldShape.SINGLE:
        raise NoFieldError(str(found), others[0], ())
    return field_type(found.base, ".".join(others))
