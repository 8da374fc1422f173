"""What the driver of servos does when something goes wrong with them, by configuration and by request."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.requests import Refused
from rbxcompose.domains.servos.components.servo_bus import ServoBusDriver
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.joint_states import JointMode
from rbxcompose.domains.servos.models import servo_models
from rbxcompose.domains.servos.twins.servo_faults import InjectFault, ListFaults
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, FakeLine, FakePort, FakeServo, instance
from tests.soak import rare

LIMITS = {"lower": -2.0, "upper": 2.0, "velocity": 1.5, "acceleration": 8.0}


def config_of(model: str) -> dict[str, Any]:
    joints = enumerate(("pan", "tilt"), 1)
    return {"joints": {name: {**LIMITS, "servos": [{"id": id_, "model": model}]} for id_, name in joints}}


class Head:
    """Two joints on a twin, with faults by name: when, what, of which joint, how long."""

    def __init__(
        self,
        *faults: tuple[float, str, str, float | None],
        twin: str = "servo",
        rate: float = 50.0,
        model: str = "AX-12",
        **settings: Any,
    ) -> None:
        named = {
            f"fault_{index}": {"at": at, "fault": fault, "joint": joint, "lasts": lasts}
            for index, (at, fault, joint, lasts) in enumerate(faults)
        }
        self.robot = Bench(
            instance(
                "servos", "servo_bus", {**config_of(model), "twin": twin, "faults": named, "rate": rate, **settings}
            ),
            start=False,
        )
        self.states = self.robot.collect("/joint_states", JointState)
        driver = self.robot.component("servos")
        assert isinstance(driver, ServoBusDriver)
        self.driver = driver

    def servo(self, id: int) -> FakeServo:
        bus: Any = self.driver.cycle.bus
        found: FakeServo = bus.line[id]
        return found

    def modes(self) -> list[str]:
        return [str(drive.mode) for drive in self.driver.cycle.drives.values()]

    def go(self, joint: str, position: float) -> None:
        self.robot.bus.publisher("me", f"/{joint}/command", Float64, Qos.COMMAND)(Float64(data=position))
        self.robot.advance(0.02)


class Ticking(SteppedClock):
    """Simulated time that advances whenever it is looked at, so that who waits for it goes on."""

    def now(self) -> float:
        self._now += 1e-3
        return self._now

    def advance_to(self, t: float) -> None:
        super().advance_to(max(t, self._now))


@pytest.mark.parametrize(
    ("on_shutdown", "mode", "torque", "speed"),
    [("relax", "position", 0, 300), ("park", "position", 1, 300), ("hold", "velocity", 1, 0)],
)
def test_a_driver_that_raises_ends_torque_as_declared_and_opens_its_port_again(
    on_shutdown: str, mode: str, torque: int, speed: int, tmp_path: Path
) -> None:
    line = FakeLine([FakeServo("AX-12", 1)], SteppedClock().now)
    joint = {**LIMITS, "mode": mode, "servos": [{"id": 1, "model": "AX-12"}]}
    with FakePort(line, tmp_path / "servos") as port:
        config = {"joints": {"pan": joint}, "port": str(port.path), "on_shutdown": on_shutdown}
        robot = Bench(instance("servos", "servo_bus", config), clock=Ticking())
        driver = robot.component("servos")
        line[1].set("torque_enable", 1)
        line[1].set("goal_velocity", 300)
        driver.run_cycle = lambda: 1 / 0  # type: ignore[attr-defined]
        assert robot.run_until(lambda: robot.host.states()["servos"][0] != "active", 1.0)
        with DynamixelBus(str(port.path), {1: servo_models()["AX-12"]}, timeout=0.2) as bus:
            left = bus.read([1], ["torque_enable", "goal_velocity"])[1].values
        assert left == {"torque_enable": torque, "goal_velocity": speed}
        robot.run_until(lambda: robot.host.states()["servos"] == ("active", 1), 2.0)
        assert robot.host.states()["servos"] == ("active", 1)
        robot.host.shutdown()


@pytest.mark.parametrize("twin", ["servo", *rare("ideal")])
def test_a_hot_joint_rests_and_can_be_used_again_when_it_has_cooled_down(twin: str) -> None:
    head = Head((1.0, "overheat", "pan", 2.0), twin=twin, rate=25.0)
    head.robot.advance(0.5)
    head.go("pan", 1.0)
    head.robot.advance(1.5)
    assert head.modes() == [JointMode.RESTING, JointMode.RELAXED]
    head.robot.advance(80.0)
    assert head.modes() == [JointMode.RELAXED, JointMode.RELAXED]
    head.go("pan", 0.3)
    head.robot.advance(2.0)
    assert head.states[-1].position[0] == pytest.approx(0.3, abs=0.006)


@pytest.mark.parametrize("fault", ["mute", "late", "corrupt", "wrong_id", "power_off"])
def test_a_joint_that_is_not_heard_is_a_fault_and_comes_back_without_torque(fault: str) -> None:
    head = Head((1.0, fault, "tilt", 2.0))
    head.robot.advance(0.5)
    head.go("tilt", 1.0)
    head.robot.advance(2.0)
    assert head.modes() == [JointMode.RELAXED, JointMode.FAULT]
    head.robot.advance(1.0)
    assert head.modes() == [JointMode.RELAXED, JointMode.RELAXED]


@pytest.mark.parametrize("model", ["AX-12", "XL430-W250", "XL-320"])
def test_a_joint_whose_servo_was_without_supply_for_a_moment_is_relaxed_with_the_reason(model: str) -> None:
    head = Head((2.0, "power_off", "pan", 0.2), model=model)
    head.robot.advance(0.5)
    head.go("pan", 1.0)
    head.robot.advance(1.2)
    assert head.modes() == [JointMode.ACTIVE, JointMode.RELAXED]
    head.robot.advance(1.3)
    assert head.modes() == [JointMode.RELAXED, JointMode.RELAXED]
    assert any("servo 1 of joint 'pan' has lost its torque" in text for text in head.robot.texts())
    head.go("pan", 0.5)
    head.robot.advance(2.0)
    assert head.states[-1].position[0] == pytest.approx(0.5, abs=0.006)


def test_a_servo_that_answers_late_gets_its_mode_and_what_a_new_one_had_of_its_own_goes() -> None:
    joints = config_of("XL430-W250")["joints"]
    joints["pan"]["mode"] = "velocity"
    head = Head((0.0, "power_off", "pan", 1.5), (0.0, "power_off", "tilt", 1.5), model="XL430-W250", joints=joints)
    pan, tilt = head.servo(1), head.servo(2)
    pan.set("operating_mode", 3)
    statuses = head.robot.statuses("servos")
    head.robot.advance(1.1)
    assert (statuses[-1].level, statuses[-1].message.count("no servo answers at id")) == (2, 2)
    head.robot.advance(0.39)
    tilt.set("goal_speed", 5)  # as one that somebody has used before
    head.robot.advance(2.0)
    assert (pan.get("operating_mode"), tilt.get("goal_speed")) == (1, 0)
    assert statuses[-1].level == 0


def test_a_joint_that_something_holds_is_reported_and_goes_on_from_there() -> None:
    head = Head((0.0, "jam", "pan", 3.9))
    statuses = head.robot.statuses("servos")
    head.robot.advance(0.5)
    head.go("pan", 1.0)
    head.robot.advance(3.0)
    assert "pan: it is at 0, and was told to be at 1" in statuses[-1].message
    head.go("pan", 1.0)
    head.robot.advance(0.04)
    assert abs(head.servo(1).get("goal_position") - 512) < 30
    head.robot.advance(4.0)
    assert head.states[-1].position[0] == pytest.approx(1.0, abs=0.006)
    assert statuses[-1].level == 0


def test_servos_of_a_joint_that_are_apart_and_one_of_another_model_are_reported() -> None:
    joints = config_of("XL430-W250")["joints"]
    joints["pan"]["servos"].append({"id": 3, "model": "XL430-W250"})
    head = Head(model="XL430-W250", joints=joints)
    statuses = head.robot.statuses("servos")
    head.servo(3).move_to(3000)
    head.servo(2).set("model_number", 1020)
    head.robot.advance(0.1)
    head.driver.prepare()
    head.robot.advance(1.1)
    assert statuses[-1].message == "pan: its servos are 1.46 apart; tilt: servo 2 is XM430-W350, not XL430-W250"


def test_a_servo_that_does_not_answer_at_the_end_is_named() -> None:
    head = Head()
    head.robot.advance(0.5)
    head.servo(1).faults.is_mute = True
    head.robot.host.shutdown()
    assert "servos: servo 1 did not answer at the end, and may still have torque" in head.robot.texts()


def test_a_joint_that_something_holds_on_its_way_is_not_parked_and_holds() -> None:
    head = Head(on_shutdown="park", park={"pan": 0.0})
    head.robot.advance(0.5)
    head.go("pan", 1.0)
    head.robot.advance(2.0)
    head.servo(1).faults.is_jammed = True
    head.robot.host.brake()
    head.robot.advance(3.0)
    assert not head.driver.is_at_rest
    head.robot.host.shutdown()
    assert head.servo(1).get("torque_enable") == 1
    assert "servos: joints are not parked: they hold" in head.robot.texts()


def test_a_joint_of_several_turns_stays_when_its_servo_has_counted_anew() -> None:
    joints = config_of("XL430-W250")["joints"]
    joints["pan"] |= {"is_continuous": True, "lower": None, "upper": None}
    head = Head(model="XL430-W250", joints=joints)
    head.robot.advance(0.5)
    head.go("pan", 10.0)
    head.robot.advance(10.0)
    head.servo(1).move_to(head.servo(1).get("present_position") % 4096)
    head.robot.advance(0.1)
    head.go("pan", 10.0)
    assert head.modes() == [JointMode.FAULT, JointMode.RELAXED]


@pytest.mark.parametrize("fault", ["overload", "undervoltage"])
def test_an_error_of_the_hardware_keeps_a_joint_disabled(fault: str) -> None:
    head = Head((1.0, fault, "pan", 2.0))
    head.robot.advance(0.5)
    head.go("pan", 1.0)
    head.robot.advance(4.0)
    assert head.modes() == [JointMode.FAULT, JointMode.RELAXED]


def test_a_jammed_joint_stays_and_goes_on_afterwards() -> None:
    head = Head((0.0, "jam", "pan", 3.0))
    head.robot.advance(0.5)
    head.go("pan", 1.0)
    head.robot.advance(2.0)
    assert head.states[-1].position[0] == 0.0
    head.robot.advance(3.0)
    assert head.states[-1].position[0] == pytest.approx(1.0, abs=0.006)


def test_a_bus_that_is_unplugged_recovers_by_itself_relaxed() -> None:
    head = Head((1.0, "unplug", "", 2.0))
    statuses = head.robot.statuses("servos")
    head.robot.advance(0.5)
    head.go("pan", 1.0)
    head.robot.advance(1.0)
    told = len(head.states)
    head.robot.advance(1.0)
    assert len(head.states) == told
    assert statuses[-1].message == "the bus of servos has gone"
    head.robot.advance(1.5)
    assert head.modes() == [JointMode.RELAXED, JointMode.RELAXED]
    assert any("is back" in text for text in head.robot.texts())
    head.go("pan", 0.5)
    head.robot.advance(2.0)
    assert head.states[-1].position[0] == pytest.approx(0.5, abs=0.006)


def test_a_request_lets_something_go_wrong_now() -> None:
    head = Head()
    head.robot.advance(1.0)
    assert "mute of pan" in head.robot.host.ask("servos", InjectFault("mute", "pan", 1.0))
    head.robot.advance(0.9)
    assert head.modes() == [JointMode.FAULT, JointMode.RELAXED]
    head.robot.advance(0.5)
    assert head.modes() == [JointMode.RELAXED, JointMode.RELAXED]
    with pytest.raises(Refused, match="nobody"):
        head.robot.host.ask("servos", InjectFault("mute", "nobody"))
    faults = head.robot.host.ask("servos", ListFaults("servos"))
    assert faults["mute"] == "does not answer, but obeys"
    assert all(head.robot.host.ask("servos", InjectFault(name, "pan", 0.1)) for name in faults)


def test_servos_without_faults_and_those_whose_faults_are_over_move_alike() -> None:
    moved = []
    for faults in ((), ((0.5, "garbage", "pan", 0.5), (0.5, "twice", "tilt", 0.5))):
        head = Head(*faults)
        head.robot.advance(0.2)
        head.go("pan", 1.0)
        head.robot.advance(3.0)
        moved.append(np.array([state.position for state in head.states]))
    assert np.array_equal(moved[0], moved[1])


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("overheat", "it was too hot and rests"),
        ("mute", "nothing has been measured for"),
        ("power_off", "nothing has been measured for"),
        ("stop", "the robot is stopped"),
    ],
)
def test_a_joint_that_would_take_no_command_all_the_same_is_not_enabled_and_says_why(fault: str, reason: str) -> None:
    head = Head()
    told: list[Any] = []
    enable = head.robot.bus.client("me", "/pan/enable", SetBool)
    enable_all = head.robot.bus.client("me", "/servos/enable_all", SetBool)
    head.robot.advance(1.0)
    if fault == "stop":
        head.driver.stop()
    else:
        head.robot.host.ask("servos", InjectFault(fault, "pan", 60.0))
    head.robot.advance(3.0)
    enable(SetBool.Request(data=False), told.append)
    head.robot.advance(0.1)
    enable(SetBool.Request(data=True), told.append)
    enable_all(SetBool.Request(data=True), told.append)
    head.robot.advance(0.1)
    off, one, all_ = (reply.response for reply in told)
    assert off.success
    assert (one.success, all_.success) == (False, False)
    assert reason in one.message
    assert f"pan: {reason}" in all_.message
    assert ("tilt" in all_.message) == (fault == "stop")
    assert head.modes()[0] == JointMode.DISABLED
    assert ("pan" in head.states[-1].name) == (fault in ("overheat", "stop"))  # where it is, is known
