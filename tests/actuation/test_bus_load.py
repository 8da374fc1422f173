"""How long a cycle is on the wire: what is computed before a robot runs is what servos on a line take."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.joint_drive import JointServo, PositionDrive, ServoJoint
from rbxcompose.domains.servos.joint_states import JointPolicy, MoveTo
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.models import ServoModel, servo_models
from rbxcompose.domains.servos.servo_cycle import ServoCycle
from rbxcompose.domains.servos.transfers import BusLoad, cycle_load
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_line import FakeLine, FakeReply
from rbxcompose.domains.servos.twins.servo_twin import FakePort
from tests.soak import rare

CYCLE = 0.01  # [s]
BUSES = {
    "one AX": ["AX-12"],
    "eight AX": ["AX-12"] * 8,
    "six MX 1.0": ["MX-28"] * 6,
    "twelve X": ["XL430-W250"] * 12,
    "X of two tables": ["XL430-W250"] * 3 + ["XM430-W350"] * 3,
    "2.0 of several tables": ["XL-320", "XL-320", "XM430-W350", "PH54-200"],
    "both protocols": ["AX-12", "AX-18", "MX-64", "MX-28", "XL430-W250", "XL-320"],
}


class TimedLine(FakeLine):
    """A line that adds up how long its requests and replies take."""

    taken = 0.0  # [s]

    def receive(self, data: bytes, baud: int | None = None) -> list[FakeReply]:
        """Answer, and count."""
        replies = super().receive(data, baud)
        self.taken += 10 * len(data) / (baud or 1_000_000) + max((reply.after for reply in replies), default=0.0)
        return replies


def measured(models: dict[int, str], baud: int, folder: Path, delay: float) -> float:
    """Return how long the longest cycle takes on the wire, with all joints on their way."""
    clock = SteppedClock()
    line = TimedLine([FakeServo(name, id_, baud=baud) for id_, name in models.items()], clock.now)
    for servo in line.servos:
        servo.set("return_delay", servo.model.to_raw("return_delay", delay))
    known = {id_: servo_models()[name] for id_, name in models.items()}
    limits, policy = MotionLimits(-1.0, 1.0, 1.0), JointPolicy(CYCLE)
    longest = 0.0
    with FakePort(line, folder / "servos") as port, DynamixelBus(str(port.path), known, baud=baud, timeout=0.2) as bus:
        joints = {
            f"joint_{id_}": ServoJoint(f"joint_{id_}", (JointServo(id_, model, model.family.centre),), limits)
            for id_, model in known.items()
        }
        cycle = ServoCycle(bus, {name: PositionDrive(joint, policy) for name, joint in joints.items()})
        for joint in joints.values():
            cycle.torques.write(bus, joint.servos[0])
        line.taken = 0.0
        for number in range(4 + 2 * len(models)):
            for drive in cycle.drives.values():
                drive.ask(MoveTo(0.9))
            cycle.run(clock.now(), CYCLE)
            bus.read([1], ["moving"])  # its reply shows that the writes before it have been heard
            if number > 3:
                longest = max(longest, line.taken - _extra(known[1], baud, delay))
            line.taken = 0.0
            clock.advance_to(clock.now() + CYCLE)
    return longest


def _extra(model: ServoModel, baud: int, delay: float) -> float:
    """Return how long it takes to read one byte [s]."""
    return 10 * {1: 8 + 7, 2: 14 + 12}[model.protocol] / baud + delay


@pytest.mark.parametrize("baud", [1_000_000, *rare(57_600)])
@pytest.mark.parametrize("names", BUSES.values(), ids=BUSES)
def test_a_cycle_takes_as_long_as_computed(names: list[str], baud: int, tmp_path: Path) -> None:
    models = dict(enumerate(names, 1))
    load = cycle_load({id_: (servo_models()[name], "position") for id_, name in models.items()})
    assert measured(models, baud, tmp_path, 0.0005) == pytest.approx(load.time(baud), rel=0.05)


def test_servos_that_answer_at_once_make_a_cycle_shorter(tmp_path: Path) -> None:
    models = dict.fromkeys(range(1, 9), "AX-12")
    load = cycle_load(dict.fromkeys(models, (servo_models()["AX-12"], "position")))
    assert measured(models, 1_000_000, tmp_path, 0.0) == pytest.approx(load.time(1_000_000, 0.0), rel=0.05)


def test_the_rate_that_is_needed_makes_a_cycle_fit() -> None:
    load = BusLoad(1000, 10)
    assert load.time(load.baud_for(0.02)) == pytest.approx(0.02)
    assert load.baud_for(0.005) == math.inf
    assert load.time(load.baud_for(0.005, 0.0), 0.0) == pytest.approx(0.005)


def test_wheels_are_given_velocities() -> None:
    model = servo_models()["XL430-W250"]
    assert cycle_load({1: (model, "velocity")}) == cycle_load({1: (model, "position")})
