"""What the other modes of a mux promise, what follows the last command, and hand-overs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.muxes.core import MuxAccount, StampedTwistRamp, grown, is_zeroed, rest_of, zeroed
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped, Vector3
from rbxcompose.msgs.std_msgs import Float64, Float64MultiArray, Header
from tests.mux.velocities import Driven, Input, twist

HIGH: Input = {"priority": 100, "timeout": 0.5}
LOW: Input = {"priority": 10, "timeout": 0.5}
BOTH = {"high": HIGH, "low": LOW}
TIMED: dict[str, Input] = {"joystick": {"timeout": 0.5}, "planner": {"timeout": 0.5}}


def test_whoever_sent_last_holds() -> None:
    mux = Driven(TIMED, mode="latest")
    assert mux.send(0.0, "planner", 1.0)
    assert mux.send(0.1, "joystick", 2.0)
    assert mux.core.active == "joystick"
    assert mux.send(0.2, "planner", 1.0)
    mux.at(5.0)
    assert mux.speeds == [1.0, 2.0, 1.0, 0.0]


def test_when_the_latest_lets_go_the_one_before_holds_again() -> None:
    mux = Driven({"joystick": {"timeout": 0.5, "zero_releases": True}, "planner": {"timeout": 0.5}}, mode="latest")
    mux.send(0.0, "planner", 1.0)
    mux.send(0.1, "joystick", 2.0)
    mux.send(0.2, "joystick", 0.0)
    assert mux.core.active == "planner"


def test_what_is_selected_stops_when_it_is_deselected_or_silent_for_its_timeout() -> None:
    mux = Driven({"one": {"timeout": 0.5}, "two": {}}, mode="select")
    mux.send(0.0, "one", 1.0)
    mux.at(0.6)
    assert mux.speeds == [1.0, 0.0]
    mux.core.select("two", 0.7)
    mux.send(0.8, "two", 2.0)
    mux.core.select(None, 0.9)
    mux.at(1.0)
    assert mux.speeds == [1.0, 0.0, 2.0, 0.0]


def test_a_zero_that_releases_gets_through_and_the_lower_source_follows_at_once() -> None:
    mux = Driven({"high": HIGH | {"zero_releases": True}, "low": LOW})
    mux.send(0.0, "high", 2.0)
    assert mux.send(0.1, "high", 0.0)
    assert mux.send(0.11, "low", 1.0)
    assert not mux.send(0.12, "high", 0.0)  # it rests already, and takes nothing from who holds
    assert mux.core.active == "low"


def test_after_a_zero_that_released_no_second_zero_follows() -> None:
    mux = Driven({"high": HIGH | {"zero_releases": True}})
    mux.send(0.0, "high", 2.0)
    mux.send(0.1, "high", 0.0)
    mux.at(5.0)
    assert mux.speeds == [2.0, 0.0]


@pytest.mark.parametrize(("ending", "stop"), [("stop", 0.5), ("none", None), ({"hold": 0.3}, 0.8)])
def test_what_follows_the_last_command_when_its_source_falls_silent(ending: object, stop: float | None) -> None:
    mux = Driven(BOTH, on_idle=ending, on_lock="none")
    mux.send(0.0, "low", 1.0)
    mux.at(5.0)
    assert [time for time, speed in mux.out if not speed] == ([] if stop is None else [pytest.approx(stop, abs=1e-9)])


@pytest.mark.parametrize(("ending", "stop"), [("stop", 0.2), ("none", None), ({"hold": 0.2}, 0.4)])
def test_what_follows_the_last_command_when_its_source_is_locked(ending: object, stop: float | None) -> None:
    mux = Driven(BOTH, on_lock=ending, on_idle="none", locks={"pause": {"topic": "pause", "priority": 50}})
    mux.send(0.0, "low", 1.0)
    mux.flag(0.2, "pause", is_on=True)
    mux.at(5.0)
    assert [time for time, speed in mux.out if not speed] == ([] if stop is None else [pytest.approx(stop, abs=1e-9)])


def test_a_source_that_comes_in_time_makes_the_stop_after_a_hold_needless() -> None:
    mux = Driven(BOTH, on_idle={"hold": 0.3})
    mux.send(0.0, "high", 1.0)
    mux.send(0.7, "low", 0.5)
    mux.at(1.1)
    assert mux.speeds == [1.0, 0.5]


def test_a_lock_by_hand_stops_at_once_and_ends_by_hand_or_at_its_time() -> None:
    mux = Driven(BOTH)
    for until in (math.inf, 2.0):
        now = mux.now + 0.1
        mux.send(now, "low", 1.0)
        mux.core.lock(["low"], until, now)
        mux.take(mux.core.tick(now))
        assert mux.speeds[-1] == 0.0
        assert MuxAccount(mux.core).why(now) == "low is locked by hand"
        assert not mux.send(now + 0.1, "low", 1.0)
        assert mux.send(now + 0.1, "high", 2.0)
        if until == math.inf:
            mux.core.unlock(["low"], now + 0.1)
        mux.at(max(now + 0.7, 2.0 if until == 2.0 else 0.0))
        assert mux.core.locks.by_hand == {}
        assert mux.send(mux.now, "low", 1.0)  # it was silent for its timeout


def test_who_unlocks_by_hand_lets_an_input_go_on_at_once() -> None:
    mux = Driven(BOTH)
    mux.core.lock(["low"], math.inf, 0.0)
    assert not mux.send(0.1, "low", 1.0)
    mux.core.unlock(["low"], 0.2)
    assert mux.send(0.3, "low", 1.0)


def test_what_went_on_until_the_time_of_a_lock_by_hand_is_over_must_come_to_rest_once() -> None:
    mux = Driven(BOTH)
    mux.core.lock(["low"], 0.5, 0.0)
    for step in range(1, 20):
        assert not mux.send(step * 0.1, "low", 1.0)
    assert MuxAccount(mux.core).state_of("low", mux.now)[0] == "must rest"
    assert mux.send(2.0, "low", 0.0)
    assert mux.send(2.1, "low", 1.0)


def test_for_messages_without_rest_nothing_is_made_up() -> None:
    mux = Driven({"one": LOW}, message="std_msgs/msg/Float64")
    assert mux.core.receive("one", Float64(data=1.0), 0.0) == Float64(data=1.0)
    assert mux.core.tick(9.0) is None
    assert mux.core.stop(9.1) is None
    assert mux.core.receive("one", Float64(data=1.0), 9.2) is None
    mux.core.release(9.3)
    assert mux.core.receive("one", Float64(data=0.0), 9.4) is None  # a zero is a command here
    assert mux.core.receive("one", Float64(data=1.0), 10.0) == Float64(data=1.0)


def test_rest_has_the_shape_of_the_last_command() -> None:
    velocities = Float64MultiArray(data=np.array([0.1, 0.2]))
    assert list(rest_of(Float64MultiArray)(velocities).data) == [0.0, 0.0]  # type: ignore[attr-defined]
    assert not is_zeroed(velocities)
    stamped = TwistStamped(header=Header(frame_id="base"), twist=twist(1.0))
    assert zeroed(stamped) == TwistStamped(header=Header(frame_id="base"))
    assert is_zeroed(zeroed(stamped))


def test_after_a_hand_over_the_output_grows_slowly_and_is_then_free() -> None:
    mux = Driven(BOTH, handover={"linear": 1.0})
    mux.send(0.0, "low", 0.2)
    for step in range(6):
        mux.send(0.1 + step * 0.1, "high", 0.5)
    assert mux.speeds == pytest.approx([0.2, 0.2, 0.3, 0.4, 0.5, 0.5, 0.5])
    mux.send(0.7, "high", 0.9)
    assert mux.speeds[-1] == 0.9


def test_a_hand_over_delays_no_stop_and_nothing_that_is_slower() -> None:
    mux = Driven(BOTH, handover={"linear": 1.0})
    mux.send(0.0, "low", 0.5)
    assert mux.send(0.1, "high", 0.1)
    mux.send(0.2, "high", 0.0)
    assert mux.speeds == [0.5, 0.1, 0.0]
    mux.send(0.9, "low", 0.5)
    assert mux.speeds[-1] == 0.5  # from rest there is no hand-over


SPEED = st.floats(-2.0, 2.0)


@given(SPEED, SPEED, st.floats(0.0, 1.0))
def test_nothing_that_grows_is_faster_than_it_was_wanted_or_turns_round_in_between(
    last: float, wanted: float, most: float
) -> None:
    out = grown(last, wanted, most)
    assert abs(out) <= abs(wanted)
    assert out * wanted >= 0
    assert abs(out) <= max(abs(last) + most, most)
    assert grown(last, 0.0, most) == 0.0


def test_a_ramp_of_stamped_velocities_keeps_the_stamps_of_the_commands() -> None:
    ramp = StampedTwistRamp(1.0, 1.0)
    ramp.begin(TwistStamped(twist=twist(0.1)), 0.0)
    command = TwistStamped(header=Header(frame_id="base"), twist=Twist(linear=Vector3(x=1.0), angular=Vector3(z=1.0)))
    out = ramp.through(command, 0.1)
    assert out.header == command.header
    assert (out.twist.linear.x, out.twist.angular.z) == pytest.approx((0.2, 0.1))
