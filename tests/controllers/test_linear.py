"""A joint that slides, on a bench: it goes where it should, tells how that ended, and keeps its limits."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.msgs.builtin_interfaces import Duration
from rbxcompose.msgs.control_msgs import SingleJointPosition as Move
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.std_srvs import SetBool, Trigger
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.soak import rare

TRAVEL = 0.04  # [m] for each turn
TABLE = [(0.0, 0.0), (math.tau, 0.03), (2 * math.tau, 0.08)]  # a lever: not straight
SETTINGS = {"type": "linear", "joint": "lift_joint", "speed": "2 cm/s", "dead_band": "2 mm"}


class Lift:
    """A lift of 8 cm, at first about 2 cm up."""

    def __init__(self, *, model: str = "XL430-W250", settings: Any = None, **joint: Any) -> None:
        shape = {"ratio": math.tau / TRAVEL} if "calibration" not in joint else {}
        servos = [{"id": 1, "model": model, "neutral": 0}]
        config = {
            "twin": "servo",
            "joints": {
                "lift_joint": {"mode": "velocity", "lower": 0.0, "upper": 0.08, "servos": servos, **shape, **joint}
            },
            "controllers": {"lift": {"type": "linear", "settings": {**SETTINGS, **(settings or {})}}},
        }
        self.bench = Bench(instance("servos", "servo_bus", config), start=False)
        self.states = self.bench.collect("/joint_states", JointState)
        self.commands = self.bench.bus.publisher("me", "/lift/command", Float64, Qos.COMMAND)
        self.goals = self.bench.bus.action_client("me", "/lift/move", Move)
        self.ended: Ended[Move.Result] | None = None
        self.fed: list[Move.Feedback] = []
        self.driver: Any = self.bench.component("servos")
        self.bench.advance(0.2)

    @property
    def at(self) -> float:
        return float(self.states[-1].position[0])

    @property
    def note(self) -> str:
        return str(self.driver.controllers.controllers["lift"].note)

    def go(self, position: float, **goal: Any) -> Any:
        self.ended = None
        return self.goals(Move.Goal(position=position, **goal), self._over, self.fed.append)

    def _over(self, ended: Ended[Move.Result]) -> None:
        self.ended = ended

    @property
    def outcome(self) -> Outcome | None:
        return self.ended.outcome if self.ended else None

    def command(self, position: float, seconds: float) -> None:
        self.commands(Float64(data=position))
        self.bench.advance(seconds)


@pytest.mark.parametrize("joint", [{}, {"calibration": TABLE}, *rare({"acceleration": 0.05})], ids=str)
@pytest.mark.parametrize("model", ["XL430-W250", *rare("MX-28")])
def test_it_goes_where_it_should(model: str, joint: dict[str, Any]) -> None:
    lift = Lift(model=model, **joint)
    for wanted in (0.06, 0.01):
        lift.go(wanted)
        assert lift.bench.run_until(lambda: lift.outcome is not None, 6.0)
        assert lift.outcome is Outcome.SUCCEEDED
        assert lift.at == pytest.approx(wanted, abs=0.001)
    if model == "XL430-W250" and not joint:
        assert max(abs(feedback.velocity) for feedback in lift.fed) == pytest.approx(0.02, abs=2e-4)
    assert lift.fed[-1].error == pytest.approx(0.0, abs=0.01)


def test_a_command_on_its_topic_is_cut_to_the_limits_and_ends_a_goal() -> None:
    lift = Lift()
    lift.go(0.06)
    lift.bench.advance(0.5)
    lift.command(0.5, 6.0)
    assert lift.outcome is Outcome.ABORTED
    assert lift.at == pytest.approx(0.08, abs=0.001)
    assert lift.note == "0.5 m was cut to 0.08 m"
    lift.command(0.05, 3.0)
    assert lift.note == ""


def test_a_goal_may_be_slower() -> None:
    for goal in ({"max_velocity": 0.01}, {"min_duration": Duration(sec=4)}):
        lift = Lift()
        lift.go(0.06, **goal)
        lift.bench.advance(3.5)
        assert lift.outcome is None
        lift.bench.advance(2.0)
        assert lift.outcome is Outcome.SUCCEEDED


@pytest.mark.parametrize(
    ("goal", "reason"),
    [({"position": math.nan}, "nan"), ({"position": 0.2}, "outside of 0 m to 0.08 m"), ({"max_velocity": -1.0}, "-1")],
)
def test_goals_that_make_no_sense_are_refused_with_the_reason(goal: dict[str, float], reason: str) -> None:
    lift = Lift()
    before = lift.at
    lift.go(**({"position": 0.05} | goal))
    lift.bench.advance(1.0)
    assert lift.outcome is Outcome.REJECTED
    assert any(reason in text for text in lift.bench.texts())
    assert lift.at == before


def test_a_joint_that_is_stuck_fails_with_the_reason_and_can_go_on_later() -> None:
    lift = Lift()
    servo = lift.driver.cycle.bus.line.servos[0]
    lift.go(0.06)
    lift.bench.advance(0.5)
    servo.faults.is_jammed = True
    lift.bench.advance(2.5)
    assert lift.outcome is Outcome.ABORTED
    assert lift.note.startswith("it has not moved for 2 s")
    assert servo.get("goal_velocity") == 0
    servo.faults.is_jammed = False
    lift.go(0.06)
    lift.bench.advance(4.0)
    assert lift.at == pytest.approx(0.06, abs=0.001)


@pytest.mark.parametrize("how", ["enable", "relax", "stop"])
def test_a_joint_that_may_not_move_ends_its_way_and_stays_there(how: str) -> None:
    lift = Lift()
    lift.go(0.06)
    lift.bench.advance(0.5)
    client = lift.bench.bus.client
    if how == "enable":
        client("me", "/lift_joint/enable", SetBool)(SetBool.Request(data=False), lambda reply: None)
    elif how == "relax":
        client("me", "/lift_joint/relax", Trigger)(Trigger.Request(), lambda reply: None)
    else:
        lift.bench.host.stop()
    lift.bench.advance(0.1)
    there = lift.at
    lift.bench.advance(2.0)
    assert lift.outcome is not Outcome.SUCCEEDED
    assert lift.at == pytest.approx(there, abs=1e-4)
    assert there < 0.05
    if how == "enable":
        lift.command(0.06, 1.0)
        assert "disabled" in lift.note
        assert lift.at == pytest.approx(there, abs=1e-4)


def test_a_canceled_goal_stops_it() -> None:
    lift = Lift()
    sent = lift.go(0.06)
    lift.bench.advance(0.5)
    sent.cancel()
    lift.bench.advance(0.1)
    there = lift.at
    lift.bench.advance(1.0)
    assert lift.outcome is Outcome.CANCELED
    assert lift.at == there


@settings(max_examples=settings().max_examples // 2)
@given(
    asked=st.lists(st.tuples(st.floats(-0.2, 0.3) | st.just(math.inf), st.floats(0.05, 3.0)), min_size=1, max_size=6)
)
def test_whatever_is_commanded_it_keeps_its_limits(asked: list[tuple[float, float]]) -> None:
    lift = Lift(velocity=0.015)
    for position, seconds in asked:
        lift.command(position, seconds)
    tick, late = TRAVEL / 4096, 0.015 * 0.03  # [m], what it does within the lag of a motor
    for state in lift.states:
        assert -late <= state.position[0] <= 0.08 + late
        assert abs(state.velocity[0]) <= 0.015 + 2 * tick / 0.01
