"""Torque of servos: what models reach, the share that a limit leaves, and limits that are written and kept."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus
from rbxcompose.domains.servos.joint_drive import JointServo
from rbxcompose.domains.servos.joint_states import Enable, MoveTo
from rbxcompose.domains.servos.models import (
    STALL_TORQUES,
    ServoModel,
    joint_effort,
    servo_models,
    share_of,
    stall_torque,
    steepest,
)
from rbxcompose.domains.servos.servo_cycle import TorqueLimits, raw_limit
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_twin import TwinBus, pseudo_terminal
from tests.actuation.test_joint_drive import Driven

MODELS = st.sampled_from([*servo_models().values()])
shares = st.floats(0.01, 1.0)
efforts = st.floats(1e-3, 1e3)


def servo(model: ServoModel, torque: float = 1.0, id: int = 1) -> JointServo:
    return JointServo(id, model, model.family.centre, torque=torque)


def test_the_table_names_models_and_only_the_p_series_is_unknown() -> None:
    assert STALL_TORQUES.keys() <= servo_models().keys()
    unknown = {model.family.table for model in servo_models().values() if stall_torque(model) is None}
    assert unknown == {"P"}


@given(efforts, efforts)
def test_a_share_never_adds_torque_and_leaves_just_the_limit(limit: float, effort: float) -> None:
    share = share_of(limit, effort)
    assert 0.0 <= share <= 1.0
    assert share * effort == pytest.approx(min(limit, effort))


@given(st.lists(MODELS, min_size=1, max_size=3), st.floats(0.1, 1000.0))
def test_servos_add_up_and_gears_multiply_whichever_way_they_turn(models: list[ServoModel], gear: float) -> None:
    effort = joint_effort(models, gear)
    known = [stall_torque(model) for model in models]
    assert (effort is None) == (None in known)
    if effort is not None:
        assert effort == pytest.approx(gear * sum(value or 0.0 for value in known))
        assert effort == joint_effort(models, -gear)


def test_a_table_counts_where_the_servo_is_strongest() -> None:
    assert steepest([(0.0, 0.0), (math.pi, 0.01), (3 * math.pi, 0.05)]) == pytest.approx(math.pi / 0.01)


@given(MODELS, shares)
def test_a_limit_is_a_share_of_the_most_and_never_more_than_its_owner_allows(model: ServoModel, share: float) -> None:
    full = model.to_raw("max_torque", 1.0)
    assert raw_limit(servo(model), full) == full
    assert model.to_si("torque_limit", raw_limit(servo(model, share), full)) == pytest.approx(share, abs=1e-3)
    assert raw_limit(servo(model, share), 100) <= 100


@pytest.mark.parametrize(("model", "raw"), [("AX-12", 614), ("XL-320", 614), ("XL430-W250", 531), ("PH54-200", 1205)])
def test_limits_are_written_by_the_sdk_and_again_after_a_reboot_or_a_loss_of_the_supply(model: str, raw: int) -> None:
    found = servo_models()[model]
    fake, joint_servo, limits = FakeServo(model, 1), servo(found, 0.6), TorqueLimits()
    with pseudo_terminal([fake]) as port, DynamixelBus(str(port.path), {1: found}, timeout=0.05) as bus:
        limits.write(bus, joint_servo)
        assert fake.get("torque_limit") == raw
        fake.reboot()
        assert fake.get("torque_limit") == fake.get("max_torque")
        values = bus.read([1], ["torque_limit", "present_temperature"])[1].values
        assert limits.keep(bus, joint_servo, values) == "servo 1 had lost its torque limit: it is written again"
        assert limits.keep(bus, joint_servo, values) == ""  # told once
        assert fake.get("torque_limit") == raw


@pytest.mark.parametrize("model", ["AX-12", "XL430-W250"])
def test_a_servo_that_had_no_supply_gets_its_limit_and_its_watchdog_back(model: str) -> None:
    driven = Driven(model)
    driven.cycle.watchdog = 0.2
    joint = driven.drive.joint
    driven.drive.joint = replace(joint, servos=(replace(joint.servos[0], torque=0.5),))
    driven.run(20)
    before = driven.servo.get("torque_limit")
    assert driven.servo.model.to_si("torque_limit", before) == pytest.approx(0.5, abs=1e-3)
    driven.servo.reboot()
    driven.run(20)
    assert driven.servo.get("torque_limit") == before
    assert driven.cycle.notes == ["servo 1 had lost its torque limit: it is written again"]
    assert model == "AX-12" or driven.servo.get("bus_watchdog") == 10


def test_a_servo_of_protocol_1_that_has_shut_down_pulls_again_after_it_is_enabled() -> None:
    driven = Driven("AX-12")
    driven.run(3)
    driven.drive.ask(MoveTo(0.5))
    driven.run(5)
    driven.servo.load = 2.0
    driven.run(5)
    assert (driven.mode, driven.servo.get("torque_limit")) == ("fault", 0)
    driven.servo.load = 0.0
    driven.run(5)
    driven.drive.ask(Enable(True))
    driven.run(2)
    driven.drive.ask(MoveTo(0.5))
    driven.run(200)
    assert driven.drive.measured.position == pytest.approx(0.5, abs=0.006)


@pytest.mark.parametrize("model", ["AX-12", "XL430-W250", "PH54-200"])
def test_a_servo_with_little_torque_jams_where_one_with_all_of_it_lifts(model: str) -> None:
    lifted = {}
    for share in (0.1, 1.0):
        fake = FakeServo(model, 1)
        bus = TwinBus([fake], lambda: 0.0)
        TorqueLimits().write(bus, servo(fake.model, share))
        fake.load = 0.5
        goal = fake.get("present_position") + fake.model.family.ticks // 10
        bus.write({1: {"torque_enable": 1}})
        bus.write({1: {"goal_position": goal}})
        for step in range(300):
            fake.step(0.01, 0.01 * step)
        lifted[share] = abs(fake.get("present_position") - goal) <= 1
    assert lifted == {0.1: False, 1.0: True}


def test_less_torque_is_slower() -> None:
    way = {}
    for share in (0.5, 1.0):
        fake = FakeServo("XL430-W250", 1)
        bus = TwinBus([fake], lambda: 0.0)
        TorqueLimits().write(bus, servo(fake.model, share))
        bus.write({1: {"torque_enable": 1}})
        bus.write({1: {"goal_position": 4000}})
        for _ in range(20):
            fake.step(0.01, 0.0)
        way[share] = fake.get("present_position") - fake.model.family.centre
    assert 0 < way[0.5] < 0.6 * way[1.0]
