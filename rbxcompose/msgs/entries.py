"""Two parallel arrays of a message, of names and of values, as a map."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.dataclass import dataclass
from rbxcompose.msgs.types import Message
from rbxcompose.units import Dimension

_NAMES, _VALUES = ("string[]",), ("float32[]", "float64[]")


@dataclass(frozen=True, slots=True)
class ArrayEntries:
    """Arguments of a skill that are entries of two arrays: a name, and a number in SI.

    `names` and `values` are the fields, `each` is what is measured by each name. An argument may be left out, but one
    of them must be given, or the field `instead`. A field of the message with the name of an entry takes precedence.
    """

    names: str
    values: str
    each: Mapping[str, Dimension]
    instead: str = ""

    def require_in(self, message: type[Message]) -> None:
        """Do nothing if a message has these arrays.

        Raises:
            ValueError: if it has not.
        """
        for field, types in ((self.names, _NAMES), (self.values, _VALUES)):
            if message.FIELDS.get(field) not in types:
                raise ValueError(f"{message.TYPE} has no field '{field}' of type {' or '.join(types)}")

    def arrays(self, given: Mapping[str, object]) -> dict[str, object]:
        """Return both fields with the entries that are given, in their order."""
        return {self.names: tuple(given), self.values: tuple(given.values())}
