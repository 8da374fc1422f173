"""One goal of an arm, from the request to the end of the motion; time and messages come from outside."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import field, replace
from functools import partial
from typing import Protocol, TypeVar

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion import inverse_kinematics
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import pairs_shown
from rbxcompose.domains.arms.motion.groups import JointSpace
from rbxcompose.domains.arms.motion.inverse_kinematics import Posture, kept_solutions, searched
from rbxcompose.domains.arms.motion.parametrisation import Trajectory, speeds_of
from rbxcompose.domains.arms.motion.path_constraints import Keep, KeptTip
from rbxcompose.domains.arms.motion.planner import (
    FINE,
    MotionPlan,
    MotionPlanner,
    MotionRequest,
    Planning,
    examined,
    mistake_in_start,
)
from rbxcompose.domains.arms.motion.trace_planner import TraceWish, planned_trace
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason


@dataclass(frozen=True, slots=True)
class ArmGoal:
    """What is asked for: a pose by name and positions of joints [rad or m] beside it, or a target for the tip."""

    pose: str = ""
    positions: Mapping[str, float] = field(default_factory=dict)
    target: inverse_kinematics.PoseTarget | None = None
    frame: str = ""
    """The link in whose frame the target is; without it, the root."""
    speed: float = 1.0
    acceleration: float = 1.0
    trace: TraceWish | None = None
    """A way of the tip, instead of the others."""
    tolerance: float = 0.0
    """By which joints may be elsewhere at the end if they cannot be there [rad or m]."""
    keep: Keep = Keep()
    """On the whole way."""
    replans: int = 0
    """How often it is planned again because the scene has changed on the way."""
    prefer: str = ""
    """The pose of the arm that its joints should be near to where several positions do for a target."""

    def mistake(self, kinematics: ArmKinematics, poses: Collection[str]) -> str:
        """Return what is wrong with it for an arm that has poses of these names, or nothing."""
        for word, share in (("speed", self.speed), ("acceleration", self.acceleration)):
            if not (math.isfinite(share) and 0.0 < share <= 1.0):
                return f"the {word} must be above 0 % and at most 100 %, not {share:.0%}"
        if problem := self.keep.mistake(kinematics):
            return problem
        aim = self.trace or self.target
        name = self.prefer if aim is not None else self.pose
        if name and name not in poses:
            return f"there is no pose '{name}'; the poses of this arm: {', '.join(poses) or 'none'}"
        if aim is not None:
            is_known = not self.frame or self.frame in kinematics.body.links
            return aim.mistake or self._mixed if is_known else f"there is no link '{self.frame}'"
        if not self.tolerance >= 0.0:
            return "a tolerance is below 0"
        if not (self.pose or self.positions):
            return "the goal has neither a pose nor positions of joints"
        unknown = [name for name in self.positions if name not in kinematics.group.joints]
        return unknown_joint(unknown[0], kinematics.group.joints) if unknown else ""

    @property
    def _mixed(self) -> str:
        if self.target is None or not (self.target.is_approximate and self.keep.is_about_tip):
            return ""
        return "what 'keep' asks of the tip is not possible together with 'approximate'"


def unknown_joint(name: str, joints: Collection[str]) -> str:
    """Return the words about a joint that an arm does not have."""
    return clauses(f"'{name}' is no joint of this arm", suggest(name, joints, "its joints"))


T = TypeVar("T")
Solving = Generator[None, None, inverse_kinematics.PoseSolutions]

MOVED = 0.035  # [rad or m] by which a joint may be elsewhere when a motion begins than when it was planned
AT_REST, CALM = 0.05, 0.2  # [rad/s or m/s], [s]; a joint that is faster is at rest if it gets nowhere for this long
SETTLING = 3.0  # [s] that an arm may take to report itself, and to come to rest
REPLANS = 2  # times that a motion is planned again because the arm was elsewhere
NEARBY = 200  # positions that are tried for a goal with a tolerance
OTHER_AIMS = (MotionReason.NO_PATH_IN_TIME, MotionReason.PATH_IN_COLLISION, MotionReason.NOT_KEPT)  # may help
SLICES = 16  # of planning in one call, so that the same goal takes the same time on a stepped clock
LONGEST_CALL = 0.2  # [s] of planning in one call, after which others may run


def gone_on(work: Generator[None, None, T], now: Callable[[], float], most: int) -> list[T]:
    """Go on with work for so many slices at most, unless that takes long; return its result, once it has one."""
    begin = now()
    for _ in range(most):
        try:
            next(work)
        except StopIteration as ended:
            return [ended.value]
        if now() - begin >= LONGEST_CALL:
            break  # others may run
    return []


class ArmSite(Protocol):
    """What a goal needs of the component that carries it out."""

    @property
    def now(self) -> float:
        """Return robot time [s]."""

    @property
    def measured(self) -> Mapping[str, tuple[float, float]]:
        """Return the position and velocity of each joint of the body that has reported them."""

    @property
    def poses(self) -> Mapping[str, Mapping[str, float]]:
        """Return the poses by name: positions of joints [rad or m]."""

    @property
    def is_ready(self) -> bool:
        """Return whether it is known what is around the robot."""

    @property
    def problem(self) -> str:
        """Return why that is not known."""

    def follow(self, names: tuple[str, ...], trajectory: Trajectory, ended: Callable[[str, bool], None]) -> None:
        """Send a trajectory to the controller; `ended` gets the reason if it failed, and whether it was cancelled."""

    def stop_following(self) -> None:
        """Ask the controller to end the trajectory; `ended` still follows."""

    def report_stage(self, stage: str) -> None:
        """Report the stage."""

    def info(self, text: str) -> None:
        """Log an event."""


class ArmTask:
    """Plans and carries out one goal. Call `advance` until `is_over`; then `failure` is why it failed, if it did."""

    def __init__(
        self,
        site: ArmSite,
        kinematics: ArmKinematics,
        planner: MotionPlanner,
        goal: ArmGoal,
        solver: inverse_kinematics.SolverSettings = inverse_kinematics.SOLVER,
    ) -> None:
        self.failure: MotionFailure | None = None
        self.is_over = self.is_canceled = False
        self.share = 0.0  # of the way that was asked for, for which there was a plan
        self.missed: tuple[float, float] | None = None
        """How far the tip ends from its target [m, rad], if that cannot be taken and was approximate."""
        self._site, self._kinematics, self._planner, self._solver = site, kinematics, planner, solver
        self._goal = replace(goal, prefer=goal.prefer or solver.prefer)
        self._nearest: inverse_kinematics.PoseTarget | None = (
            None  # the target in the root's frame, if its aims are approximate
        )
        self._trajectory: Trajectory | None = None
        self._obstacle = ""  # what the motion would hit, since the scene has changed
        self._aims: list[Array] = []  # positions that would do, the next one to try first
        self._stage: Callable[[], None] = self._settle
        self._began, self._replans, self._scene_replans = site.now, 0, 0
        self._seen: Array | None = None  # where the arm was while it seemed to move, and since when it has been there
        self._seen_at = 0.0
        self._start = np.zeros(len(self.space.joints))
        self._first: Array | None = None  # the first start, which a motion that is planned again does not have

    @property
    def space(self) -> JointSpace:
        """Return the joints of the arm."""
        return self._planner.space

    @property
    def _narrow(self) -> JointSpace:
        """Return the joints within what the goal keeps."""
        return self._goal.keep.narrowed(self.space)

    @property
    def _kept(self) -> KeptTip | None:
        """Return what the tip keeps, from where it was when all began; None if that is nothing."""
        keep, first = self._goal.keep, self._start if self._first is None else self._first
        return KeptTip(self._kinematics, keep, first, self._planner.checker) if keep.is_about_tip else None

    def advance(self) -> None:
        """Continue."""
        if not self.is_over:
            self._stage()

    def cancel(self) -> None:
        """End it soon: planning at once, a motion as soon as the arm has come to rest."""
        if self.is_canceled or self.is_over:
            return
        self.is_canceled = True
        if self._stage == self._move:
            self._site.stop_following()
        else:
            self._end(MotionFailure(MotionReason.INTERRUPTED, "it was cancelled while it was planned"))

    def look_again(self) -> None:
        """Stop if what is left of the motion collides, now that something else is around the robot."""
        if self._stage != self._move or self._obstacle or self._trajectory is None:
            return
        points = self._trajectory.dense(FINE)
        here = int(np.argmin(np.max(np.abs(points - self._where()), axis=1)))
        bad = next((point for point in points[here:] if not self._planner.checker.is_free(point)), None)
        if bad is not None:
            self._obstacle = pairs_shown(self._planner.checker.colliding(bad))
            self._site.stop_following()

    def _settle(self) -> None:
        """Wait until all joints are known and at rest."""
        measured, names = self._site.measured, self.space.names
        if not self._site.is_ready:
            if self._site.now - self._began >= SETTLING:
                self._fail(MotionReason.UNKNOWN_SCENE, self._site.problem)
            return
        unknown = [name for name in names if name not in measured]
        fast = [name for name in names if name in measured and abs(measured[name][1]) > AT_REST]
        if not unknown and (not fast or self._is_calm()):
            self._begin_planning()
        elif self._site.now - self._began >= SETTLING:
            words = ", ".join(f"'{name}'" for name in unknown or fast)
            if unknown:
                self._fail(MotionReason.UNKNOWN_START, f"nothing has reported where {words} is")
            else:
                self._fail(MotionReason.START_MOVED, f"{words} did not come to rest within {SETTLING:g} s")

    def _is_calm(self) -> bool:
        """Return whether the arm gets nowhere, although velocities are measured: those of servos are noisy."""
        here, now = self._where(), self._site.now
        if self._seen is None or float(np.max(np.abs(here - self._seen))) > MOVED:
            self._seen, self._seen_at = here, now
        return now - self._seen_at >= CALM

    def _begin_planning(self) -> None:
        measured, names = self._site.measured, self.space.names
        self._start = self._where()
        self._first = self._start if self._first is None else self._first
        self._obstacle = ""
        self._kinematics.place({name: one for name, (one, _) in measured.items() if name not in names})
        if problem := self._goal.mistake(self._kinematics, self._site.poses):
            self._fail(MotionReason.UNKNOWN_GOAL, problem)
            return
        self._site.report_stage("planning")
        if self._goal.trace is not None:
            frame = self._frame()
            planning = planned_trace(self._kinematics, self._planner, self._goal.trace, self._start, frame)
            self._stage = partial(self._continue_planning, planning)
            self._stage()
        elif self._goal.target is None:
            self._aims = self._nearby(self._aim())
            self._plan_next()
        else:
            frame = self._frame()
            target = replace(self._goal.target, pose=frame.compose(self._goal.target.pose))
            self._stage = partial(self._solve, target, self._solutions(target))
            self._stage()

    def _where(self) -> Array:
        return np.array([self._site.measured[name][0] for name in self.space.names])

    def _aim(self) -> Array:
        """Return where all joints should be; one that the goal leaves out stays, within its limits."""
        goal = self._goal
        wanted = {**(self._site.poses[goal.pose] if goal.pose else {}), **goal.positions}
        stays = self.space.clamped(self._start).tolist()
        return np.array([wanted.get(name, at) for name, at in zip(self.space.names, stays, strict=True)])

    def _nearby(self, aim: Array) -> list[Array]:
        """Return positions to try, within the tolerance: the wanted ones alone, if they are free."""
        off, space, is_free = self._goal.tolerance, self._narrow, self._planner.checker.is_free
        if not off or (not space.outside(aim) and is_free(aim)):
            return [aim]
        shifts = np.random.default_rng(self._planner.settings.seed).uniform(-off, off, (NEARBY, len(aim)))
        near = space.clamped(np.concatenate(([aim], aim + shifts)))
        free = [item for item in near if np.max(np.abs(item - aim)) <= off and is_free(item)]
        return list(inverse_kinematics.by_distance(free, aim)[: inverse_kinematics.ENOUGH]) or [aim]

    def _frame(self) -> Transform3:
        """Return the frame of the goal."""
        return self._kinematics.poses(self._start)[self._goal.frame] if self._goal.frame else Transform3()

    def _solutions(self, target: inverse_kinematics.PoseTarget) -> Solving:
        """Return the search for positions that bring the tip to a target in the root's frame."""
        checker, seed, kept, prefer = self._planner.checker, self._planner.settings.seed, self._kept, self._goal.prefer
        posture = Posture.of(self.space.names, self._site.poses[prefer]) if prefer else None
        ends, kinematics, space = self._site.now + self._solver.time, self._kinematics, self._narrow
        search = inverse_kinematics.PoseSearch(
            kinematics, space, target, self._start, checker.is_free, seed, self._solver.restarts
        )
        if kept is not None and target.any_orientation:
            first = self._start if self._first is None else self._first
            return kept_solutions(search, self._goal.keep, first, checker, posture)
        return searched(replace(search, is_late=lambda: self._site.now >= ends), posture)

    def _solve(self, target: inverse_kinematics.PoseTarget, solving: Solving) -> None:
        if not (done := gone_on(solving, lambda: self._site.now, SLICES)):
            return
        found = done[0]
        checker, colliding = self._planner.checker, found.colliding
        self._aims, self._nearest = list(found.free), target if found.is_approximate else None
        if self._aims:
            self._plan_next()
        elif colliding:
            self._fail(MotionReason.GOAL_IN_COLLISION, pairs_shown(checker.colliding(colliding[0])))
        else:
            self._fail(MotionReason.GOAL_OUT_OF_REACH, f"{found.miss} in {found.attempts} attempts")

    def _plan_next(self) -> None:
        """Plan to the next of the positions that would do."""
        goal = self._goal
        aim = self._aims.pop(0)
        self.missed = self._nearest.error(self._kinematics.tip_pose(aim)) if self._nearest is not None else None
        request = MotionRequest(self._start, aim, goal.speed, goal.acceleration, self._narrow, self._kept)
        self._stage = partial(self._continue_planning, self._planner.plan(request))
        self._stage()

    def _continue_planning(self, planning: Planning) -> None:
        if done := gone_on(planning, lambda: self._site.now, SLICES):
            self._planned(done[0])

    def _planned(self, found: MotionPlan | MotionFailure) -> None:
        self.share = found.share
        if isinstance(found, MotionFailure):
            if self._aims and found.reason in OTHER_AIMS:
                self._plan_next()
            else:
                self._end(found)
        elif found.trajectory is None:
            self._end(None)
        else:
            words = f"{len(found.waypoints)} points, {found.examined} positions examined, attempt {found.attempts}"
            self._set_out(found.trajectory, words)

    def _set_out(self, trajectory: Trajectory, words: str) -> None:
        """Send the trajectory, if the arm is still where it begins."""
        away = float(np.max(np.abs(self._where() - self._start)))
        if away > MOVED:
            self._replans += 1
            if self._replans > REPLANS:
                text = f"joints were up to {away:.3f} away from where the motion was planned from"
                self._fail(MotionReason.START_MOVED, text)
                return
            self._began, self._stage = self._site.now, self._settle
            return
        self._site.info(f"a motion of {trajectory.duration:.1f} s: {words}")
        self._stage, self._trajectory = self._move, trajectory
        self._site.report_stage("moving")
        self._site.follow(self.space.names, trajectory, self._followed)

    def _move(self) -> None:
        """Wait for the controller."""

    def _followed(self, problem: str, is_canceled: bool) -> None:
        if self.is_canceled:
            self._end(MotionFailure(MotionReason.INTERRUPTED, "it was cancelled on its way"))
        elif self._obstacle and (is_canceled or problem) and self._scene_replans < self._goal.replans:
            self._scene_replans += 1
            self._site.info(f"{self._obstacle}, since the scene has changed: planned again")
            self._began, self._stage = self._site.now, self._settle
        elif self._obstacle and (is_canceled or problem):
            self._fail(MotionReason.PATH_IN_COLLISION, f"{self._obstacle}, since the scene has changed")
        elif is_canceled:
            self._fail(MotionReason.NOT_FOLLOWED, "somebody else cancelled its trajectory")
        elif problem:
            self._fail(MotionReason.NOT_FOLLOWED, problem)
        else:
            self._end(None)

    def _fail(self, reason: MotionReason, text: str) -> None:
        self._end(MotionFailure(reason, text))

    def _end(self, failure: MotionFailure | None) -> None:
        self._stage = self._move  # lets go of what was being planned
        self.is_over, self.failure = True, failure


MOST_EXCESS = 1.01  # times the limits of speed and acceleration, which others round otherwise


class GivenTask(ArmTask):
    """A goal whose trajectory is `given`: it is examined, and followed if it is free and within all limits."""

    given: Trajectory

    def _begin_planning(self) -> None:
        self._start = self._where()
        self._site.report_stage("planning")
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
