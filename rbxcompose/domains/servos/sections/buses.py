"""The section `buses`: the lines that servos are on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, WithJsonSchema

from rbxcompose.base.config import DEVICE_PORT, SERVO_BUS, Angle, BitRate, Config, Frequency, Refers, Time
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.devices.sections.devices import port_name, with_folder
from rbxcompose.domains.servos.bus import bus_type_names
from rbxcompose.domains.servos.controller import ControllerConfig, controller_type
from rbxcompose.domains.servos.models import share_of
from rbxcompose.domains.servos.sections.actuators import ActuatorModel, actuators
from rbxcompose.domains.servos.sections.controllers import controllers
from rbxcompose.domains.servos.sections.faults import buses_of_joints, faults_of
from rbxcompose.domains.servos.sections.joints import JointModel, effort_of, held_limits, joints, table_of
from rbxcompose.domains.servos.sections.safety import safety
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, SetScope, WantedComponent, Wiring
from rbxcompose.manifest.shapes import as_written
from rbxcompose.manifest.tree import KeyPath, at
from rbxcompose.manifest.validate import MISSING_KEY, not_a_choice

WATCHED = 4  # cycles that may be late before servos stop by themselves
BusTypeName = Annotated[str, WithJsonSchema({"type": "string", "enum": bus_type_names()})]


class TwinModel(Config):
    """What simulated servos measure."""

    noise: Angle = Field(0.0, ge=0)
    """Standard deviation of measured positions."""
    seed: int = 0
    """Another seed gives other noise, the same one gives the same."""


class BusOfServosModel(Config):
    """A line of servos, driven by a process of its own."""

    type: BusTypeName
    """What speaks on it."""
    port: Annotated[str, Refers(DEVICE_PORT), AfterValidator(with_folder)] = ""
    """The serial port, such as `/dev/ttyUSB0`, or `dev:NAME` of a device; simulated servos need none."""
    baud: BitRate = Field(1_000_000, gt=0)
    """Bits per second."""
    rate: Frequency = Field(100.0, gt=0, le=1000)
    """How often all joints are read and written."""
    fast: bool = False
    """Whether servos of protocol 2.0 answer together in one packet (fast sync read), which old firmware cannot."""
    watchdog: Time = Field(0.2, ge=0)
    """Silence after which servos stop by themselves, if their model can, and four cycles at least; 0 is never."""
    return_delay: Time | None = Field(None, ge=0, le=254 * 2e-6)
    """Pause of servos before each reply, which is written into them; without it theirs stays: 500 us as they are sold.
    """
    sim: Literal["ideal", "servo", "pty"] = "servo"
    """How true simulated servos are: `ideal` ones are at their goals at once, `servo` has motors; with `pty` they also
    answer by bytes on a pseudo-terminal, through the driver of real ones."""
    twin: TwinModel = TwinModel()
    """How what simulated servos measure differs from what is."""


def _is_known(reading: Reading[BusOfServosModel], name: str, model: BusOfServosModel) -> bool:
    if model.type in bus_type_names():
        return True
    path = ("buses", name, "type")
    span, node = reading.value(*path), at(reading.contents.root, path)
    reading.report.add(not_a_choice(span, "type", node, bus_type_names()))
    return False


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that drives the joints of each bus."""
    description, driven, servos = contents.of(body), contents.of(joints), contents.of(actuators)
    known, care = description.body if description else Body(""), contents.of(safety)
    places = buses_of_joints(contents)
    for name, bus in contents.of(buses).items():
        own = {joint: entry for joint, entry in driven.items() if places.get(joint) == name}
        led = {key: item for key, item in contents.of(controllers).items() if _is_led(item, own, servos, name)}
        used = {item.actuator: _servo(servos[item.actuator]) for entry in led.values() for item in entry.used}
        if not own and not used:
            continue
        config = {
            "name": name,
            "kind": bus.type,
            "port": port_name(contents, bus.port),
            "baud": round(bus.baud),
            **bus.model_dump(include={"rate", "fast", "return_delay"}),
            "watchdog": max(bus.watchdog, WATCHED / bus.rate) if bus.watchdog else 0.0,
            "twin": bus.sim if contents.is_simulated else "",
            **bus.twin.model_dump(),
            "faults": faults_of(contents, name),
            **care.model_dump(include={"on_start", "on_shutdown", "park_time", "start_speed", "thermal"}),
            "park": {joint: entry.value for joint, entry in care.park.items() if joint in own},
            "joints": {
                joint: _joint(known.joints.get(joint), entry, [servos[each] for each in entry.servos])
                for joint, entry in own.items()
            },
            "controllers": {
                key: {
                    "type": entry.type,
                    "settings": as_written(entry),
                    "sliding": [item for item in entry.claimed if item in known.joints and known.joints[item].slides],
                }
                for key, entry in led.items()
            },
            "used": used,
        }
        yield WantedComponent(name, "servo_bus", config, ("buses", name), places=_places(led))


def _places(led: Mapping[str, ControllerConfig]) -> dict[str, KeyPath]:
    """Return where the fields and the ports of controllers are written."""
    found: dict[str, KeyPath] = {f"controllers.{name}": ("controllers", name) for name in led}
    for name, config in led.items():
        cls = controller_type(config.type)
        for port in cls.ports(name, config):
            where = cls.topics[port].split(".") if port in cls.topics else ()
            found[f"{name}_{port}"] = ("controllers", name, *where)
    return found


def _is_led(
    config: ControllerConfig, joints: Mapping[str, JointModel], servos: Mapping[str, ActuatorModel], bus: str
) -> bool:
    """Return whether all that a controller leads and uses is on a bus."""
    places = [item.actuator in servos and servos[item.actuator].bus == bus for item in config.used]
    return set(config.claimed) <= joints.keys() and all(places) and bool(config.claimed or places)


def _servo(actuator: ActuatorModel) -> dict[str, object]:
    return actuator.model_dump(include={"id", "model", "neutral", "invert"})


def _joint(joint: BodyJoint | None, driven: JointModel, servos: list[ActuatorModel]) -> dict[str, object]:
    """Return how a joint is driven, within the limits of the body."""
    limits = held_limits(driven, joint)
    mimic = joint.mimic if joint else None
    return {
        "servos": [_servo(servo) | {"torque": min(servo.torque, _share(driven, servos, joint))} for servo in servos],
        "mode": servos[0].mode,
        "ratio": math.tau / driven.travel if driven.travel else driven.ratio,
        "offset": driven.offset,
        "calibration": table_of(driven),
        "is_continuous": joint is not None and joint.kind == "continuous",
        **{name: getattr(limits, name) for name in ("lower", "upper", "velocity", "acceleration")},
        "mimic": mimic.joint if mimic else "",
        "multiplier": mimic.multiplier if mimic else 1.0,
        "mimic_offset": mimic.offset if mimic else 0.0,
    }


def _share(driven: JointModel, servos: list[ActuatorModel], joint: BodyJoint | None) -> float:
    """Return the share of their torque that the effort of their joint leaves to servos; 0 in the body is none."""
    own, most = driven.limits.effort, effort_of(driven, servos)
    outer = joint.limits.effort if joint and joint.limits else None
    limits = [*([own.value] if own is not None else []), *([outer] if outer is not None and outer > 0.0 else [])]
    return share_of(min(limits), most) if limits and most is not None else 1.0


@section(
    "buses",
    BusOfServosModel,
    order=31,
    names=SERVO_BUS,
    runs=True,
    wires=True,
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
    read = reading.entries()
    found = {name: entry for name, entry in read.items() if _is_known(reading, name, entry)}
    for name, one in found.items():
        if not one.port and not reading.contents.is_simulated:
            span = reading.key("buses", name)
            reading.report.add(MISSING_KEY.at(span, f"the bus '{name}' of real servos needs the key 'port'"))
    return found
