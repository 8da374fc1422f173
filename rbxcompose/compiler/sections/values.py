"""Sections that give names: to poses, and to data."""

from collections.abc import Mapping
from functools import partial
from typing import Annotated, cast

from pydantic import AfterValidator, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import PLACE, VALUE, Angle, Config, Length, Place
from rbxcompose.base.expressions.types import TYPES
from rbxcompose.base.units import UNITS, unit_named
from rbxcompose.manifest.fields import FieldPath, PortName, TopicName
from rbxcompose.manifest.foreign_words import MESSAGES
from rbxcompose.manifest.foreign_words import TYPES as TYPES_OF_OTHERS
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading, Short


class PlaceModel(Config):
    """A named pose in `map`."""

    x: Length
    """Position along x."""
    y: Length
    """Position along y."""
    heading: Angle = 0.0
    """Direction, measured from x towards y: 90 deg is along y."""
    colour: str = ""
    """How viewers draw it."""


def _coordinates(read: Mapping[str, Place]) -> dict[str, str]:
    return {name: f"({place.x:g} m, {place.y:g} m)" for name, place in read.items()}


def unknown_place(name: str) -> Place:
    """Return what stands for a place that could not be read."""
    return Place(name, 0.0, 0.0, 0.0)


@section("places", PlaceModel, order=70, names=PLACE, entry="place", stand_in=unknown_place, details=_coordinates)
def places(reading: Reading[PlaceModel]) -> dict[str, Place]:
    """Places by name: poses in `map`, to which missions refer. A robot in a `world` has the places of that, too.

    Example:
        places:
          window: {x: 2 m, y: -50 cm, heading: 90 deg, colour: blue}
    """
    found = cast("dict[str, Place]", reading.contents.brought(PLACE))
    for name, entry in reading.named():
        # A place with mistakes becomes the origin, so that references to it are not wrong as well.
        read = reading.valid(PlaceModel, name, entry.value) or PlaceModel(x=0.0, y=0.0)
        found[name] = Place(name, read.x, read.y, read.heading, read.colour)
    return found


_PLAIN = ("number", "count", "text", "flag")  # the first to be proposed


def _known(what: str, valid: tuple[str, ...], name: str) -> str:
    if name not in valid:
        if (meant := MESSAGES.get(name.rpartition("/")[-1])) in valid:
            help_text = {"name": name, "help": f"write '{meant}': it is what the field of the message holds"}
            raise PydanticCustomError(what, f"there is no {what} '{{name}}'", help_text)
        unit = unit_named(name)
        ours = TYPES_OF_OTHERS.get(name.lower()) if what == "type" else unit and unit.name
        if ours in valid:
            help_text = {"name": name, "help": f"did you mean '{ours}'?"}
            raise PydanticCustomError(what, f"there is no {what} '{{name}}'", help_text)
        context = {"name": name, "valid": valid, "what": f"{what}s"}
        raise PydanticCustomError(what, f"there is no {what} '{{name}}'", context)
    return name


class ValueModel(Config):
    """A short name for data that missions read: `port` of a component, or `topic` and `field` from outside."""

    port: PortName | None = None
    """`component.port`."""
    topic: TopicName | None = None
    """Topic of data from outside."""
    field: FieldPath | None = None
    """Field of its message; without it, `data`."""
    type: Annotated[str, AfterValidator(partial(_known, "type", (*_PLAIN, *TYPES)))] | None = None
    """Its type: a dimension, `number`, `text`, `flag`, ..."""
    unit: Annotated[str, AfterValidator(partial(_known, "unit", tuple(UNITS)))] | None = None
    """Unit of the message, if it differs from that of the type."""
    event: bool | None = None
    """Whether each message is an event: a condition that waits counts it only if it came since its node began, and no
    mission waits for it before it begins. Else the last message counts, however old.
    """

    @field_validator("topic")
    @classmethod
    def _one_source(cls, topic: str | None, info: ValidationInfo) -> str | None:
        if topic is not None and info.data.get("port") is not None:
            raise ValueError("stands beside 'port': a value comes from one of them, so remove the other")
        return topic


@section("values", ValueModel, order=80, names=VALUE, entry="value", short=Short("port", is_merged=False))
def values(reading: Reading[ValueModel]) -> dict[str, ValueModel]:
    """Short names for data that missions read by `$NAME`.

    Example:
        values:
          battery: battery.battery_level
          door:
            topic: door/state
            type: text
          confirmed:
            topic: button
            type: flag
            event: true
    """
    return reading.readable_entries()
