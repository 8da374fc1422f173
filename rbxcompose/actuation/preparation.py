"""What servos are told before they drive joints: modes, and what they do when the bus falls silent."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.servo_joint import JointServo, ServoJoint
from rbxcompose.actuation.servo_models import EXTENDED

WATCHDOG = "bus_watchdog"
MODE = "operating_mode"
DELAY = "return_delay"
_KEPT = (MODE, DELAY, "min_position", "max_position")  # outlive the supply, and change without torque only
_FIRED = -1  # what `bus_watchdog` reads after it has stopped a servo


def prepare(bus: ServoBus, joints: Iterable[ServoJoint], watchdog: float, delay: float | None = None) -> Iterator[str]:
    """Set the modes of all servos that answer, and arm watchdogs [s]; yield sentences on what has changed for good.

    With a `delay`, they pause so long before each reply [s].

    Raises:
        PortError: if the bus has gone.
    """
    for joint in joints:
        for servo in joint.servos:
            names = [name for name in _KEPT if name in servo.model.items]
            if (reading := bus.read([servo.id], names).get(servo.id)) is None:
                continue
            changed = _changes(joint, servo, reading.values)
            if delay is not None and (raw := servo.model.to_raw(DELAY, delay)) != reading.values[DELAY]:
                changed[DELAY] = raw
            if changed:
                bus.write({servo.id: {"torque_enable": 0}}, is_confirmed=True)
                bus.write({servo.id: changed}, is_confirmed=True)
                yield f"servo {servo.id} of joint '{joint.name}' now has {_told(changed)}"
            arm(bus, servo, watchdog)


def with_torque(bus: ServoBus, joints: Iterable[ServoJoint]) -> dict[str, bool]:
    """Return whether all servos of a joint have torque now, of the joints whose servos have all answered."""
    joints = list(joints)
    found = bus.read([id_ for joint in joints for id_ in joint.ids], ["torque_enable"])
    held = {id_ for id_, reading in found.items() if reading.values["torque_enable"]}
    return {joint.name: held.issuperset(joint.ids) for joint in joints if found.keys() >= set(joint.ids)}


def arm(bus: ServoBus, servo: JointServo, watchdog: float) -> None:
    """Let a servo stop after a silence of the bus [s], 0 is never, if its model can; one that has done so goes on."""
    if (item := servo.model.items.get(WATCHDOG)) is None:
        return
    bus.write({servo.id: {WATCHDOG: 0}}, is_confirmed=True)
    if watchdog > 0:
        raw = max(1, min(item.most, item.to_raw(watchdog)))
        bus.write({servo.id: {WATCHDOG: raw}}, is_confirmed=True)


def has_fired(values: Mapping[str, int]) -> bool:
    """Return whether a servo has been stopped by its watchdog."""
    return values.get(WATCHDOG) == _FIRED


def is_unarmed(values: Mapping[str, int]) -> bool:
    """Return whether a servo has no watchdog: it has started again."""
    return values.get(WATCHDOG) == 0


def _changes(joint: ServoJoint, servo: JointServo, values: Mapping[str, int]) -> dict[str, int]:
    """Return what differs from what the joint needs; ranges of positions that somebody has set are kept."""
    if modes := servo.model.family.modes:
        is_endless = joint.is_continuous and servo.model.family.is_endless
        wanted = EXTENDED if joint.mode == "position" and is_endless else joint.mode
        return {} if values.get(MODE) == modes[wanted] else {MODE: modes[wanted]}
    is_wheel = values.get("min_position") == values.get("max_position") == 0
    if joint.mode == "velocity":
        return {} if is_wheel else {"min_position": 0, "max_position": 0}
    return {"min_position": 0, "max_position": servo.model.family.ticks - 1} if is_wheel else {}


def _told(changed: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {raw}" for name, raw in changed.items())
