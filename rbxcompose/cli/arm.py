"""Try an arm without a robot: where its tip is, how it gets to a pose; or move that of a robot.

A GOAL is a pose of the arm by name, or positions of joints as in a mission: '{elbow_joint: 20 deg}'. Joints that it
does not name are at rest. Objects of the manifest's scene are there. `go` sends the goal to a robot that runs. WAY and
KEEP are as in missions.

Exit codes: 0 fine, 1 errors found, or no plan, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Generator, Mapping
from time import perf_counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rbxcompose.arm_config import ArmConfig, ArmWorks
from rbxcompose.arm_goals import goal_of
from rbxcompose.body.attachment import FramePose
from rbxcompose.cli.arms.bench import add_bench_options, run_bench
from rbxcompose.cli.arms.motion_picture import draw_motion
from rbxcompose.cli.arms.reach_map import add_reach_options, run_reach
from rbxcompose.cli.arms.setup import add_options, run_setup
from rbxcompose.cli.arms.written import NO_MOTION, read_written
from rbxcompose.cli.bodies.arm_models import KeepModel, TraceModel
from rbxcompose.cli.bus.entities import add_json_option, add_timeout_option, table, visit
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.output.console import refuse, tell, tell_report
from rbxcompose.cli.project.robot_choice import add_path_argument, robot_path
from rbxcompose.cli.project.robot_options import add_layer_options, compiled
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.cli.robots.this_machine import missing_extras
from rbxcompose.findings import Report, suggest
from rbxcompose.geometry import Transform3
from rbxcompose.model.robot import Robot
from rbxcompose.motion.inverse_kinematics import PoseTarget, solved
from rbxcompose.motion.kept import KeptTip
from rbxcompose.motion.planner import MotionPlan, MotionRequest, Planning
from rbxcompose.motion.reasons import MotionFailure
from rbxcompose.motion.trace_planner import planned_trace
from rbxcompose.msgs.plain import from_plain
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, TraceArm
from rbxcompose.sections.arms import ArmOfRobot, arms
from rbxcompose.sections.joints import JointPosition
from rbxcompose.sections.scene import scene

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
    ik.add_argument("target", metavar="POSE", help="of the tip: '{x: 20 cm, y: -10 cm, z: 55 cm, yaw: 90 deg}'")
    ik.add_argument("--frame", metavar="LINK", default="", help="the link in whose frame it is (default: the root)")
    ik.add_argument("--any-orientation", action="store_true", help="only the position counts")
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
        (ik, _ik),
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
    go.add_argument("arm", metavar="ARM", help="the arm")
    go.add_argument("pose", metavar="POSE", help="one of its poses, or a way of its tip: '{points: [{x: 5 cm}]}'")
    for one in (plan, go):
        one.add_argument("--keep", metavar="KEEP", default="", help="on the way: '{roll: 10 deg, pitch: 10 deg}'")
    go.set_defaults(do=_go)
    add_timeout_option(go, "5s")
    add_json_option(go)
    add_bus_options(go)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    do: Callable[[argparse.Namespace], int] = arguments.do
    try:
        return do(arguments)
    except NotDoneError as error:
        return refuse(error.finding)


def _go(arguments: argparse.Namespace) -> int:
    from rbxcompose.cli.bus.action_send import send  # the imports for messages would slow down the others

    if arguments.pose.startswith("{"):
        port, goal = "trace", read_written(TraceModel, arguments.pose).message()
    else:
        port, goal = "move", {"pose": arguments.pose, "keep": read_written(KeepModel, arguments.keep or "{}").message()}
    arguments.name, arguments.content = f"{arguments.arm}/{port}", json.dumps(goal)
    return visit(arguments, lambda guest: send(guest, arguments))


def _robot(arguments: argparse.Namespace) -> Robot | None:
    """Return the robot; None after its errors."""
    path = robot_path(arguments.path)
    if path is None:
        return None
    compilation = compiled(path, arguments)
    report = Report()
    report.extend(one for one in compilation.report if one.severity.value == "error")
    if compilation.robot is not None and not report.has_errors and arguments.action != "ls":
        report.extend(missing_extras(compilation.robot))
    tell_report(report, compilation.sources)
    return None if report.has_errors else compilation.robot


def _ls(arguments: argparse.Namespace) -> int:
    robot = _robot(arguments)
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
    made = _works(arguments, is_fast=True)
    return 1 if made is None else run_bench(arguments, made[1])


def _works(arguments: argparse.Namespace, *, is_fast: bool = False) -> tuple[ArmOfRobot, ArmWorks] | None:
    """Return the chosen arm, and what plans for it, for many motions if `is_fast`; None after errors."""
    robot = _robot(arguments)
    if robot is None:
        return None
    found = robot.manifest.contents.of(arms)
    name = arguments.arm or (next(iter(found)) if len(found) == 1 else "")
    if name not in found:
        words = f"there is no arm '{name}'; {suggest(name, found, 'arms')}" if name else "name one with --arm"
        raise NotDoneError(NO_MOTION.at(None, words if found else "this robot has no arms"))
    config, description = robot.components[name].config, robot.manifest.body
    if not isinstance(config, ArmConfig) or description is None:
        return None
    things = robot.manifest.contents.of(scene)
    objects = things.on(description.body)
    return found[name], ArmWorks(config, perf_counter, objects, things.paddings, is_fast=is_fast)


def _values(works: ArmWorks, one: ArmOfRobot, written: str) -> NDArray[np.float64]:
    """Return the positions of a goal, of shape (n,); joints that it does not name are at rest.

    Raises:
        NotDoneError: if it is no goal.
    """
    at: dict[str, float] = {}
    if written in one.model.poses:
        at = {joint: position.value for joint, position in one.model.poses[written].items()}
    elif written.startswith("{"):
        read = read_written(dict[str, JointPosition], written)
        at = {name: position.value for name, position in read.items()}
    elif written:
        message = f"there is no pose '{written}'; {suggest(written, one.model.poses, 'poses')}"
        raise NotDoneError(NO_MOTION.at(None, message))
    if unknown := [name for name in at if name not in works.space.names]:
        message = f"'{unknown[0]}' is no joint of this arm; {suggest(unknown[0], works.space.names, 'joints')}"
        raise NotDoneError(NO_MOTION.at(None, message))
    rest = {name: works.kinematics.body.joints[name].rest for name in works.space.names}
    return np.array([at.get(name, rest[name]) for name in works.space.names])


def _fk(arguments: argparse.Namespace) -> int:
    made = _works(arguments)
    if made is None:
        return 1
    one, works = made
    values = _values(works, one, arguments.goal)
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


def _ik(arguments: argparse.Namespace) -> int:
    made = _works(arguments)
    if made is None:
        return 1
    one, works = made
    start, pose = _values(works, one, arguments.start), read_written(FramePose, arguments.target).to_transform()
    links = works.kinematics.poses(start)
    if arguments.frame:
        if arguments.frame not in links:
            message = f"there is no link '{arguments.frame}'; {suggest(arguments.frame, links, 'links')}"
            raise NotDoneError(NO_MOTION.at(None, message))
        pose = links[arguments.frame].compose(pose)
    solver, checker = works.solver, works.planner.checker
    target = PoseTarget(pose, arguments.any_orientation, solver.tolerance, solver.angle_tolerance)
    began, seed = perf_counter(), works.planner.settings.seed
    found = _done(
        solved(
            works.kinematics,
            works.space,
            target,
            start,
            checker.is_free,
            seed=seed,
            restarts=solver.restarts,
            is_late=lambda: perf_counter() - began >= solver.time,
        )
    )
    each = [dict(zip(works.space.names, values.tolist(), strict=True)) for values in found.free]
    if arguments.json:
        tell(json.dumps({"solutions": each, "colliding": len(found.colliding), "attempts": found.attempts}))
        return 0 if each else 1
    for number, solution in enumerate(each, 1):
        tell(f"solution {number}: {_shown(works, solution)}")
    if each:
        return 0
    away, angle = found.nearest
    words = f"the tip got within {away * 100:.1f} cm and {math.degrees(angle):.1f} deg of it"
    if found.colliding:
        words = f"all {len(found.colliding)} solutions collide"
    raise NotDoneError(
        NO_MOTION.at(None, f"{'goal_in_collision' if found.colliding else 'goal_out_of_reach'}: {words}")
    )


def _shown(works: ArmWorks, solution: Mapping[str, float]) -> str:
    return ", ".join(f"{joint.name}: {joint.shown(solution[joint.name])}" for joint in works.space.joints)


def _plan(arguments: argparse.Namespace) -> int:
    made = _works(arguments)
    if made is None:
        return 1
    one, works = made
    start, goal = _values(works, one, arguments.start), _values(works, one, arguments.goal)
    keep = goal_of(_goal(MoveArm.Goal, {"keep": read_written(KeepModel, arguments.keep or "{}").message()})).keep
    if words := keep.mistake(works.kinematics):
        raise NotDoneError(NO_MOTION.at(None, f"unknown_goal: {words}"))
    kept = KeptTip(works.kinematics, keep, start, works.planner.checker) if keep.is_about_tip else None
    request = MotionRequest(start, goal, space=keep.narrowed(works.space), kept=kept)
    return _tell_plan(works, works.planner.plan(request), arguments, start, goal)


def _trace(arguments: argparse.Namespace) -> int:
    made = _works(arguments)
    if made is None:
        return 1
    one, works = made
    start, goal = _values(works, one, arguments.start), goal_of(_goal(TraceArm.Goal, _way(arguments.way)))
    links, wish = works.kinematics.poses(start), goal.trace
    words = "" if not goal.frame or goal.frame in links else f"there is no link '{goal.frame}'"
    if wish is None or (words := words or wish.mistake):
        raise NotDoneError(NO_MOTION.at(None, f"unknown_goal: {words}"))
    frame = links[goal.frame] if goal.frame else Transform3()
    planning = planned_trace(works.kinematics, works.planner, wish, start, frame)
    return _tell_plan(works, planning, arguments, start)


def _picture(arguments: argparse.Namespace) -> int:
    made = _works(arguments)
    return 1 if made is None else run_reach(arguments, made[1], _values(made[1], made[0], arguments.start))


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
    found = _done(planning)
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
        tell(f"  {_shown(works, point)}")
    return 0


def _done(work: Generator[None, None, T]) -> T:
    while True:
        try:
            next(work)
        except StopIteration as ended:
            result: T = ended.value
            return result
