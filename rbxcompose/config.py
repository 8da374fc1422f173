"""The base of every configuration: a closed pydantic model, quantities with units, names, places.

Inside, all is SI and ratios are 0 to 1. A field's docstring becomes its description for editors and the reference.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Annotated, Any, TypeVar, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    StringConstraints,
    WithJsonSchema,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from rbxcompose import units
from rbxcompose.dataclass import dataclass
from rbxcompose.field_docs import field_docs
from rbxcompose.references import JOINT, LINK, PLACE, Refers
from rbxcompose.units import Dimension, to_si


class Config(BaseModel):
    """A closed, frozen set of fields; a key that it does not declare is a finding."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        made = handler(schema)
        properties = handler.resolve_ref_schema(made).get("properties", {})
        for name, text in field_docs(cls).items():
            shown = properties.get(cls.model_fields[name].alias or name) if name in cls.model_fields else None
            if shown is not None:
                shown.setdefault("description", text)
        return made


C = TypeVar("C", bound=Config)


@dataclass(frozen=True, slots=True)
class Dimensioned:
    """Marks a field as a quantity, for findings and schemas."""

    dimension: Dimension


@dataclass(frozen=True, slots=True)
class Bound:
    """Limits of a setting beside those of its field, in SI, and what sets them."""

    least: float | None
    most: float | None
    by: str


@dataclass(frozen=True, slots=True)
class Live:
    """Marks a field that may change while the robot runs: `speed: Annotated[Speed, Live()] = 0.3`."""


def is_live(field: FieldInfo) -> bool:
    """Return whether a field may change while the robot runs."""
    return any(isinstance(mark, Live) for mark in field.metadata)


def leaves(config: Config) -> Iterator[tuple[str, FieldInfo]]:
    """Yield the fields that are no groups of fields themselves, each by its dotted name: `pid.p`."""
    for name, one in type(config).model_fields.items():
        if isinstance(value := getattr(config, name), Config):
            yield from ((f"{name}.{below}", field) for below, field in leaves(value))
        else:
            yield name, one


def value_at(config: Config, name: str) -> Any:
    """Return the value of a field by its dotted name."""
    return attrgetter(name)(config)


def key_of(config: Config, name: str) -> str:
    """Return what a manifest calls a field, by its dotted name."""
    head, _, below = name.partition(".")
    key = type(config).model_fields[head].alias or head
    return f"{key}.{key_of(getattr(config, head), below)}" if below else key


def with_values(config: C, values: Mapping[str, object]) -> C:
    """Return a configuration with other values of fields by their dotted names; they are not validated."""
    for name, value in values.items():
        head, _, below = name.partition(".")
        inner = with_values(getattr(config, head), {below: value}) if below else value
        config = config.model_copy(update={head: inner})
    return config


def live_names(model: type[Config], above: str = "") -> Iterator[str]:
    """Yield the dotted names of the fields of a model that may change while the robot runs, also within groups."""
    for name, one in model.model_fields.items():
        if is_live(one):
            yield f"{above}{name}"
        for hint in (one.annotation, *get_args(one.annotation)):
            if isinstance(hint, type) and issubclass(hint, Config):
                yield from live_names(hint, f"{above}{name}.")


def _reads(dimension: Dimension) -> BeforeValidator:
    def read(value: object) -> float:
        return to_si(value, dimension)

    shape = Annotated[Any, WithJsonSchema({"x-dimension": dimension.name})]
    return BeforeValidator(read, json_schema_input_type=shape)


Length = Annotated[float, _reads(units.LENGTH), Dimensioned(units.LENGTH)]
Time = Annotated[float, _reads(units.TIME), Dimensioned(units.TIME)]
Speed = Annotated[float, _reads(units.SPEED), Dimensioned(units.SPEED)]
Acceleration = Annotated[float, _reads(units.ACCELERATION), Dimensioned(units.ACCELERATION)]
Angle = Annotated[float, _reads(units.ANGLE), Dimensioned(units.ANGLE)]
AngularSpeed = Annotated[float, _reads(units.ANGULAR_SPEED), Dimensioned(units.ANGULAR_SPEED)]
AngularAcceleration = Annotated[float, _reads(units.ANGULAR_ACCELERATION), Dimensioned(units.ANGULAR_ACCELERATION)]
Jerk = Annotated[float, _reads(units.JERK), Dimensioned(units.JERK)]
AngularJerk = Annotated[float, _reads(units.ANGULAR_JERK), Dimensioned(units.ANGULAR_JERK)]
Frequency = Annotated[float, _reads(units.FREQUENCY), Dimensioned(units.FREQUENCY)]
Temperature = Annotated[float, _reads(units.TEMPERATURE), Dimensioned(units.TEMPERATURE)]
BitRate = Annotated[float, _reads(units.BIT_RATE), Dimensioned(units.BIT_RATE)]
Ratio = Annotated[float, _reads(units.RATIO), Dimensioned(units.RATIO)]

Name = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$", max_length=60)]


@dataclass(frozen=True, slots=True)
class Place:
    """A named pose in `map` [m, m, rad]."""

    name: str
    x: float
    y: float
    heading: float


class Secret:
    """Text that is never shown: it prints and dumps as `***`. `reveal()` returns it.

    `name` is its name in the manifest: `${secret.NAME}`.
    """

    __slots__ = ("_text", "name")

    def __init__(self, text: str, name: str = "") -> None:
        self._text = text
        self.name = name

    def reveal(self) -> str:
        """Return the text, to pass it to the device or service that needs it."""
        return self._text

    def __str__(self) -> str:
        return HIDDEN

    __repr__ = __str__

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Secret) and other._text == self._text

    def __hash__(self) -> int:
        return hash(self._text)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            _secret,
            serialization=core_schema.plain_serializer_function_ser_schema(str, when_used="json"),
            json_schema_input_schema=core_schema.str_schema(),
        )


HIDDEN = "***"


def _secret(value: object) -> Secret:
    if not isinstance(value, Secret):
        help_text = "write '${secret.NAME}', and put it into the file 'secrets/NAME'"
        raise PydanticCustomError("secret", "a secret does not belong in a manifest", {"help": help_text})
    return value


PlaceName = Annotated[Place, Refers(PLACE)]
"""A field that names one of the robot's `places` and holds the place itself."""
LinkName = Annotated[str, Refers(LINK)]
"""A field that names a link of the robot's body."""
JointName = Annotated[str, Refers(JOINT)]
"""A field that names a joint of the robot's body."""
