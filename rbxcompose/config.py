"""What every configuration is made of: a closed pydantic model, quantities with units, names, places.

Inside, all is SI and ratios are 0 to 1. A field's docstring becomes its description for editors and the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, StringConstraints, ValidationInfo
from pydantic_core import PydanticCustomError

from rbxcompose import units
from rbxcompose.findings import suggest
from rbxcompose.units import Dimension, to_si


class Config(BaseModel):
    """A closed, frozen set of fields; a key that it does not declare is a finding."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


@dataclass(frozen=True, slots=True)
class Dimensioned:
    """Marks a field as a quantity, for findings and schemas."""

    dimension: Dimension


def _reads(dimension: Dimension) -> BeforeValidator:
    def read(value: object) -> float:
        return to_si(value, dimension)

    return BeforeValidator(read)


Length = Annotated[float, _reads(units.LENGTH), Dimensioned(units.LENGTH)]
Time = Annotated[float, _reads(units.TIME), Dimensioned(units.TIME)]
Speed = Annotated[float, _reads(units.SPEED), Dimensioned(units.SPEED)]
Acceleration = Annotated[float, _reads(units.ACCELERATION), Dimensioned(units.ACCELERATION)]
Angle = Annotated[float, _reads(units.ANGLE), Dimensioned(units.ANGLE)]
AngularSpeed = Annotated[float, _reads(units.ANGULAR_SPEED), Dimensioned(units.ANGULAR_SPEED)]
AngularAcceleration = Annotated[float, _reads(units.ANGULAR_ACCELERATION), Dimensioned(units.ANGULAR_ACCELERATION)]
Frequency = Annotated[float, _reads(units.FREQUENCY), Dimensioned(units.FREQUENCY)]
Ratio = Annotated[float, _reads(units.RATIO), Dimensioned(units.RATIO)]

Name = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$", max_length=60)]


@dataclass(frozen=True, slots=True)
class Place:
    """A named pose in `map` [m, m, rad]."""

    name: str
    x: float
    y: float
    heading: float


def _place(value: object, info: ValidationInfo) -> Place:
    places: Mapping[str, Place] = (info.context or {}).get("places", {})
    if isinstance(value, Place):
        return value
    if not isinstance(value, str):
        raise PydanticCustomError("place", "must be the name of a place")
    if value not in places:
        help_text = suggest(value, places, "places of this robot")
        raise PydanticCustomError("place", "there is no place '{name}'", {"name": value, "help": help_text})
    return places[value]


PlaceName = Annotated[Place, BeforeValidator(_place)]
"""A field that names one of the robot's `places` and holds the place itself."""
