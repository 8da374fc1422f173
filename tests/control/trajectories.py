"""Trajectories for tests, and joints that follow them."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.trajectory import (
    JointRules,
    TrajectoryGoal,
    TrajectoryPlan,
    TrajectoryPoint,
    TrajectoryPolicy,
    plan_trajectory,
)

NAMES = ("pan", "tilt")
FREE = MotionLimits(acceleration=8.0)
SLOW = MotionLimits(velocity=1.0, acceleration=4.0)
WIDE = MotionLimits(-3.0, 3.0, None, 8.0)
TIGHT = MotionLimits(-3.0, 3.0, 1.0, 4.0)
ZERO = {name: JointSample(0.0) for name in NAMES}
POSITIONS = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
VELOCITIES = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))


def rules(limits: MotionLimits = WIDE) -> dict[str, JointRules]:
    return {name: JointRules(limits) for name in NAMES}


def points(*rows: tuple[float, Sequence[float]]) -> tuple[TrajectoryPoint, ...]:
    """Return points with positions only, from their times and positions."""
    return tuple(TrajectoryPoint(time, tuple(positions)) for time, positions in rows)


def goal(*rows: tuple[float, Sequence[float]], start: float = 0.0) -> TrajectoryGoal:
    return TrajectoryGoal(NAMES, points(*rows), start)


def planned(
    trajectory_goal: TrajectoryGoal,
    limits: MotionLimits = WIDE,
    policy: TrajectoryPolicy | None = None,
    now: float = 0.0,
) -> TrajectoryPlan:
    """Return the plan from rest at zero; it must not be refused."""
    plan = plan_trajectory(trajectory_goal, now, ZERO, rules(limits), policy or TrajectoryPolicy())
    assert isinstance(plan, TrajectoryPlan), plan
    return plan


@st.composite
def goals(draw: st.DrawFn) -> TrajectoryGoal:
    """Draw trajectories that end at rest: positions only, with velocities, or with accelerations as well."""
    gaps = draw(st.lists(st.floats(0.2, 2.0), min_size=1, max_size=5))
    kind, made, time = draw(st.integers(0, 2)), [], 0.0
    for index, gap in enumerate(gaps, 1):
        time += gap
        moving = (0.0, 0.0) if index == len(gaps) else draw(VELOCITIES)
        velocities = moving if kind else ()
        accelerations = draw(VELOCITIES) if kind > 1 else ()
        made.append(TrajectoryPoint(time, draw(POSITIONS), velocities, accelerations))
    return TrajectoryGoal(NAMES, tuple(made))
