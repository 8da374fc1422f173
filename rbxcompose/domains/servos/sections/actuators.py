"""The section `actuators`: the servos, by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import Field

from rbxcompose.base.config import ACTUATOR, SERVO_BUS, Config, Name, Ratio, Refers
from rbxcompose.base.findings import Finding, Related, kind
from rbxcompose.domains.servos.bus import DYNAMIXEL, BusType, bus_type, bus_type_names
from rbxcompose.domains.servos.models import ServoModel
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.manifest.tree import ScalarNode, at

NO_MODEL = kind("RBX2213", is_fixable=True)
ONE_ID = kind("RBX2214")


class ActuatorModel(Config):
    """A servo on a bus."""

    bus: Annotated[Name, Refers(SERVO_BUS)]
    """The bus that it is on."""
    model: str
    """Its model, such as `AX-12`, `MX-28(2.0)` or `XL430-W250`."""
    id: int = Field(ge=0, le=252)
    """Its id on the bus."""
    neutral: int | None = None
    """The tick at which its joint is at 0; without it the middle of its range."""
    invert: bool = False
    """Whether it turns the other way round than its joint."""
    mode: Literal["position", "velocity"] = "position"
    """Whether it is given positions, or velocities as a wheel or a spindle is."""
    torque: Ratio = Field(1.0, gt=0, le=1)
    """Share of its most torque that it may use, such as `60 %`; with less it is slower, too."""


def _details(read: Mapping[str, ActuatorModel]) -> dict[str, str]:
    return {name: f"{one.model}, id {one.id} on {one.bus}" for name, one in read.items()}


@section("actuators", ActuatorModel, order=32, names=ACTUATOR, entry="actuator", wires=True, details=_details)
def actuators(reading: Reading[ActuatorModel]) -> dict[str, ActuatorModel]:
    """The servos by name: on which bus, of which model, with which id.

    Example:
        buses:
          servos:
            type: dynamixel
        actuators:
          pan_servo:
            bus: servos
            model: AX-12
            id: 1
            neutral: 512                  # the tick at which the joint is at 0
    """
    found = reading.entries()
    reading.report.extend([*_models(reading, found), *_ids(reading, found)])
    return {name: entry for name, entry in found.items() if model_of(reading.contents, entry) is not None}


def type_of(contents: Contents, bus: str) -> BusType:
    """Return the type of a bus as it is written; one that is not known is reported where it stands."""
    written = at(contents.root, ("buses", bus, "type"))
    name = written.text if isinstance(written, ScalarNode) else ""
    return bus_type(name if name in bus_type_names() else DYNAMIXEL)


def model_of(contents: Contents, actuator: ActuatorModel) -> ServoModel | None:
    """Return the model of a servo, None if its bus knows none of that name."""
    return type_of(contents, actuator.bus).model(actuator.model)


def _models(reading: Reading[ActuatorModel], found: Mapping[str, ActuatorModel]) -> Iterator[Finding]:
    for name, actuator in found.items():
        if model_of(reading.contents, actuator) is None:
            known = type_of(reading.contents, actuator.bus).models()
            span = reading.value("actuators", name, "model")
            yield NO_MODEL.misspelt(span, f"no servo is called '{actuator.model}'", actuator.model, known, "models")


def _ids(reading: Reading[ActuatorModel], found: Mapping[str, ActuatorModel]) -> Iterator[Finding]:
    first: dict[tuple[str, int], str] = {}
    for name, model in found.items():
        if (before := first.setdefault((model.bus, model.id), name)) != name:
            span, other = (reading.value("actuators", each, "id") for each in (name, before))
            if span == other:  # by '<<', one has the keys of the other
                span = reading.key("actuators", name)
            message = f"two servos of the bus '{model.bus}' have the id {model.id}"
            taken = {each.id for each in found.values() if each.bus == model.bus}
            free = next((number for number in range(1, 253) if number not in taken), None)
            help_text = f"{free} is free" if free is not None else ""
            yield ONE_ID.at(span, message, help=help_text, related=[Related(other, "the other one")])
