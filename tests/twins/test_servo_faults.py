"""Faults by name: each has its effect, ends with its time, and is the same as memory and by bytes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.requests import Refused
from rbxcompose.domains.devices.serial_ports import LostPortError
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_faults import (
    FAULTS,
    UNPLUG,
    FaultName,
    FaultScript,
    InjectFault,
    TwinFault,
    servo_faults,
)
from rbxcompose.domains.servos.twins.servo_line import FakeLine
from rbxcompose.domains.servos.twins.servo_twin import FakePort, TwinBus, twin_of
from tests.loops import for_all

MODELS = {1: "AX-12", 2: "XL430-W250", 3: "AX-12", 4: "XL430-W250"}
SILENT = {"power_off", "mute", "late", "corrupt", "wrong_id"}
HEALTHY = servo_faults([])


def fault(name: str, joint: str, at: float, lasts: float | None = None) -> TwinFault:
    return TwinFault.model_validate({"fault": name, "joint": joint, "at": at, "lasts": lasts})


class Broken:
    """Servos as a bus, in stepped time, and a script of faults for them; the joints have the names of ids."""

    def __init__(self, *faults: TwinFault) -> None:
        self.clock = SteppedClock()
        self.bus = TwinBus([FakeServo(model, id_) for id_, model in MODELS.items()], self.clock.now)
        self.script = FaultScript(faults, {str(servo.id): [servo] for servo in self.bus.line.servos}, self.bus)

    def at(self, time: float) -> set[int]:
        """Go to a time; return who answers."""
        while self.clock.now() < time:
            self.clock.advance_to(min(time, self.clock.now() + 0.01))
            self.script.play(self.clock.now())
            found = self.answering()
        return found

    def answering(self) -> set[int]:
        return set(self.bus.read(list(MODELS), ["present_position"]))


@contextmanager
def by_bytes(servos: list[FakeServo], folder: Path) -> Iterator[DynamixelBus]:
    line = FakeLine(servos, SteppedClock().now)
    models = {servo.id: servo.model for servo in servos}
    with FakePort(line, folder / "servos") as port, DynamixelBus(str(port.path), models, timeout=0.03) as bus:
        yield bus


def test_the_names_are_those_of_the_type() -> None:
    assert set(get_args(FaultName)) == {*FAULTS, UNPLUG}


@for_all("name", FAULTS)
def test_a_servo_answers_by_bytes_just_when_it_does_as_memory(name: str, tmp_path: Path) -> None:
    servos = [FakeServo(model, id_) for id_, model in MODELS.items()]
    with by_bytes(servos, tmp_path) as bus:
        for servo in servos[:2]:
            servo.faults = servo_faults([name])
        found = set(bus.read(list(MODELS), ["present_position"]))
        assert found == ({3, 4} if name in SILENT else set(MODELS))
        for servo in servos[:2]:
            servo.faults = servo_faults([])
        assert set(bus.read(list(MODELS), ["present_position"])) == set(MODELS)
    broken = Broken(fault(name, "1", 1.0, 1.0), fault(name, "2", 1.0, 1.0))
    assert broken.at(0.9) == set(MODELS)
    assert broken.at(1.5) == found
    assert broken.at(2.1) == set(MODELS)
    assert all(fake_servo.faults == HEALTHY for fake_servo in broken.bus.line.servos)


def test_a_script_acts_on_servos_behind_a_pseudo_terminal(tmp_path: Path) -> None:
    servos = {str(id_): [FakeServo(model, id_)] for id_, model in MODELS.items()}
    models = {id_: servos[str(id_)][0].model for id_ in MODELS}
    with twin_of(servos, SteppedClock().now, has_bytes=True) as port:
        assert isinstance(port, FakePort)
        script = FaultScript([fault("mute", "1", 1.0, 1.0), fault(UNPLUG, "", 3.0, 1.0)], servos, port)
        with DynamixelBus(str(port.path), models, timeout=0.03) as bus:
            for time, found in ((0.5, {1, 2, 3, 4}), (1.5, {2, 3, 4}), (2.5, {1, 2, 3, 4})):
                script.play(time)
                assert set(bus.read(list(MODELS), ["present_position"])) == found
            script.play(3.5)
            with pytest.raises(LostPortError):
                bus.read(list(MODELS), ["present_position"])
            script.play(4.5)
            assert all(bus.reopen().values())


@pytest.mark.soak  # `test_servo_bus_faults` waits for one that has
def test_a_hot_servo_cools_down_after_the_fault() -> None:
    broken = Broken(fault("overheat", "1", 0.0, 5.0))
    broken.at(4.0)
    servo = broken.bus.line[1]
    assert servo.get("present_temperature") == servo.get("temperature_limit")
    assert servo.alert == 0  # it is not beyond
    broken.at(5.0 + servo.motor.traits.inertia)
    assert 40 < servo.get("present_temperature") < 55


def test_an_overload_and_a_low_supply_are_told_and_a_shutdown_outlives_them_in_protocol_2() -> None:
    broken = Broken(fault("overload", "1", 0.0, 1.0), fault("overload", "2", 0.0, 1.0))
    broken.bus.write({id_: {"torque_enable": 1} for id_ in MODELS})
    broken.at(0.5)
    assert [broken.bus.line[id_].get("torque_enable") for id_ in MODELS] == [0, 0, 1, 1]
    assert (broken.bus.line[1].alert, broken.bus.line[2].get("hardware_error")) == (32, 32)
    broken.at(1.5)
    assert (broken.bus.line[1].alert, broken.bus.line[2].get("hardware_error")) == (0, 32)
    weak = Broken(fault("undervoltage", "2", 0.0))
    weak.at(0.5)
    assert (weak.bus.line[2].get("present_voltage"), weak.bus.line[2].get("hardware_error")) == (50, 1)


def test_a_jammed_servo_pushes_and_warms_up_and_moves_on_afterwards() -> None:
    broken = Broken(fault("jam", "2", 0.0, 5.0))
    broken.at(0.1)
    broken.bus.write({2: {"torque_enable": 1}})
    broken.bus.write({2: {"goal_position": 1500}})
    broken.at(4.9)
    servo = broken.bus.line[2]
    assert (servo.get("present_position"), servo.get("present_load")) == (2048, -1000)
    assert servo.get("present_temperature") > 33
    broken.at(7.0)
    assert (servo.get("present_position"), servo.get("present_load")) == (1500, 0)


def test_a_servo_without_power_forgets_its_torque_and_stays_where_it_is() -> None:
    broken = Broken(fault("power_off", "2", 1.0, 1.0))
    broken.bus.write({2: {"torque_enable": 1, "goal_position": 3500, "goal_speed": 5}})
    broken.at(1.5)
    at = broken.bus.line[2].get("present_position")
    broken.bus.write({2: {"torque_enable": 1}})
    broken.at(3.0)
    servo = broken.bus.line[2]
    assert (servo.get("torque_enable"), servo.get("goal_speed"), servo.get("present_position")) == (0, 0, at)


def test_a_mute_servo_obeys() -> None:
    broken = Broken(fault("mute", "2", 0.0))
    broken.at(0.1)
    assert broken.bus.write({2: {"led": 1}}, is_confirmed=True) == {2}
    assert broken.bus.line[2].get("led") == 1


def test_a_bus_that_is_unplugged_is_gone_until_it_is_not() -> None:
    broken = Broken(fault(UNPLUG, "", 1.0, 1.0))
    assert broken.at(0.9) == set(MODELS)
    with pytest.raises(LostPortError):
        broken.at(1.5)
    broken.clock.advance_to(2.5)
    broken.script.play(2.5)
    assert broken.answering() == set(MODELS)


def test_faults_of_one_joint_add_up_and_end_each_for_itself() -> None:
    broken = Broken(fault("mute", "1", 0.0, 2.0), fault("jam", "1", 1.0, 2.0))
    seen = []
    for time in (0.5, 1.5, 2.5, 3.5):
        broken.at(time)
        faults = broken.bus.line[1].faults
        seen.append((faults.is_mute, faults.is_jammed))
    assert seen == [(True, False), (True, True), (False, True), (False, False)]


def test_a_request_begins_at_once_and_what_makes_no_sense_is_refused() -> None:
    broken = Broken()
    broken.at(1.0)
    assert "mute of 1 for 2 s" in broken.script.inject(InjectFault("mute", "1", 2.0), 1.0)
    assert broken.at(1.5) == {2, 3, 4}
    assert broken.at(3.1) == set(MODELS)
    for wrong in (InjectFault("mtue", "1"), InjectFault("mute", "9"), InjectFault(UNPLUG, "1")):
        with pytest.raises(Refused, match=wrong.fault if wrong.fault == "mtue" else wrong.joint):
            broken.script.inject(wrong, 3.2)
    for time in (-1.0, 0.0, math.inf, math.nan):
        with pytest.raises(Refused, match="above 0 s"):
            broken.script.inject(InjectFault("mute", "1", time), 3.2)


@given(
    st.lists(st.tuples(st.sampled_from([*FAULTS]), st.sampled_from(["1", "2", ""]), st.floats(0, 1), st.floats(0, 1)))
)
def test_all_faults_end_with_their_times(script: list[tuple[str, str, float, float]]) -> None:
    broken = Broken(*(fault(name, joint, begin, lasts) for name, joint, begin, lasts in script))
    broken.at(0.7)
    broken.at(2.1)
    assert broken.answering() == set(MODELS)
    assert all(servo.faults == HEALTHY for servo in broken.bus.line.servos)
