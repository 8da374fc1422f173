"""Try an arm without a robot: where its tip is, how it gets to a pose; or move that of a robot.

A GOAL is a pose of the arm by name, or positions of joints as in a mission: '{elbow_joint: 20 deg}'. Joints that it
does not name are at rest. Objects of the manifest's scene are there. `go` sends the goal to a robot that runs, whose
other joints stay where they are. WAY and KEEP are as in missions.

Exit codes: 0 fine, 1 errors found, or no plan, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping
from time import perf_counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rbxcompose.arm_config import ArmWorks
from rbxcompose.arm_goals import goal_of
from rbxcompose.cli.arms.bench import add_bench_options, run_bench
from rbxcompose.cli.arms.chosen import chosen_arm, chosen_robot, done, shown, values_of
from rbxcompose.cli.arms.go import add_go_options
from rbxcompose.cli.arms.inverse import add_inverse_options, run_inverse
from rbxcompose.cli.arms.motion_picture import draw_motion
from rbxcompose.cli.arms.reach_map import add_reach_options, run_reach
from rbxcompose.cli.arms.setup import add_options, run_setup
from rbxcompose.cli.arms.written import NO_MOTION, read_written
from rbxcompose.cli.bodies.arm_models import KeepModel, TraceModel
from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.project.robot_choice import add_path_argument
from rbxcompose.cli.project.robot_options import add_layer_options
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.geometry import Transform3
from rbxcompose.motion.kept import KeptTip
from rbxcompose.motion.planner import MotionPlan, MotionRequest, Planning
from rbxcompose.motion.reasons import MotionFailure
from rbxcompose.motion.trace_planner import planned_trace
from rbxcompose.msgs.plain import from_plain
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, TraceArm
from rbxcompose.sections.arms import ArmOfRobot, arms

T = TypeVar("T")
M = TypeVar("M", MoveArm.Goal, TraceArm.Goal)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    verbs = "ls|fk|ik|plan|trace|picture|bench|setup|go"
    actions = parser.add_subparsers(dest="action", metavar=verbs, required=True)
    ls = actions.add_parser("ls", help="list the arms of a robot with their joints and poses")
    fk = actions.add_parser("fk", help="print where the tip is (forward kinematics)")
    fk.add_argument("goal", metavar="GOAL", help="a pose by name, or '{JOINT: POSITION, ...}'")
    ik = actions.add_parser("ik", help="print positions of joints that bring the tip to a pose (inverse kinematics)")
    add_inverse_options(ik)
    plan = actions.add_parser("plan", help="plan a motion and tell how long it takes, or why there is none")
    plan.add_argument("goal", metavar="GOAL", help="a pose by name, or '{JOINT: POSITION, ...}'")
    fk.add_argument("--picture", metavar="FILE", help="draw it among the things of the scene as PNG")
    trace = actions.add_parser("trace", help="plan a way of the tip along lines and arcs, or tell how far it gets")
    trace.add_argument("way", metavar="WAY", help="as in a mission: '{points: [{x: 5 cm}], relative: true}'")
    for one in (plan, trace):
        one.add_argument("--picture", metavar="FILE", help="draw start, goal (green) and the way of the tip as PNG")
    for one in (ik, plan, trace):
        one.add_argument("--from", dest="start", metavar="GOAL", default="", help="where it begins (default: at rest)")
    picture = actions.add_parser("picture", help="draw where the tip gets, and how well, as PNG")
    add_reach_options(picture)
    bench = actions.add_parser("bench", help="measure kinematics, and motions, also those of published problems")
    add_bench_options(bench)
    setup = actions.add_parser("setup", help="find pairs of links that need not be watched, and write their file")
    add_options(setup)
    for one, do in (
        (ls, _ls),
        (fk, _fk),
        (ik, run_inverse),
        (plan, _plan),
        (trace, _trace),
        (picture, _picture),
        (bench, _bench),
        (setup, run_setup),
    ):
        add_path_argument(one)
        if one not in (ls, setup):
            one.add_argument("--arm", metavar="NAME", help="which one, if there are several")
        add_layer_options(one)
        one.add_argument("--json", action="store_true", help="answer in JSON")
        one.set_defaults(do=do)
    go = actions.add_parser("go", help="move an arm of a running robot, and print how that ends")
    add_go_options(go)
    for one in (plan, go):
        one.add_argument("--keep", metavar="KEEP", default="", help="on the way: '{roll: 10 deg, pitch: 10 deg}'")


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    do: Callable[[argparse.Namespace], int] = arguments.do
    try:
        return do(arguments)
    except NotDoneError as error:
        return refuse(error.finding)


def _ls(arguments: argparse.Namespace) -> int:
    robot = chosen_robot(arguments)
    if robot is None:
        return 1
    found = robot.manifest.contents.of(arms)
    if arguments.json:
        tell(json.dumps([{"name": name, **_described(one)} for name, one in found.items()]))
    elif not found:
        tell("this robot has no arms")
    else:
        rows = [
            (name, one.group.base, one.group.tip, ", ".join(one.group.joints), ", ".join(one.model.poses))
            for name, one in found.items()
        ]
        tell(table([("name", "base", "tip", "joints", "poses"), *rows]))
    return 0


def _described(one: ArmOfRobot) -> dict[str, object]:
    poses = {name: {joint: at.value for joint, at in pose.items()} for name, pose in one.model.poses.items()}
    return {"base": one.group.base, "tip": one.group.tip, "joints": list(one.group.joints), "poses": poses}


def _bench(arguments: argparse.Namespace) -> int:
    made = chosen_arm(arguments, is_fast=True)
    return 1 if made is None else run_bench(arguments, made[1])


def _fk(arguments: argparse.Namespace) -> int:
    made = chosen_arm(arguments)
    if made is None:
        return 1
    one, works = made
    values = values_of(works, one, arguments.goal)
    if arguments.picture and (failed := draw_motion(arguments, works, values, values, None)):
        return failed
    pose = works.kinematics.tip_pose(values)
    root = works.kinematics.body.root
    if arguments.json:
        tell(json.dumps({"frame": root, "position": pose.translation, "rotation": pose.rotation}))
    else:
        x, y, z = (f"{value * 100:.2f} cm" for value in pose.translation)
        turn = ", ".join(f"{value:.4f}" for value in pose.rotation)
        tell(f"'{one.group.tip}' in '{root}': x {x}, y {y}, z {z}; rotation (x, y, z, w) {turn}")
    return 0


def _plan(arguments: argparse.Namespace) -> int:
    made = chosen_arm(arguments)
    if made is None:
        return 1
    one, works = made
    start, goal = values_of(works, one, arguments.start), values_of(works, one, arguments.goal)
    keep = goal_of(_goal(MoveArm.Goal, {"keep": read_written(KeepModel, arguments.keep or "{}").message()})).keep
    if words := keep.mistake(works.kinematics):
        raise NotDoneError(NO_MOTION.at(None, f"unknown_goal: {words}"))
    kept = KeptTip(works.kinematics, keep, start, works.planner.checker) if keep.is_about_tip else None
    request = MotionRequest(start, goal, space=keep.narrowed(works.space), kept=kept)
    return _tell_plan(works, works.planner.plan(request), arguments, start, goal)


def _trace(arguments: argparse.Namespace) -> int:
    made = chosen_arm(arguments)
    if made is None:
        return 1
    one, works = made
    start, goal = values_of(works, one, arguments.start), goal_of(_goal(TraceArm.Goal, _way(arguments.way)))
    links, wish = works.kinematics.poses(start), goal.trace
    words = "" if not goal.frame or goal.frame in links else f"there is no link '{goal.frame}'"
    if wish is None or (words := words or wish.mistake):
        raise NotDoneError(NO_MOTION.at(None, f"unknown_goal: {words}"))
    frame = links[goal.frame] if goal.frame else Transform3()
    planning = planned_trace(works.kinematics, works.planner, wish, start, frame)
    return _tell_plan(works, planning, arguments, start)


def _picture(arguments: argparse.Namespace) -> int:
    made = chosen_arm(arguments)
    return 1 if made is None else run_reach(arguments, made[1], values_of(made[1], made[0], arguments.start))


def _way(written: str) -> dict[str, object]:
    return read_written(TraceModel, written).message()


def _goal(message: type[M], data: Mapping[str, object]) -> M:
    made, findings = from_plain(message, data)
    if made is None:
        raise NotDoneError(findings[0])
    return made


def _tell_plan(
    works: ArmWorks,
    planning: Planning,
    arguments: argparse.Namespace,
    start: NDArray[np.float64],
    goal: NDArray[np.float64] | None = None,
) -> int:
    """Print a plan, and draw it if that is wanted; without a goal, it ends where the plan ends.

    Raises:
        NotDoneError: if there is none.
    """
    began = perf_counter()
    found = done(planning)
    took = perf_counter() - began
    if goal is None:
        goal = found.waypoints[-1] if isinstance(found, MotionPlan) else start
    if arguments.picture and (failed := draw_motion(arguments, works, start, goal, found)):
        return failed
    if isinstance(found, MotionFailure):
        raise NotDoneError(NO_MOTION.at(None, f"{found.reason}: {found.text}"))
    points = [dict(zip(works.space.names, values, strict=True)) for values in found.waypoints.tolist()]
    duration = found.trajectory.duration if found.trajectory is not None else 0.0
    if arguments.json:
        data = {"duration": duration, "waypoints": points, "attempts": found.attempts, "examined": found.examined}
        origin = {"found_by": found.found_by, "fast_failed": found.fast_failed}
        tell(json.dumps(data | {"planning_time": took, "fraction": found.share} | origin))
        return 0
    by = f"found by {found.found_by}, " if found.found_by else ""
    words = f"{by}{found.examined} positions examined, attempt {found.attempts}"
    if found.fast_failed:
        words += f"; fast: {found.fast_failed}"
    if found.share < 1.0:
        words = f"only {found.share:.1%} of the way; {words}"
    tell(f"a motion of {duration:.2f} s over {len(points)} points, planned in {took * 1000:.0f} ms ({words})")
    for point in points:
        tell(f"  {shown(works, point)}")
    return 0
