"""Promises of the states of a joint."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from rbxcompose.domains.servos.joint_states import (
    BringToRest,
    Enable,
    Hold,
    JointAction,
    JointCondition,
    JointInputs,
    JointMode,
    JointPolicy,
    JointRequest,
    MoveTo,
    Pursue,
    Refuse,
    Relax,
    ThermalPolicy,
    TorqueOff,
    TorqueOn,
    WriteGoal,
    step_joint,
)

POLICY = JointPolicy()
BLOCKED = (JointMode.DISABLED, JointMode.FAULT, JointMode.RESTING)


@dataclass
class Bench:
    """A joint with its servo: what is measured, and whether it has torque."""

    policy: JointPolicy = POLICY
    state: JointCondition = field(default_factory=JointCondition)
    now: float = 0.0
    position: float | None = 0.3
    measured_at: float = 0.0
    is_silent: bool = False
    temperature: float | None = 30.0
    error: str = ""
    is_limp: bool = False
    torque: bool | None = None
    goal: float | None = None
    actions: tuple[JointAction, ...] = field(default=())

    def step(self, *requests: JointRequest, dt: float = 0.01) -> tuple[JointAction, ...]:
        """Let `dt` [s] pass in one cycle; return what is done."""
        self.now += dt
        if not self.is_silent:
            self.measured_at = self.now
        inputs = JointInputs(self.position, self.measured_at, self.temperature, self.error, requests, self.is_limp)
        self.is_limp = False
        self.state, self.actions = step_joint(self.state, inputs, self.now, self.policy)
        for action in self.actions:
            self._apply(action)
        return self.actions

    def _apply(self, action: JointAction) -> None:
        match action:
            case WriteGoal(position=position):
                self.goal = position
            case TorqueOn():
                assert self.goal == self.state.position, "it snaps to an old goal"
                self.torque = True
            case TorqueOff():
                self.torque, self.goal = False, None
            case Pursue() | BringToRest():
                assert self.torque
            case Refuse(reason=reason):
                assert reason

    def mode(self) -> JointMode:
        return self.state.mode

    def refusal(self, request: JointRequest) -> str:
        """Return why a request is refused; empty if it is not."""
        return next((action.reason for action in self.step(request) if isinstance(action, Refuse)), "")


def active() -> Bench:
    bench = Bench()
    bench.step(MoveTo(1.0))
    assert bench.mode() == JointMode.ACTIVE
    return bench


class AnyJoint(RuleBasedStateMachine):
    """Anything happens to a joint, in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.bench = Bench()

    @rule(
        requests=st.lists(
            st.sampled_from([Enable(True), Enable(False), Relax(), Hold(), MoveTo(0.5), MoveTo(math.nan)]), max_size=3
        ),
        dt=st.sampled_from([0.01, 0.05, 0.6, 70.0]),
    )
    def cycle(self, requests: list[JointRequest], dt: float) -> None:
        self.bench.step(dt=dt)
        was_blocked = self.bench.state.is_blocked and not self.bench.state.has_lost_torque
        actions = self.bench.step(*requests, dt=0.0)
        if was_blocked and Enable(True) not in requests:
            assert not [action for action in actions if isinstance(action, WriteGoal | TorqueOn | Pursue)]
            refused = [action.request for action in actions if isinstance(action, Refuse)]
            assert len(refused) == sum(isinstance(request, Hold | MoveTo) for request in requests)

    @rule(position=st.sampled_from([None, 0.1, 0.2, math.nan]), is_silent=st.booleans())
    def measure(self, position: float | None, is_silent: bool) -> None:
        self.bench.position, self.bench.is_silent = position, is_silent

    @rule()
    def lose_torque(self) -> None:
        self.bench.is_limp = True

    @rule(temperature=st.sampled_from([None, 30.0, 50.0, 61.0]), error=st.sampled_from(["", "", "overload"]))
    def heat(self, temperature: float | None, error: str) -> None:
        self.bench.temperature, self.bench.error = temperature, error

    @invariant()
    def what_is_blocked_gets_neither_torque_nor_goals(self) -> None:
        if self.bench.mode() in BLOCKED:
            assert self.bench.torque is not True
            last = [action for action in self.bench.actions if isinstance(action, TorqueOn | TorqueOff)][-1:]
            assert last in ([], [TorqueOff()])

    @invariant()
    def torque_is_what_the_state_says(self) -> None:
        expected = {JointMode.RELAXED: False, JointMode.HOLDING: True, JointMode.ACTIVE: True}
        assert self.bench.torque == expected.get(self.bench.state.base, self.bench.torque)

    @invariant()
    def who_is_asked_in_vain_says_why(self) -> None:
        if self.bench.mode() in BLOCKED:
            assert self.bench.state.note


TestAnyJoint = AnyJoint.TestCase
TestAnyJoint.settings = settings(stateful_step_count=30)


def test_a_command_switches_torque_on_only_behind_the_measured_position_as_goal() -> None:
    bench = Bench()
    assert bench.step() == (TorqueOff(),)
    assert bench.mode() == JointMode.RELAXED
    assert bench.step(MoveTo(1.0)) == (WriteGoal(0.3), TorqueOn(), Pursue(MoveTo(1.0)))
    assert bench.step(MoveTo(1.1)) == (Pursue(MoveTo(1.1)),)


def test_a_joint_that_is_unknown_refuses_commands() -> None:
    bench = Bench(position=None)
    assert bench.refusal(MoveTo(1.0)) == "its position is not known"
    assert bench.mode() == JointMode.UNKNOWN


def test_a_robot_can_start_with_joints_that_hold() -> None:
    bench = Bench(JointPolicy(on_start="hold"))
    assert bench.step() == (WriteGoal(0.3), TorqueOn())
    assert bench.mode() == JointMode.HOLDING


def test_the_next_command_after_relax_switches_torque_on_again() -> None:
    bench = active()
    assert bench.step(Relax()) == (TorqueOff(),)
    assert bench.mode() == JointMode.RELAXED
    bench.position = 0.7
    assert bench.step(MoveTo(1.0)) == (WriteGoal(0.7), TorqueOn(), Pursue(MoveTo(1.0)))


def test_a_disabled_joint_refuses_commands_until_it_is_enabled() -> None:
    bench = active()
    assert bench.step(Enable(False)) == (TorqueOff(),)
    assert bench.refusal(MoveTo(1.0)) == "it is disabled"
    assert bench.step(Enable(True)) == ()
    assert bench.mode() == JointMode.RELAXED
    assert bench.refusal(MoveTo(1.0)) == ""


def test_hold_brings_a_moving_joint_to_rest_and_a_relaxed_one_to_hold() -> None:
    bench = active()
    assert bench.step(Hold()) == (BringToRest(),)
    assert bench.step(Hold()) == ()
    bench.step(Relax())
    assert bench.step(Hold()) == (WriteGoal(0.3), TorqueOn())


def test_a_stale_measurement_holds_the_joint_then_is_a_fault_which_ends_relaxed() -> None:
    bench = active()
    bench.is_silent = True
    for _ in range(3):
        assert bench.step() == ()
    assert bench.step() == (BringToRest(),)
    assert bench.mode() == JointMode.HOLDING
    assert bench.refusal(MoveTo(1.0)) == "its measured position is 0.050 s old"
    assert bench.step(dt=0.5) == (TorqueOff(),)
    assert bench.mode() == JointMode.FAULT
    assert bench.step() == ()
    bench.is_silent = False
    assert bench.step() == (TorqueOff(),)
    assert bench.mode() == JointMode.RELAXED


def test_a_servo_that_comes_back_is_relaxed_first_even_if_joints_start_with_torque() -> None:
    bench = Bench(JointPolicy(on_start="hold"))
    bench.step()
    bench.is_silent = True
    bench.step(dt=0.6)
    bench.is_silent = False
    assert bench.step() == (TorqueOff(),)


def test_a_disabled_servo_that_comes_back_is_relaxed_again() -> None:
    bench = active()
    bench.step(Enable(False))
    bench.is_silent = True
    bench.step(dt=0.6)
    bench.is_silent = False
    assert bench.step() == (TorqueOff(),)
    assert bench.mode() == JointMode.DISABLED


def test_an_error_of_the_hardware_stays_a_fault_until_it_is_mended_and_the_joint_enabled() -> None:
    bench = active()
    bench.error = "overload"
    assert bench.step() == (TorqueOff(),)
    assert bench.mode() == JointMode.FAULT
    assert bench.refusal(Enable(True)) == "the servo still reports overload; if it has shut down, reboot it"
    bench.error = ""
    assert bench.refusal(MoveTo(1.0)).startswith("the servo reported overload; when that is mended, enable the joint")
    assert bench.refusal(Enable(True)) == ""
    assert bench.mode() == JointMode.RELAXED


def test_a_joint_whose_servo_has_lost_its_torque_is_a_fault_for_one_cycle_and_relaxed() -> None:
    bench = active()
    bench.is_limp = True
    assert "has lost its torque" in bench.refusal(MoveTo(1.0))
    assert (bench.mode(), bench.torque) == (JointMode.FAULT, False)
    bench.is_limp = True  # which nobody expects otherwise now
    assert bench.step() == ()
    assert bench.mode() == JointMode.RELAXED
    assert "has lost its torque" in bench.state.note  # until something is done about it
    assert bench.step(MoveTo(1.0)) == (WriteGoal(0.3), TorqueOn(), Pursue(MoveTo(1.0)))
    assert bench.state.note == ""


def test_a_hot_joint_rests_until_both_the_time_is_over_and_it_has_cooled_down_and_then_recovers() -> None:
    bench = active()
    bench.temperature = 60.0
    assert bench.step() == ()
    assert bench.state.note == "60 degC is above 50 degC"
    bench.temperature = 61.0
    assert bench.step() == (TorqueOff(),)
    assert bench.mode() == JointMode.RESTING
    bench.temperature = 40.0
    assert bench.refusal(MoveTo(1.0)) == "it was too hot and rests for 60 s, then until 45 degC: it has 40 degC"
    bench.temperature = 46.0
    bench.step(dt=60.0)
    assert bench.mode() == JointMode.RESTING
    bench.temperature = None
    bench.step()
    assert bench.mode() == JointMode.RESTING
    bench.temperature = 45.0
    bench.step()
    assert bench.mode() == JointMode.RELAXED
    assert bench.refusal(MoveTo(1.0)) == ""


def test_enabling_does_not_end_a_rest() -> None:
    bench = active()
    bench.temperature = 70.0
    bench.step(Enable(False))
    assert bench.mode() == JointMode.DISABLED
    bench.step(Enable(True))
    assert bench.mode() == JointMode.RESTING


@pytest.mark.parametrize("position", [math.nan, math.inf])
def test_a_command_that_is_no_number_is_refused_and_changes_nothing(position: float) -> None:
    bench = active()
    before = bench.state
    assert "finite" in bench.refusal(MoveTo(position))
    assert replace(bench.state, measured_at=before.measured_at) == before


def test_a_reading_that_is_no_number_counts_as_none_and_not_as_a_fault() -> None:
    bench = active()
    bench.position = math.nan
    assert bench.step() == ()
    assert bench.mode() == JointMode.ACTIVE
    bench.step(dt=0.6)
    assert bench.state.note == "nothing has been measured for 0.61 s"


def test_policies_that_contradict_themselves_are_refused() -> None:
    with pytest.raises(ValueError, match="'resume' is below 'limit'"):
        ThermalPolicy(resume=60.0)
    with pytest.raises(ValueError, match="stale before"):
        JointPolicy(cycle=0.2, fault_after=0.5)
