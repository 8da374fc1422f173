"""Fields that refer to something in the robot by name: the kind of name they take, and whether it exists.

A section of the manifest defines the names of a kind. A field says that it takes one by its type:
`joint: Annotated[Name, Refers("joint")]`. Renaming of parts, completion, definitions and schemas all derive from that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from rbxcompose.dataclass import dataclass

COMPONENT, PLACE, VALUE, MISSION = "component", "place", "value", "mission"
ANALYZER, ARGUMENT, INSTANCE = "analyzer", "argument", "instance"
PORT = "port"
"""A component, or `component.port`."""
LINK, JOINT = "link", "joint"
"""A link or a joint of the body."""
SERVO_BUS, ACTUATOR, CONTROLLER = "servo bus", "actuator", "controller"
ARM, OBJECT = "arm", "object"
FAULT = "fault"
DEVICE, DEVICE_PORT = "device", "device port"
"""A device; its port, `dev:NAME`, in a field that takes paths, too."""
RUNNING = "running"
"""All components: those of the user and those of every robot."""
TOPIC, FILE, ANYTHING = "topic", "file", "anything"
"""A topic; a path relative to the file that writes it; a word that may be a name of any kind."""

PREFIXED: Mapping[str, tuple[str, str]] = {DEVICE_PORT: ("dev:", DEVICE)}
"""Kinds of words that are a name behind a prefix, or something else: the prefix, and the kind of the name."""

NAMES = "x-names"
"""The schema keyword that gives the kind of a name."""
_HIDDEN = (TOPIC, ANYTHING)  # kinds whose names editors do not know

Known = Mapping[str, Mapping[str, object]]
"""The context of a validation: kind of name -> name -> its meaning."""
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Refers:
    """Marks a field that takes the name of something; `kind` is the kind of thing it names.

    A name that does not exist is a finding if the validation context knows the names of that kind, unless a check
    reports it in more detail (`is_told`). A field that is not text holds the thing named.
    """

    kind: str
    is_told: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        if self.is_told:
            return handler(source)
        if isinstance(source, type) and not issubclass(source, str):
            word = core_schema.str_schema()
            return core_schema.with_info_before_validator_function(
                self._thing(source), core_schema.is_instance_schema(source), json_schema_input_schema=word
            )
        return core_schema.with_info_after_validator_function(self._name, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        made = handler(schema)
        return made if self.kind in _HIDDEN else {**made, NAMES: self.kind}

    def _name(self, name: str, info: ValidationInfo) -> str:
        """Return the name if it exists."""
        known: Known = info.context or {}
        prefix, kind = PREFIXED.get(self.kind, ("", self.kind))
        if name.startswith(prefix) and kind in known and name.removeprefix(prefix) not in known[kind]:
            raise self._unknown(name, {f"{prefix}{one}": one for one in known[kind]} if prefix else known[kind])
        return name

    def _thing(self, wanted: type[T]) -> Callable[[object, ValidationInfo], object]:
        """Return the function that replaces a name with the thing it names."""

        def find(value: object, info: ValidationInfo) -> object:
            if isinstance(value, wanted):
                return value
            if not isinstance(value, str):
                raise PydanticCustomError(self.kind, "must be the name of a {kind}", {"kind": self.kind})
            there = (info.context or {}).get(self.kind, {})
            if value not in there:
                raise self._unknown(value, there)
            return there[value]

        return find

    def _unknown(self, name: str, there: Mapping[str, object]) -> PydanticCustomError:
        valid = there if self.kind in (LINK, JOINT) else list(there)  # theirs are known, others may be being read
        prefix, kind = PREFIXED.get(self.kind, ("", self.kind))
        context: dict[str, object] = {"kind": kind, "name": name}
        if prefix and not there:
            own = name.removeprefix(prefix)
            context["help"] = f"add '{own}' below '{plural(kind)}', or write a path such as '/dev/ttyUSB0'"
        else:
            context |= {"valid": valid, "what": f"{plural(kind)} of this robot"}
        return PydanticCustomError(self.kind, "there is no {kind} '{name}'", context)


def plural(kind: str) -> str:
    """Return the plural of a kind."""
    return f"{kind}{'es' if kind.endswith(('s', 'x', 'ch')) else 's'}"
