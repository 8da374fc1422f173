"""An arm that is led by hand: whatever is commanded, it stays within its limits, hits nothing, and comes to rest."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.domains.arms.motion.collisions import TOUCH, MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.planner import MotionPlanner
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.teleoperation import CRUISE, LEAD, ServoMotion, TipServo, Wish
from rbxcompose.domains.body.model import Geometry
from tests.motion.test_inverse_kinematics import ARM
from tests.motion.test_tracing import READY, SIX
from tests.motion.toy_arm import Array, gap, kinematics, planner

TOY, PLANNER = kinematics(), planner()
PERIOD = 0.02
START = np.array([0.8, 0.0, 0.5])
FAST, HARD = np.full(3, 2.0), np.full(3, 4.0)


class Follower:
    """A controller that follows what is sent, exactly, and notes where the arm has been."""

    def __init__(self, servo: TipServo, start: Array, delay: float = 0.0) -> None:
        self.servo, self.now, self.delay = servo, 0.0, delay
        self.motion = ServoMotion.resting(0.0, start)
        self.coming: list[tuple[float, ServoMotion]] = []
        self.been: list[tuple[Array, Array]] = [(start, np.zeros(len(start)))]

    def step(self, wish: Wish | None) -> None:
        found = self.servo.next(self.now, self.been[-1][0], wish)
        if found is not None:
            self.coming.append((max(found.begin, self.now + self.delay), found))
        for _ in range(4):
            self.now += PERIOD / 4
            while self.coming and self.coming[0][0] <= self.now:
                self.motion = self.coming.pop(0)[1]
            self.been.append(self.motion.state(self.now))

    def rest(self) -> int:
        """Command nothing until it rests; return after how many steps."""
        for count in range(200):
            self.step(None)
            if not self.servo.is_moving and not self.been[-1][1].any():
                return count
        raise AssertionError("it does not come to rest")


def twist(*numbers: float) -> Wish:
    return lambda values: np.array((*numbers, 0.0, 0.0, 0.0))


Commands = list[tuple[tuple[float, ...] | None, int]]
twists = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))


@settings(max_examples=settings().max_examples // 2)
@given(st.lists(st.tuples(st.one_of(st.none(), twists), st.integers(1, 25)), min_size=1, max_size=6))
def test_whatever_is_commanded_it_keeps_its_limits_and_hits_nothing(
    commands: list[tuple[tuple[float, ...] | None, int]],
) -> None:
    arm = Follower(TipServo(TOY, PLANNER), START)
    for command, steps in commands:
        for _ in range(steps):
            arm.step(None if command is None else twist(*command))
    arm.rest()
    positions, velocities = (np.array(column) for column in zip(*arm.been, strict=True))
    assert np.all(positions >= PLANNER.space.lower)
    assert np.all(positions <= PLANNER.space.upper)
    assert np.all(np.abs(velocities) <= FAST)
    assert np.abs(np.diff(positions, axis=0)).max() <= 2.0 * PERIOD / 4 + 1e-9  # no jumps
    assert np.abs(np.diff(velocities, axis=0)).max() <= 4.0 * PERIOD / 4 + 1e-9
    assert min(gap(TOY.body, position) for position in positions) >= -TOUCH


def test_it_slows_down_and_stops_before_a_wall_and_leaves_it_again() -> None:
    arm = Follower(TipServo(TOY, PLANNER), START)

    def around(speed: float) -> Wish:
        return lambda values: speed * np.array((math.sin(values[0]), -math.cos(values[0]), 0.0, 0.0, 0.0, 0.0))

    for _ in range(200):
        arm.step(around(0.2))
        assert "halted" not in arm.servo.state or "ground" in arm.servo.state
    assert "'ground'" in arm.servo.state
    near = gap(TOY.body, arm.been[-1][0])
    assert 0.0 <= near < 0.03
    for _ in range(50):
        arm.step(around(-0.2))
    assert arm.servo.state == "moving"
    assert gap(TOY.body, arm.been[-1][0]) > near + 0.05


def test_the_tip_moves_as_it_is_told_with_its_turns() -> None:
    servo = TipServo(ARM, SIX)
    arm = Follower(servo, READY + np.array((0.0, 0.4, 0.0, 0.3, 0.0, 0.3)))
    wanted = np.array((0.05, -0.02, 0.03, 0.0, 0.0, 0.1))
    for _ in range(50):
        arm.step(lambda values: wanted)
    first, last = arm.been[-21][0], arm.been[-1][0]
    error, _ = ARM.error(first, ARM.placement(ARM.tip_pose(last)))
    turn = ARM.tip(first, with_jacobian=False)[1]
    assert np.allclose(turn @ error[:3] / (5 * PERIOD), wanted[:3], atol=2e-3)
    assert np.allclose(turn @ error[3:] / (5 * PERIOD), wanted[3:], atol=5e-3)


def test_without_commands_it_rests_as_soon_as_its_joints_can_and_without_this_program_a_little_later() -> None:
    for is_alive in (True, False):
        arm = Follower(TipServo(TOY, PLANNER), START)
        for _ in range(25):
            arm.step(twist(0.0, 0.3, 0.0))
        speed = float(np.abs(arm.been[-1][1]).max())
        begin = arm.now
        if is_alive:
            arm.rest()
        else:
            arm.been += [arm.motion.state(arm.now + after) for after in np.arange(0.0, 1.0, 0.005).tolist()]
        still = next(index for index, pair in enumerate(arm.been) if index > 100 and not pair[1].any())
        took = still * PERIOD / 4 - begin
        assert took <= speed / (4.0 * 0.95) + LEAD + PERIOD + (0.0 if is_alive else CRUISE)


def test_a_singularity_ahead_slows_it_down() -> None:
    arm = Follower(TipServo(TOY, PLANNER), np.array([0.8, 0.4, 0.8]))
    outwards = np.array((math.cos(0.8), math.sin(0.8), 0.0)) * 0.2
    states = set()
    for _ in range(200):
        arm.step(twist(*outwards))
        states.add(arm.servo.state)
    assert any("singularity" in state for state in states)
    assert np.abs(np.array([velocity for _, velocity in arm.been])).max() <= 2.0
    for _ in range(50):
        arm.step(twist(*(-outwards)))
    assert arm.been[-1][1].any()


def test_it_brakes_at_once_when_the_scene_changes_into_its_way() -> None:
    used = MotionPlanner(PLANNER.space, PLANNER.checker, PLANNER.settings, lambda: 0.0)
    arm = Follower(TipServo(TOY, used), START)
    for _ in range(30):
        arm.step(twist(0.0, 0.3, 0.0))
    ahead = TOY.tip_pose(arm.been[-1][0]).compose(TOY.tip_pose(START).inverse()).compose(TOY.tip_pose(START))
    block = PlacedObject("block", Geometry("sphere", (0.02,)), "ground", ahead)
    used.checker = MeshChecker(TOY, {}, adjacent_pairs(TOY.body), [block])
    begin, speed = len(arm.been), float(np.abs(arm.been[-1][1]).max())
    for _ in range(60):
        arm.step(twist(0.0, 0.3, 0.0))
    still = next(index for index in range(begin, len(arm.been)) if not arm.been[index][1].any())
    assert (still - begin) * PERIOD / 4 <= speed / (4.0 * 0.95) + LEAD + PERIOD + PERIOD / 4
    assert "block" in arm.servo.state


def test_an_arm_that_does_not_follow_is_not_led_on() -> None:
    servo = TipServo(TOY, PLANNER)
    sent = [servo.next(step * PERIOD, START, twist(0.0, 0.4, 0.0)) for step in range(60)]
    assert sent[0] is not None
    assert None in sent
    reached = max(float(np.max(np.abs(motion.way.positions[-1] - START))) for motion in sent if motion is not None)
    assert reached < 0.6
