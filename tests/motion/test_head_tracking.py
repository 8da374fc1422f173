"""How a head follows: within its limits, and calmly without a target."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.arms.motion.gaze import HeadTracker, HeadTrackingState
from rbxcompose.domains.arms.section_models import HeadTracking
from rbxcompose.domains.servos.limits import MotionLimits

LIMITS = {"pan": MotionLimits(-2.0, 2.0), "tilt": MotionLimits(-1.0, 1.0)}
DT = 0.05
MODES = pytest.mark.parametrize("mode", ["position", "speed"])
ANGLES = st.floats(-3, 3)


class Follower:
    """Joints that are where they were told to be one cycle before."""

    def __init__(self, pan: MotionLimits = LIMITS["pan"], **settings: Any) -> None:
        self.settings, self.tracker = HeadTracking(**settings), HeadTracker({**LIMITS, "pan": pan})
        self.at, self.time = {"pan": 0.0, "tilt": 0.0}, 0.0

    def cycle(self, pan: float | None = None, tilt: float = 0.0) -> dict[str, float] | None:
        if pan is not None:
            self.tracker.see({"pan": pan, "tilt": tilt}, self.time)
        told = self.tracker.update(self.settings, self.time, DT, self.at)
        self.time += DT
        if told is not None:
            self.at = told
        return told


@MODES
@given(path=st.lists(st.tuples(ANGLES, ANGLES) | st.none(), min_size=1, max_size=60))
def test_it_stays_within_limits_and_moves_no_faster_than_it_may(
    mode: str, path: list[tuple[float, float] | None]
) -> None:
    follower = Follower(mode=mode, search=1.0, recentre=0.5)
    for point in path:
        before = follower.at
        told = follower.cycle(*point) if point is not None else follower.cycle()
        for name, position in (told or {}).items():
            assert LIMITS[name].least <= position <= LIMITS[name].greatest
            step = follower.settings.speed * DT if mode == "speed" else follower.settings.ahead
            assert abs(position - before[name]) <= step + 1e-9


@MODES
@given(pan=st.floats(-1.9, 1.9), tilt=st.floats(-0.9, 0.9))
def test_it_comes_to_a_target_that_stands(mode: str, pan: float, tilt: float) -> None:
    follower = Follower(mode=mode)
    for _ in range(100):
        follower.cycle(pan, tilt)
    assert follower.at == pytest.approx({"pan": pan, "tilt": tilt}, abs=0.01)
    assert follower.tracker.state is HeadTrackingState.FOLLOWS


@MODES
def test_within_its_threshold_it_rests(mode: str) -> None:
    follower = Follower(mode=mode, threshold="0.1 rad")
    for _ in range(20):
        follower.cycle(0.08)
    assert follower.at["pan"] == 0.0


def test_without_its_target_it_slows_down_and_then_looks_ahead() -> None:
    follower = Follower(lost=0.2, recentre=1.0)
    for cycle in range(20):
        follower.cycle(0.06 * cycle)
    places, states = [follower.at["pan"]], []
    for _ in range(200):
        follower.cycle()
        places.append(follower.at["pan"])
        states.append(follower.tracker.state)
    assert list(dict.fromkeys(states)) == ["follows", "slows down", "recentres", "rests"]
    slows = states.index(HeadTrackingState.SLOWS)
    speeds = [abs(b - a) for a, b in zip(places[slows:], places[slows + 1 :], strict=False)]
    assert speeds[:10] == sorted(speeds[:10], reverse=True)
    assert abs(places[-1]) < 0.03


@pytest.mark.parametrize(
    ("least", "greatest", "right", "left"), [(-2.0, 2.0, -1.2, 1.2), (0.2, 1.4, 0.25, 1.35), (-1.4, -0.2, -1.35, -0.25)]
)
def test_it_looks_around_to_both_sides_before_that(least: float, greatest: float, right: float, left: float) -> None:
    follower = Follower(MotionLimits(least, greatest), lost=0.2, recentre=0.2, search=20.0)
    follower.cycle(0.3)
    pans = []
    for _ in range(420):
        follower.cycle()
        pans.append(follower.at["pan"])
    seen = pans[80:380]  # it has been at a limit or a quarter turn, and looks around still
    assert max(seen) > left
    assert min(seen) < right


def test_it_looks_around_though_a_joint_rests_a_hair_beyond_its_limit() -> None:
    follower = Follower(mode="position", lost=0.2, recentre=0.2, search=20.0)
    follower.cycle(0.3)
    for _ in range(60):
        follower.at = {**follower.at, "tilt": 1.0016}
        told = follower.cycle()
        assert told is None or told["tilt"] <= 1.0
    assert follower.tracker.state is HeadTrackingState.SEARCHES


@pytest.mark.parametrize(("search", "state"), [(20.0, "searches"), (0.0, "recentres")])
def test_joints_that_were_held_go_on_calmly(search: float, state: str) -> None:
    follower = Follower(lost=0.2, recentre=0.2, search=search)
    follower.cycle(0.3)
    follower.at = {"pan": 1.5, "tilt": 0.0}
    for _ in range(80):
        told = follower.cycle()
        follower.at = {"pan": 1.5, "tilt": 0.0}
        if told is not None and follower.tracker.state == state:
            assert abs(told["pan"] - 1.5) < 0.2
    assert follower.tracker.state == state


def test_what_leaps_is_another_target_and_does_not_throw_the_head() -> None:
    follower = Follower(mode="position", gain=1.0)
    for _ in range(10):
        follower.cycle(0.0)
    follower.cycle(1.0)
    follower.cycle(1.0)
    assert follower.at["pan"] <= 1.0 + 1e-9
    assert not math.isnan(follower.at["tilt"])
