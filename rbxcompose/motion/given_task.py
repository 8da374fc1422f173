"""Carries out a motion that was planned elsewhere, once it is verified as our own are."""

from __future__ import annotations

from functools import partial

import numpy as np

from rbxcompose.motion.arm_task import MOVED, ArmTask
from rbxcompose.motion.parametrisation import Trajectory, speeds_of
from rbxcompose.motion.planner import FINE, MotionPlan, Planning, mistake_in_start
from rbxcompose.motion.reasons import MotionFailure, MotionReason
from rbxcompose.motion.recheck import examined

MOST_EXCESS = 1.01  # times the limits of speed and acceleration, which others round otherwise


class GivenTask(ArmTask):
    """A goal whose trajectory is `given`: it is examined, and followed if it is free and within all limits."""

    given: Trajectory

    def _begin_planning(self) -> None:
        self._start = self._where()
        self._site.told("planning")
        self._kinematics.place(
            {name: at for name, (at, _) in self._site.measured.items() if name not in self.space.names}
        )
        self._stage = partial(self._continue_planning, self._verified())
        self._stage()

    def _verified(self) -> Planning:
        """Return the trajectory as a plan, or what is wrong with it."""
        checker, given = self._planner.checker, self.given
        away = float(np.max(np.abs(given.positions[0] - self._start)))
        if away > MOVED:
            words = f"the motion begins up to {away:.3f} away from where joints are"
            return MotionFailure(MotionReason.START_MOVED, words)
        if (failure := mistake_in_start(self.space, checker, self._start)) is not None:
            return failure
        if len(given.times) > 1 and (excess := given.excess(*speeds_of(self.space, 1.0, 1.0))) > MOST_EXCESS:
            words = f"it exceeds a limit of speed or acceleration: it would have to take {excess:.2f} times as long"
            return MotionFailure(MotionReason.NO_TIMING, words)
        points = given.dense(FINE)[1:]
        rejected = yield from examined(points, self.space, checker)
        if rejected is not None:
            return MotionFailure(MotionReason.PATH_IN_COLLISION, rejected.text)
        return MotionPlan(given if len(given.times) > 1 else None, given.positions, 1, len(points))
