"""The manifest of a robot of ArbotiX."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.importing.arbotix.controllers import DiffController, FollowController
from rbxcompose.importing.arbotix.grippers import ArbotixGripper
from rbxcompose.importing.arbotix.robot import USUAL_PORT, ArbotixRobot, ServoLine
from rbxcompose.importing.arbotix.servo_joints import ArbotixJoint, turns
from rbxcompose.importing.manifest_text import (
    WIDEST,
    Row,
    flag,
    flow,
    flow_list,
    key,
    number,
    place,
    places,
    quantity,
    row,
    section,
    word,
)
from rbxcompose.importing.names import FreeNames
from rbxcompose.printable import plain

_UNITS = {"base_width": " m", "rate": " Hz"}


class ArbotixManifest:
    """Writes the sections of a robot; names that manifests cannot have are changed."""

    def __init__(self, robot: ArbotixRobot) -> None:
        self._robot = robot
        self._names, actuators = FreeNames(), FreeNames()
        self._buses = {port: self._names.take("servos", "") for port, line in robot.lines.items() if line.joints}
        self._actuators = {
            name: actuators.take(f"{name.removesuffix('_joint')}_servo", "servo") for name in robot.joints
        }

    def text(self) -> str:
        """Return the sections, an empty line between two of them."""
        parts = (self._bus_rows, self._actuator_rows, self._joint_rows, self._controller_rows, self._base_rows)
        return "\n".join(text for part in parts if (text := section(part())))

    def _bus_rows(self) -> Iterator[Row]:
        if self._buses:
            yield row(0, "buses:")
        for port, name in self._buses.items():
            yield from _bus(name, self._robot.lines[port])

    def _actuator_rows(self) -> Iterator[Row]:
        if self._buses:
            yield row(0, "actuators:")
            yield row(1, "", "the files name no models: these are guesses by the ticks of the servos")
        for port, name in self._buses.items():
            for joint in self._robot.lines[port].joints.values():
                yield row(1, f"{self._actuators[joint.name]}: {_servo(name, joint)}", _origin(joint))

    def _joint_rows(self) -> Iterator[Row]:
        if self._buses:
            yield Row("", "the joints below are those of the robot's URDF; name that file here:")
            yield Row("", "body: {urdf: robot.urdf}")
            yield row(0, "joints:")
        for joint in self._robot.joints.values():
            yield row(1, f"{key(joint.name)}:", place(joint.span))
            yield row(
                2, f"actuator: {self._actuators[joint.name]}", "" if joint.limits else f"no limits: {turns(joint)}"
            )
            if limits := _limits(joint):
                yield row(2, f"limits: {flow(limits)}", _half_given(joint))

    def _controller_rows(self) -> Iterator[Row]:
        controllers = [one for one in self._robot.controllers.values() if not isinstance(one, DiffController)]
        if controllers:
            yield row(0, "controllers:")
        for one in controllers:
            yield self._head(one.name, one)
            yield from self._follow(one) if isinstance(one, FollowController) else _gripper(one)

    def _head(self, wanted: str, one: FollowController | DiffController | ArbotixGripper) -> Row:
        name = self._names.take(wanted, "controller")
        was = f"; its name was '{plain(one.name, 60)}'" if name != one.name else ""
        return row(1, f"{name}:", f"{place(one.span)}{was}")

    def _follow(self, one: FollowController) -> Iterator[Row]:
        yield row(2, "type: joint_trajectory")
        gone = self._robot.missing(one)
        names = [word(joint.value) for joint in one.joints if joint.value not in gone]
        without = f"without {', '.join(plain(name, 60) for name in gone)}" if gone else ""
        line = row(2, f"joints: {flow_list(names)}", without)
        if len(line.text) <= WIDEST:
            yield line
            return
        yield row(2, "joints:", without)
        for name in names:
            yield row(3, f"- {name}")

    def _base_rows(self) -> Iterator[Row]:
        bases = [one for one in self._robot.controllers.values() if isinstance(one, DiffController)]
        if bases:
            yield row(0, "components:")
        for one in bases:
            yield self._head(one.name.removesuffix("_controller"), one)
            yield from _base(one)


def _bus(name: str, line: ServoLine) -> Iterator[Row]:
    yield row(1, f"{name}:")
    yield row(2, "type: dynamixel")
    port = line.port
    yield row(
        2, f"port: {word(port.value if port else USUAL_PORT)}", place(port.span) if port else "the driver's default"
    )
    if line.baud:
        yield row(2, f"baud: {line.baud.value}", place(line.baud.span))
    if line.rate:
        why = "the larger of read_rate and write_rate"
        yield row(2, f"rate: {quantity(line.rate.value, 'Hz')}", f"{place(line.rate.span)}: {why}")
    if line.idle:
        yield row(2, "", f"not needed here: {places(line.idle)}")


def _servo(bus: str, joint: ArbotixJoint) -> str:
    entries = {"bus": bus, "model": joint.model.name, "id": str(joint.id.value)}
    if joint.neutral:
        entries["neutral"] = str(joint.neutral.value)
    if joint.is_inverted:
        entries["invert"] = flag(True)
    return flow(entries)


def _origin(joint: ArbotixJoint) -> str:
    return f"{place(joint.id.span)}: {joint.model.family.ticks} ticks over {number(joint.turn)} deg"


def _limits(joint: ArbotixJoint) -> dict[str, str]:
    found = {}
    if joint.limits:
        found["position"] = flow_list([quantity(one, "deg") for one in joint.limits])
    if joint.speed:
        found["velocity"] = quantity(joint.speed.value, "deg/s")
    return found


def _half_given(joint: ArbotixJoint) -> str:
    if joint.limits is None or (joint.least and joint.greatest):
        return ""
    return f"{'max' if joint.least else 'min'}_angle is the driver's default"


def _gripper(one: ArbotixGripper) -> Iterator[Row]:
    for name, (value, origin) in one.lines.items():
        yield row(2, f"{name}: {value}", origin)


def _base(one: DiffController) -> Iterator[Row]:
    yield row(2, "type: diff_drive_sim", "the ArbotiX board drives the real base by its own firmware")
    if one.acceleration:
        text = quantity(one.acceleration.value, "m/s^2")
        yield row(2, f"acceleration: {text}", f"{place(one.acceleration.span)}: accel_limit")
    if one.timeout:
        yield row(2, f"command_timeout: {quantity(one.timeout.value, 's')}", f"{place(one.timeout.span)}: timeout")
    if one.kept:
        known = (f"{name} {number(found.value)}{_UNITS.get(name, '')}" for name, found in one.kept.items())
        yield row(2, "", f"of the real one: {', '.join(known)}")
