"""Joints with gears, tables, several servos, and joints that follow others."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.bus_config import (
    DrivenJointConfig,
    JointServoConfig,
    ServoBusConfig,
    drives_of,
    mimics_of,
)
from rbxcompose.domains.servos.joint_drive import JointDrive
from rbxcompose.domains.servos.joint_states import JointMode, MoveTo
from rbxcompose.domains.servos.servo_cycle import ServoCycle
from rbxcompose.domains.servos.transmission import Calibration, Gear, Measured, Transmission
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_twin import TwinBus

PERIOD = 0.01
TICK = math.tau / 4096
LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 2.0, "acceleration": 20.0}
TABLE = Measured(Calibration(((0.0, 0.0), (10.0, 0.1), (30.0, 0.4))))


def servos(*ids: int, invert: tuple[int, ...] = ()) -> list[JointServoConfig]:
    return [JointServoConfig(id=number, model="XL430-W250", invert=number in invert) for number in ids]


class Machine:
    """Joints on a simulated bus, cycle by cycle."""

    def __init__(self, *, shares_heat: bool = False, **joints: DrivenJointConfig) -> None:
        self.now = 0.0
        config = ServoBusConfig(joints=joints)
        self.drives = drives_of(config)
        self.bus = TwinBus([FakeServo(model, id_) for id_, model in config.models.items()], lambda: self.now)
        self.cycle = ServoCycle(self.bus, self.drives, mimics_of(joints), shares_heat=shares_heat)
        self.run(5)

    def run(self, cycles: int) -> None:
        for _ in range(cycles):
            self.cycle.run(self.now, PERIOD)
            self.now += PERIOD

    def move(self, name: str, position: float, seconds: float = 3.0) -> JointDrive:
        self.drives[name].ask(MoveTo(position))
        self.run(round(seconds / PERIOD))
        return self.drives[name]

    def ticks(self, id: int) -> int:
        return self.bus.line[id].get("present_position")


@pytest.mark.parametrize("transmission", [Gear(3.0, 0.2), Gear(-1.5), TABLE], ids=["gear", "inverse gear", "table"])
@given(st.floats(0.5, 29.5))
def test_each_position_is_that_of_its_angle(transmission: Transmission, angle: float) -> None:
    assert transmission.angle(transmission.position(angle)) == pytest.approx(angle)
    near = (transmission.position(angle + 1e-5) - transmission.position(angle - 1e-5)) / 2e-5
    if transmission is not TABLE or abs(angle - 10.0) > 1e-3:
        assert transmission.slope(angle) == pytest.approx(near, rel=1e-4)


@pytest.mark.parametrize("ratio", [0.0, math.inf, math.nan])
def test_a_gear_has_a_ratio(ratio: float) -> None:
    with pytest.raises(ValueError, match="ratio"):
        Gear(ratio)


def test_a_gear_turns_its_servo_more_often() -> None:
    machine = Machine(pan=DrivenJointConfig(servos=servos(1), ratio=3.0, offset=0.1, **LIMITS))
    pan = machine.move("pan", 0.5)
    assert pan.measured.position == pytest.approx(0.5, abs=TICK / 3)
    assert machine.ticks(1) == 2048 + round(0.4 * 3 / TICK)


def test_a_joint_that_slides_is_where_its_table_says() -> None:
    table = [(0.0, 0.0), (3.0, 0.2)]
    machine = Machine(lift=DrivenJointConfig(servos=servos(1), calibration=table, lower=0.0, upper=0.2, velocity=0.1))
    assert machine.move("lift", 0.05).measured.position == pytest.approx(0.05, abs=1e-4)
    assert machine.ticks(1) == 2048 + round(0.75 / TICK)
    assert machine.move("lift", 9.0, 5.0).measured.position == pytest.approx(0.2, abs=2e-4)


def test_two_servos_turn_one_joint_and_one_of_them_is_enough_to_stop_it() -> None:
    machine = Machine(lift=DrivenJointConfig(servos=servos(1, 2, invert=(2,)), **LIMITS))
    lift = machine.move("lift", 1.0)
    assert machine.ticks(1) - 2048 == pytest.approx(2048 - machine.ticks(2), abs=1)
    lift.ask(MoveTo(-1.0))
    machine.run(20)
    machine.bus.line[2].faults.is_mute = True
    machine.run(60)
    assert lift.mode is JointMode.FAULT
    assert machine.bus.line[1].get("torque_enable") == 0


def test_a_joint_that_mimics_another_follows_it_with_and_without_torque() -> None:
    machine = Machine(
        left=DrivenJointConfig(servos=servos(1), **LIMITS),
        right=DrivenJointConfig(servos=servos(2), mimic="left", multiplier=-0.5, mimic_offset=0.1, **LIMITS),
    )
    machine.move("left", 0.8)
    machine.run(50)
    assert machine.drives["right"].measured.position == pytest.approx(-0.3, abs=TICK)
    machine.drives["left"].relax()
    machine.run(5)
    assert machine.drives["right"].mode is JointMode.RELAXED


@pytest.mark.parametrize(("shares_heat", "modes"), [(True, {"resting"}), (False, {"resting", "relaxed"})])
def test_one_hot_joint_lets_all_rest_if_that_is_wanted(shares_heat: bool, modes: set[str]) -> None:
    pair = {name: DrivenJointConfig(servos=servos(id_), **LIMITS) for id_, name in enumerate(("pan", "tilt"), 1)}
    machine = Machine(shares_heat=shares_heat, **pair)
    machine.bus.line[1].motor.temperature = 70
    machine.run(10)
    assert {str(drive.mode) for drive in machine.drives.values()} == modes


def test_a_servo_that_its_watchdog_has_stopped_goes_on() -> None:
    machine = Machine(pan=DrivenJointConfig(servos=servos(1), **LIMITS))
    machine.cycle.watchdog = 0.2
    servo = machine.bus.line[1]
    servo.set("bus_watchdog", 10)
    machine.drives["pan"].ask(MoveTo(1.5))
    machine.run(20)
    machine.now += 0.5  # the driver hangs
    machine.run(1)
    stopped = machine.ticks(1)
    assert stopped < 2048 + 600
    machine.run(300)
    assert machine.drives["pan"].measured.position == pytest.approx(1.5, abs=TICK)
