"""`arm ik`: positions of joints that bring the tip of an arm to a pose."""

from __future__ import annotations

import argparse
import json
import math
from time import perf_counter
from typing import Any

from numpy.typing import NDArray

from rbxcompose.arm_config import ArmWorks
from rbxcompose.body.attachment import FramePose
from rbxcompose.cli.arms.chosen import chosen_arm, done, positions_in, shown, values_of
from rbxcompose.cli.arms.written import NO_MOTION, read_written
from rbxcompose.cli.output.console import tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import suggest
from rbxcompose.motion.inverse_kinematics import PoseSolutions, PoseTarget
from rbxcompose.motion.pose_search import searched
from rbxcompose.motion.posture import Posture
from rbxcompose.sections.arms import ArmOfRobot


def add_inverse_options(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `arm ik`."""
    words = "of the tip: '{x: 20 cm, y: -10 cm, z: 55 cm, yaw: 90 deg}'"
    parser.add_argument("target", metavar="POSE", help=words)
    parser.add_argument("--frame", metavar="LINK", default="", help="the link in whose frame it is (default: the root)")
    counts = parser.add_mutually_exclusive_group()
    counts.add_argument("--any-orientation", action="store_true", help="only the position counts")
    counts.add_argument("--any-position", action="store_true", help="only the orientation counts")
    words = "if it cannot be taken, print the nearest pose that can be, and how far that is from it"
    parser.add_argument("--approximate", action="store_true", help=words)
    words = "where joints should rather be, if several positions do (default: as 'kinematics' of the arm says)"
    parser.add_argument("--prefer", metavar="GOAL", default="", help=words)


def run_inverse(arguments: argparse.Namespace) -> int:
    """Print solutions, the best first.

    Raises:
        NotDoneError: if there is none, or the arguments ask for nothing that there is.
    """
    made = chosen_arm(arguments)
    if made is None:
        return 1
    one, works = made
    target = _target(arguments, works, start := values_of(works, one, arguments.start))
    found = _found(arguments, works, one, target, start)
    each = [dict(zip(works.space.names, values.tolist(), strict=True)) for values in found.free]
    missed = [target.error(works.kinematics.tip_pose(values)) for values in found.free]
    if arguments.json:
        data = {"solutions": each, "colliding": len(found.colliding), "attempts": found.attempts}
        errors = [{"away": away, "angle": angle} for away, angle in missed]
        tell(json.dumps(data | {"approximate": found.is_approximate, "errors": errors}))
        return 0 if each else 1
    for number, (solution, off) in enumerate(zip(each, missed, strict=True), 1):
        words = f" (approximate, {_far(*off)} from it)" if found.is_approximate else ""
        tell(f"solution {number}{words}: {shown(works, solution)}")
    if each:
        return 0
    words = f"goal_out_of_reach: the tip got within {_far(*found.nearest)} of it"
    if found.colliding:
        words = f"goal_in_collision: all {len(found.colliding)} solutions collide"
    raise NotDoneError(NO_MOTION.at(None, words))


def _target(arguments: argparse.Namespace, works: ArmWorks, start: NDArray[Any]) -> PoseTarget:
    """Return the pose that is asked for, in the frame of the root."""
    links, pose = works.kinematics.poses(start), read_written(FramePose, arguments.target).to_transform()
    if arguments.frame and arguments.frame not in links:
        message = f"there is no link '{arguments.frame}'; {suggest(arguments.frame, links, 'links')}"
        raise NotDoneError(NO_MOTION.at(None, message))
    return PoseTarget(
        links[arguments.frame].compose(pose) if arguments.frame else pose,
        arguments.any_orientation,
        works.solver.tolerance,
        works.solver.angle_tolerance,
        arguments.any_position,
        arguments.approximate,
    )


def _found(
    arguments: argparse.Namespace, works: ArmWorks, one: ArmOfRobot, target: PoseTarget, start: NDArray[Any]
) -> PoseSolutions:
    solver, began = works.solver, perf_counter()
    prefer = arguments.prefer or solver.prefer
    return done(
        searched(
            works.kinematics,
            works.space,
            target,
            start,
            works.planner.checker.is_free,
            seed=works.planner.settings.seed,
            posture=Posture.of(works.space.names, positions_in(works, one, prefer)) if prefer else None,
            restarts=solver.restarts,
            is_late=lambda: perf_counter() - began >= solver.time,
        )
    )


def _far(away: float, angle: float) -> str:
    return f"{away * 100:.1f} cm and {math.degrees(angle):.1f} deg"
