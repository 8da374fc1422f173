"""The section `buses`: the lines that servos are on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Literal

from pydantic import Field

from rbxcompose.body.model import Body, BodyJoint
from rbxcompose.config import Angle, Config, Frequency
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, SetScope
from rbxcompose.manifest.tree import key_span
from rbxcompose.manifest.validate import MISSING_KEY
from rbxcompose.manifest.wanted_components import WantedComponent, Wiring
from rbxcompose.references import SERVO_BUS
from rbxcompose.sections.actuators import ActuatorModel, actuators
from rbxcompose.sections.body import body
from rbxcompose.sections.controllers import controllers
from rbxcompose.sections.faults import faults_of
from rbxcompose.sections.joints import JointModel, joints


class TwinModel(Config):
    """What simulated servos measure."""

    noise: Angle = Field(0.0, ge=0)
    """Standard deviation of measured positions."""
    seed: int = 0
    """Another seed gives other noise, the same one gives the same."""


class BusOfServosModel(Config):
    """A line of servos, driven by a process of its own."""

    type: Literal["dynamixel"]
    """What speaks on it."""
    port: str = ""
    """The serial port, such as `/dev/ttyUSB0`; simulated servos need none."""
    baud: int = Field(1_000_000, gt=0)
    """Bits per second."""
    rate: Frequency = Field(100.0, gt=0, le=1000)
    """How often all joints are read and written."""
    sim: Literal["ideal", "servo", "pty"] = "servo"
    """How true simulated servos are: `ideal` ones are at their goals at once, `servo` has motors; with `pty` they also
    answer by bytes on a pseudo-terminal, through the driver of real ones."""
    twin: TwinModel = TwinModel()
    """How what simulated servos measure differs from what is."""
    on_shutdown: Literal["relax", "hold"] = "relax"
    """What happens to torque when the robot goes down."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that drives the joints of each bus."""
    description, driven, servos = contents.of(body), contents.of(joints), contents.of(actuators)
    for name, bus in contents.of(buses).items():
        own = {joint: one for joint, one in driven.items() if (to := servos.get(one.actuator)) and to.bus == name}
        if not own:
            continue
        known = description.body if description else Body("")
        config = {
            "port": bus.port,
            "baud": bus.baud,
            "rate": bus.rate,
            "twin": bus.sim if contents.is_simulated else "",
            "noise": bus.twin.noise,
            "seed": bus.twin.seed,
            "faults": faults_of(contents, name),
            "on_shutdown": bus.on_shutdown,
            "joints": {joint: _joint(known.joints.get(joint), one, servos[one.actuator]) for joint, one in own.items()},
            "controllers": {
                controller: {"joints": list(one.joints)}
                for controller, one in contents.of(controllers).items()
                if set(one.joints) <= own.keys()
            },
        }
        yield WantedComponent(name, "servo_bus", config, ("buses", name))


def _joint(joint: BodyJoint | None, driven: JointModel, servo: ActuatorModel) -> Mapping[str, object]:
    """Return how a joint is driven, within the limits of the body."""
    least, greatest = driven.limits.position or (None, None)
    outer = joint.limits if joint else None
    is_bounded = outer is not None and joint is not None and joint.kind != "continuous"
    return {
        "id": servo.id,
        "model": servo.model,
        "neutral": servo.neutral,
        "invert": servo.invert,
        "lower": _tighter(max, outer.lower if outer and is_bounded else None, least),
        "upper": _tighter(min, outer.upper if outer and is_bounded else None, greatest),
        "velocity": _tighter(min, outer.velocity if outer else None, driven.limits.velocity),
        "acceleration": driven.limits.acceleration,
    }


def _tighter(pick: Callable[[float, float], float], outer: float | None, inner: float | None) -> float | None:
    return pick(outer, inner) if outer is not None and inner is not None else outer if inner is None else inner


@section(
    "buses",
    BusOfServosModel,
    order=31,
    names=SERVO_BUS,
    runs=True,
    entry="bus of servos",
    scope=SetScope.KEYS,
    components=_components,
)
def buses(reading: Reading[BusOfServosModel]) -> dict[str, BusOfServosModel]:
    """Lines of servos by name; each is driven by a process of its own.

    Example:
        buses:
          servos:
            type: dynamixel
            port: /dev/ttyUSB0
            rate: 100 Hz
    """
    found = reading.entries()
    for name, one in found.items():
        if not one.port and not reading.contents.is_simulated:
            span = key_span(reading.contents.root, ("buses", name))
            reading.report.add(MISSING_KEY.at(span, f"the bus '{name}' of real servos needs the key 'port'"))
    return found
