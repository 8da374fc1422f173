"""Try an arm without a robot: where its tip is, how it gets to a pose; or move that of a robot.

A GOAL is a pose of the arm by name, or positions of joints as in a mission: '{elbow_joint: 20 deg}'. Joints that it
does not name are at rest. Objects of the manifest's scene are there. `go` sends the goal to a robot that runs, whose
other joints stay where they are. WAY and KEEP are as in missions.

Exit codes: 0 fine, 1 errors found, or no plan, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, TypeVar

from rbxcompose.base.arrays import AnyArray, Array, np
from rbxcompose.base.config import Config, Length, Time
from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.geometry import Transform3
from rbxcompose.base.units import ANGLE, LENGTH
from rbxcompose.commands import options
from rbxcompose.commands.console import NotDoneError, emit, misused, table
from rbxcompose.commands.guest import Guest, visit, wanted
from rbxcompose.commands.lookup import add_bus_options
from rbxcompose.commands.targets import add_layer_options, add_path_argument, put_robot_last
from rbxcompose.domains.arms.arm_config import ArmWorks
from rbxcompose.domains.arms.command_camera import add_camera_options, run_camera
from rbxcompose.domains.arms.command_line import (
    NO_MOTION,
    KeepModel,
    TraceModel,
    chosen_robot,
    keys_of,
    positions_in,
    read_joints,
    read_written,
    shown,
    values_of,
    whole_number,
    with_arm,
    write_picture,
)
from rbxcompose.domains.arms.goals import goal_of
from rbxcompose.domains.arms.motion import figures as measures
from rbxcompose.domains.arms.motion.groups import moved_links
from rbxcompose.domains.arms.motion.inverse_kinematics import (
    PoseSearch,
    PoseSolutions,
    PoseTarget,
    Posture,
    apart,
    searched,
)
from rbxcompose.domains.arms.motion.path_constraints import KeptTip
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionRequest, Planning
from rbxcompose.domains.arms.motion.reach import DIRECTIONS, Cut, ReachMap, reached
from rbxcompose.domains.arms.motion.trace_planner import planned_trace
from rbxcompose.domains.arms.reasons import MotionFailure
from rbxcompose.domains.arms.sections.arms import ArmOfRobot, arms
from rbxcompose.domains.arms.setup_assistant import add_options, run_setup
from rbxcompose.manifest.fields import FramePose
from rbxcompose.msgs.plain import from_plain
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, TraceArm

GROUP = "bodies and arms"
M = TypeVar("M", MoveArm.Goal, TraceArm.Goal)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    goal = options.argument("goal", metavar="GOAL", help="a pose by name, or '{JOINT: POSITION, ...}'")
    fk_picture = options.argument("--picture", metavar="FILE", help="draw it among the things of the scene as PNG")
    words = "draw start, goal (green) and the way of the tip as PNG"
    picture = options.argument("--picture", metavar="FILE", help=words)
    way = options.argument("way", metavar="WAY", help="as in a mission: '{points: [{x: 5 cm}], relative: true}'")
    start = options.argument(
        "--from", dest="start", metavar="GOAL", default="", help="where it begins (default: at rest)"
    )
    words = "on the way: '{roll: 10 deg, pitch: 10 deg}'"
    keep = options.argument("--keep", metavar="KEEP", default="", help=words)
    arm = options.argument("--arm", metavar="NAME", help="which one, if there are several")
    json_ = options.argument("--json", action="store_true", help="answer in JSON")
    shared = (add_path_argument, add_layer_options, json_)
    of_arm = (add_path_argument, arm, add_layer_options, json_)
    ik = "print positions of joints that bring the tip to a pose (inverse kinematics)"
    trace = "plan a way of the tip along lines and arcs, or print how far it gets"
    setup = "find pairs of links that need not be watched, and write their file"
    bench = "measure kinematics, and motions, also those of published problems"
    plan = "plan a motion and print how long it takes, or why there is none"
    picture_words = "draw where the tip gets, and how well, as PNG"
    camera = "measure where a camera of a running robot is, by a tag on the hand"
    go = "move an arm of a running robot, and print how that ends"
    forward = "print where the tip is (forward kinematics)"
    actions = (
        options.Subcommand("ls", "list the arms of a robot with their joints and poses", _ls, shared),
        options.Subcommand("fk", forward, with_arm(_fk), (goal, fk_picture, *of_arm)),
        options.Subcommand("ik", ik, with_arm(run_inverse), (add_inverse_options, start, *of_arm)),
        options.Subcommand("plan", plan, with_arm(_plan), (goal, picture, start, *of_arm, keep)),
        options.Subcommand("trace", trace, with_arm(_trace), (way, picture, start, *of_arm)),
        options.Subcommand("picture", picture_words, with_arm(run_reach), (add_reach_options, *of_arm)),
        options.Subcommand("bench", bench, with_arm(run_bench, is_fast=True), (add_bench_options, *of_arm)),
        options.Subcommand("setup", setup, run_setup, (add_options, *shared)),
        options.Subcommand("calibrate-camera", camera, run_camera, (add_camera_options,)),
        options.Subcommand("go", go, run_go, (add_go_options, keep)),
    )
    options.add_actions(parser, actions)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    for asked in ("goal", "target", "way"):
        if asked in arguments and "path" in arguments:
            put_robot_last(arguments, asked)
    return options.run_action(arguments)


def _ls(arguments: argparse.Namespace) -> int:
    robot = chosen_robot(arguments)
    if robot is None:
        return 1
    found = robot.manifest.contents.of(arms)
    if arguments.json:
        emit(json.dumps([{"name": name, **_described(arm)} for name, arm in found.items()]))
    elif not found:
        emit("this robot has no arms")
    else:
        rows = [
            (name, arm.group.base, arm.group.tip, ", ".join(arm.group.joints), ", ".join(arm.model.poses))
            for name, arm in found.items()
        ]
        emit(table([("name", "base", "tip", "joints", "poses"), *rows]))
    return 0


def _described(robot: ArmOfRobot) -> dict[str, object]:
    poses = {name: {joint: at.value for joint, at in pose.items()} for name, pose in robot.model.poses.items()}
    return {"base": robot.group.base, "tip": robot.group.tip, "joints": list(robot.group.joints), "poses": poses}


def _fk(arguments: argparse.Namespace, robot: ArmOfRobot, works: ArmWorks) -> int:
    values = values_of(works, robot, arguments.goal)
    if arguments.picture and (failed := draw_motion(arguments, works, values, values, None)):
        return failed
    pose = works.kinematics.tip_pose(values)
    root = works.kinematics.body.root
    if arguments.json:
        emit(json.dumps({"frame": root, "position": pose.translation, "rotation": pose.rotation}))
    else:
        x, y, z = (f"{value * 100:.2f} cm" for value in pose.translation)
        turn = ", ".join(f"{value:.4f}" for value in pose.rotation)
        emit(f"'{robot.group.tip}' in '{root}': x {x}, y {y}, z {z}; rotation (x, y, z, w) {turn}")
    return 0


def _plan(arguments: argparse.Namespace, robot: ArmOfRobot, works: ArmWorks) -> int:
    start, goal = values_of(works, robot, arguments.start), values_of(works, robot, arguments.goal)
    keep = goal_of(_goal(MoveArm.Goal, {"keep": read_written(KeepModel, arguments.keep or "{}").message()})).keep
    if words := keep.mistake(works.kinematics):
        raise NotDoneError(NO_MOTION.at(None, f"unknown_goal: {words}"))
    kept = KeptTip(works.kinematics, keep, start, works.planner.checker) if keep.is_about_tip else None
    request = MotionRequest(start, goal, space=keep.narrowed(works.space), kept=kept)
    return _show_plan(works, works.planner.plan(request), arguments, start, goal)


def _trace(arguments: argparse.Namespace, robot: ArmOfRobot, works: ArmWorks) -> int:
    start, goal = values_of(works, robot, arguments.start), goal_of(_goal(TraceArm.Goal, _way(arguments.way)))
    links, wish = works.kinematics.poses(start), goal.trace
    words = "" if not goal.frame or goal.frame in links else f"there is no link '{goal.frame}'"
    if wish is None or (words := words or wish.mistake):
        raise NotDoneError(NO_MOTION.at(None, f"unknown_goal: {words}"))
    frame = links[goal.frame] if goal.frame else Transform3()
    planning = planned_trace(works.kinematics, works.planner, wish, start, frame)
    return _show_plan(works, planning, arguments, start)


def _way(written: str) -> dict[str, object]:
    return read_written(TraceModel, written).message()


def _goal(message: type[M], data: Mapping[str, object]) -> M:
    made, findings = from_plain(message, data)
    if made is None:
        raise NotDoneError(findings[0])
    return made


def _show_plan(
    works: ArmWorks, planning: Planning, arguments: argparse.Namespace, start: Array, goal: Array | None = None
) -> int:
    """Print a plan, and draw it if that is wanted; without a goal, it ends where the plan ends.

    Raises:
        NotDoneError: if there is none.
    """
    began = perf_counter()
    found = measures.ended(planning)
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
        emit(json.dumps(data | {"planning_time": took, "fraction": found.share} | origin))
        return 0
    by = f"found by {found.found_by}, " if found.found_by else ""
    words = f"{by}{found.examined} positions examined, attempt {found.attempts}"
    if found.fast_failed:
        words += f"; fast: {found.fast_failed}"
    if found.share < 1.0:
        words = f"only {found.share:.1%} of the way; {words}"
    emit(f"a motion of {duration:.2f} s over {len(points)} points, planned in {took * 1000:.0f} ms ({words})")
    for point in points:
        emit(f"  {shown(works, point)}")
    return 0


def add_inverse_options(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `arm ik`."""
    parser.add_argument("target", metavar="POSE", help="of the tip: '{x: 20 cm, y: -10 cm, z: 55 cm, yaw: 90 deg}'")
    parser.add_argument("--frame", metavar="LINK", default="", help="the link in whose frame it is (default: the root)")
    counts = parser.add_mutually_exclusive_group()
    counts.add_argument("--any-orientation", action="store_true", help="only the position counts")
    counts.add_argument("--any-position", action="store_true", help="only the orientation counts")
    words = "if it cannot be taken, print the nearest pose that can be, and how far that is from it"
    parser.add_argument("--approximate", action="store_true", help=words)
    words = "where joints should rather be, if several positions do (default: as 'kinematics' of the arm says)"
    parser.add_argument("--prefer", metavar="GOAL", default="", help=words)


def run_inverse(arguments: argparse.Namespace, robot: ArmOfRobot, works: ArmWorks) -> int:
    """Print solutions, the best first.

    Raises:
        NotDoneError: if there is none, or the arguments ask for nothing that there is.
    """
    target = _target(arguments, works, start := values_of(works, robot, arguments.start))
    found = _found(arguments, works, robot, target, start)
    free = apart(found.free)
    each = [dict(zip(works.space.names, values.tolist(), strict=True)) for values in free]
    missed = [target.error(works.kinematics.tip_pose(values)) for values in free]
    if arguments.json:
        data = {"solutions": each, "colliding": len(found.colliding), "attempts": found.attempts}
        errors = [{"away": away, "angle": angle} for away, angle in missed]
        emit(json.dumps(data | {"approximate": found.is_approximate, "errors": errors}))
        return 0 if each else 1
    for number, (solution, off) in enumerate(zip(each, missed, strict=True), 1):
        words = f" (approximate, {_far(*off)} from it)" if found.is_approximate else ""
        emit(f"solution {number}{words}: {shown(works, solution)}")
    if each:
        return 0
    words = f"goal_out_of_reach: {found.miss}"
    if found.colliding:
        words = f"goal_in_collision: all {len(found.colliding)} solutions collide"
    raise NotDoneError(NO_MOTION.at(None, words))


def _target(arguments: argparse.Namespace, works: ArmWorks, start: AnyArray) -> PoseTarget:
    """Return the pose that is asked for, in the frame of the root."""
    links, pose = works.kinematics.poses(start), read_written(FramePose, arguments.target).to_transform()
    if arguments.frame and arguments.frame not in links:
        message = clauses(f"there is no link '{arguments.frame}'", suggest(arguments.frame, links, "links"))
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
    arguments: argparse.Namespace, works: ArmWorks, robot: ArmOfRobot, target: PoseTarget, start: AnyArray
) -> PoseSolutions:
    solver, began = works.solver, perf_counter()
    prefer = arguments.prefer or solver.prefer
    posture = Posture.of(works.space.names, positions_in(works, robot, prefer)) if prefer else None
    is_free, seed = works.planner.checker.is_free, works.planner.settings.seed
    search = PoseSearch(works.kinematics, works.space, target, start, is_free, seed, solver.restarts)
    return measures.ended(searched(replace(search, is_late=lambda: perf_counter() - began >= solver.time), posture))


def _far(away: float, angle: float) -> str:
    return f"{away * 100:.1f} cm and {math.degrees(angle):.1f} deg"


_WAY = "points"  # the key of a way; all others are joints


def add_go_options(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `arm go`."""
    parser.add_argument("arm", metavar="ARM", help="the arm")
    words = "a pose by name, '{JOINT: POSITION, ...}', or a way of the tip: '{points: [{x: 5 cm}]}'"
    parser.add_argument("goal", metavar="GOAL", help=words)
    options.add_timeout_option(parser, "5s")
    options.add_json_option(parser)
    add_bus_options(parser)


def run_go(arguments: argparse.Namespace) -> int:
    """Send the goal, and print how it ends."""
    from rbxcompose.commands.messages import send  # the imports for messages would slow down the others

    is_way = _WAY in keys_of(arguments.goal)
    if is_way and arguments.keep:
        return misused("arm go", "--keep is not for a way of the tip: 'keep_orientation' is a key of that")
    way = read_written(TraceModel, arguments.goal).message() if is_way else None
    arguments.name = f"{arguments.arm}/{'trace' if is_way else 'move'}"

    def do(guest: Guest) -> int:
        arguments.content = json.dumps(_move(guest, arguments) if way is None else way)
        return send(guest, arguments)

    return visit(arguments, do)


def _move(guest: Guest, arguments: argparse.Namespace) -> dict[str, Any]:
    """Return a goal of `MoveArm`.

    Raises:
        NotDoneError: if it is none, or it is unknown which joints turn and which slide.
    """
    keep = read_written(KeepModel, arguments.keep or "{}").message()
    if not arguments.goal.startswith("{"):
        return {"pose": arguments.goal, "keep": keep}
    from rbxcompose.domains.body.command_body import DESCRIPTION, described, described_body

    action = wanted([name for name in guest.graph().actions if name.givers], arguments.name, "action")
    namespace = action.name.removesuffix(f"/{arguments.name.lstrip('/')}")
    body = described_body(guest, described(guest, f"{namespace}/{DESCRIPTION}"), arguments.timeout)
    dimensions = {joint.name: LENGTH if joint.slides else ANGLE for joint in body.moving}
    positions = read_joints(arguments.goal, dimensions)
    return {"joints": list(positions), "positions": list(positions.values()), "keep": keep}


COUNT, MOST, SEED, SHOWN = 100, 100_000, 3, 3
HEAD = ("what", "solved", "median", "p95", "length", "collide")


def add_bench_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `arm bench`."""
    words = "poses, motions, and problems of each scenario (default: 100)"
    parser.add_argument("--count", type=whole_number(1, MOST), default=COUNT, metavar="N", help=words)
    words = "published problems: SCENARIO/scene0001.yaml with SCENARIO/request0001.yaml, as MotionBenchMaker has them"
    parser.add_argument("--problems", type=Path, metavar="FOLDER", help=words)


def run_bench(arguments: argparse.Namespace, robot: ArmOfRobot, works: ArmWorks) -> int:
    """Measure, and print the figures; return 1 if a plan collides by the second examination."""
    problems = list[measures.MotionProblem]()
    if arguments.problems is not None:
        try:
            files = measures.problem_files(arguments.problems, arguments.count)
            problems = [measures.read_problem(*file, works.kinematics.body.root) for file in files]
            for each in problems:
                _prove_fit(works, each)
        except measures.ProblemError as error:
            return misused("arm bench", str(error))
    kinematics, clock = works.kinematics, process_time
    samples = works.space.samples(arguments.count, SEED)
    rest = np.array([kinematics.body.joints[name].rest for name in works.space.names])
    calls = {
        "forward kinematics": measures.call_time(partial(kinematics.tip, with_jacobian=False), samples, clock),
        "Jacobian": measures.call_time(partial(kinematics.tip, with_jacobian=True), samples, clock),
    }
    tries = {
        "inverse kinematics": measures.inverse_tries(kinematics, works.space, works.solver, rest, samples, clock),
        "random motions": _motions(works, arguments.count),
    }
    for scenario, found in _solved(works, problems):
        tries[scenario] = tries.get(scenario, measures.NO_TRIES).with_(found)
    is_fast = kinematics.compiled is not None
    if arguments.json:
        data = {name: _data(entry) for name, entry in tries.items()}
        emit(json.dumps({"compiled": is_fast, "calls": calls, "tries": data}))
    else:
        how = "compiled by numba" if is_fast else "not compiled: pip install 'rbxcompose[fast]' makes it faster"
        emit(f"{len(works.space.joints)} joints, inverse kinematics {how}; times are those of the processor")
        rows = [(name, "", f"{1e6 * took:.1f} us", "", "", "") for name, took in calls.items()]
        emit(table([HEAD, *rows, *(_row(name, entry) for name, entry in tries.items())]))
        for name, one in tries.items():
            for reason, count in Counter(one.failures).most_common(SHOWN):
                often = f", {count} times" if count > 1 else ""
                emit(f"not solved in {name}{often}: {reason}")
    return 1 if any(entry.colliding for entry in tries.values()) else 0


def _motions(works: ArmWorks, count: int) -> measures.Tries:
    second = works.second_checker(works.objects)
    return measures.motion_tries(
        works.planner, measures.free_pairs(works.planner, count, SEED), second.is_free_along, process_time
    )


def _solved(works: ArmWorks, problems: list[measures.MotionProblem]) -> Iterator[tuple[str, measures.Tries]]:
    """Yield what became of each problem, with its scenario."""
    names = works.space.names
    for problem in problems:
        others = {name: at for name, at in problem.start.items() if name not in names}
        works.kinematics.place(others)
        works.place_objects(problem.objects)
        second = works.second_checker(problem.objects, others)
        start, goal = (np.array([at[name] for name in names]) for at in (problem.start, problem.goal))
        yield (
            problem.scenario,
            measures.motion_tries(works.planner, [(start, goal)], second.is_free_along, process_time),
        )


def _prove_fit(works: ArmWorks, problem: measures.MotionProblem) -> None:
    """Raise if a problem is about another arm.

    Raises:
        ProblemError: with what it lacks.
    """
    for at, word in ((problem.start, "start"), (problem.goal, "goal")):
        if lacking := [name for name in works.space.names if name not in at]:
            raise measures.ProblemError(
                f"{word} {problem.scenario}/{problem.name} does not say where '{lacking[0]}' is"
            )


def _row(name: str, one: measures.Tries) -> tuple[str, ...]:
    times = [f"{1e3 * took:.3g} ms" if one.times else "" for took in (one.median, one.p95)]
    ways = (f"{one.length:.2f} rad", f"{one.colliding}") if one.lengths else ("", "")
    return (name, f"{one.solved} of {one.count}", *times, *ways)


def _data(one: measures.Tries) -> dict[str, object]:
    figures = {"median": one.median, "p95": one.p95, "length": one.length}
    known = {name: value for name, value in figures.items() if math.isfinite(value)}
    return {"count": one.count, "solved": one.solved, **known, "colliding": one.colliding}


def draw_motion(
    arguments: argparse.Namespace, works: ArmWorks, start: Array, goal: Array, found: MotionPlan | MotionFailure | None
) -> int:
    """Draw a motion, or why there is none; return the exit code."""
    from rbxcompose.domains.arms.motion.picture import ArmPicture, draw_arm  # its libraries take long

    names, failure = works.space.names, found if isinstance(found, MotionFailure) else None
    is_at_start = found is None or (failure is not None and failure.reason.startswith("start"))
    way = works.way(found.waypoints) if isinstance(found, MotionPlan) else ()
    colliding = [] if way else works.planner.checker.colliding(start if is_at_start else goal)
    positions = [dict(zip(names, values.tolist(), strict=True)) for values in (start, goal)]
    shown = ArmPicture(
        works.kinematics.body,
        works.meshes,
        positions[0],
        works.objects,
        {} if is_at_start else positions[1],
        [link for link, joints in moved_links(works.kinematics.body, names).items() if joints],
        way,
        {link for pair in colliding for link in pair},
        f"{arguments.goal}" if found is None else f"{arguments.start or 'at rest'} to {arguments.goal} (green)",
        f"{failure.reason}: {failure.text}" if failure is not None else "",
    )
    return write_picture("arm", Path(arguments.picture), lambda: draw_arm(shown))


REACH, EASE = "reach", "manipulability"
SAMPLES, MOST_TIME = 1_000_000, 3600.0
LEAST_SIDE = 0.002  # [m] of a cell


class _ReachModel(Config):
    """Options with units."""

    cell: Length = 0.04
    """Side of a cell."""
    time: Time = 20.0
    """How long positions are tried, at most."""
    x: Length | None = None
    """Where a layer is."""
    y: Length | None = None
    """Where a layer is."""
    z: Length | None = None
    """Where a layer is."""


def add_reach_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `arm picture`."""
    parser.add_argument("what", choices=(REACH, EASE), help=f"{REACH}: of {DIRECTIONS} directions; {EASE}: Yoshikawa's")
    options.out_option("the picture, a PNG", required=True)(parser)
    words = "the layer that is shown, such as 'y: -10 cm' of the root, or 'all' (default: through the arm's base)"
    parser.add_argument("--layer", metavar="AXIS: AT", default="", help=words)
    parser.add_argument("--cell", metavar="LENGTH", default="4 cm", help="side of a cell (default: 4 cm)")
    parser.add_argument(
        "--samples", type=whole_number(1), default=SAMPLES, metavar="N", help=f"positions (default: {SAMPLES})"
    )
    parser.add_argument(
        "--seed", type=whole_number(0), default=1, metavar="S", help="the same one tries the same positions"
    )
    parser.add_argument("--time", metavar="T", default="20 s", help="when it ends at the latest (default: 20 s)")
    parser.add_argument(
        "--from", dest="start", metavar="GOAL", default="", help="how the arm is drawn (default: at rest)"
    )


def run_reach(arguments: argparse.Namespace, robot: ArmOfRobot, works: ArmWorks) -> int:
    """Try positions, draw the picture, print what is in it; return the exit code."""
    start = values_of(works, robot, arguments.start)
    layer = "" if arguments.layer in ("", "all") else f", {arguments.layer}"
    wish = read_written(_ReachModel, f"{{cell: {arguments.cell}, time: {arguments.time}{layer}}}")
    if not (wish.cell >= LEAST_SIDE and 0.0 < wish.time <= MOST_TIME):
        words = f"a cell is at least {LEAST_SIDE * 1000:g} mm, and the time above 0 and at most {MOST_TIME:g} s"
        raise NotDoneError(NO_MOTION.at(None, words))
    cut, began = _cut(arguments, works, wish, start), perf_counter()
    found = _tried(arguments, works, wish, cut)
    text = _summary(arguments, found, cut, perf_counter() - began)
    if failed := write_picture(
        "arm", Path(arguments.out), lambda: _drawn(arguments.what, works, start, found, cut, text)
    ):
        return failed
    if arguments.json:
        cells = [
            {"cell": list(cell), "directions": len(found_cell.directions), "manipulability": found_cell.manipulability}
            for cell, found_cell in sorted(found.cells.items())
        ]
        data = {"side": found.side, "of": DIRECTIONS, "samples": found.tried, "seed": arguments.seed, "cells": cells}
        emit(json.dumps({**data, "colliding": found.colliding, "joints": list(works.space.names)}))
        return 0
    emit(text)
    emit(f"wrote {arguments.out}")
    return 0


def _cut(arguments: argparse.Namespace, works: ArmWorks, wish: _ReachModel, start: Array) -> Cut | None:
    """Return the layer to show; None for all cells."""
    given = [(axis, at) for axis, at in enumerate((wish.x, wish.y, wish.z)) if at is not None]
    if arguments.layer == "all":
        return None
    if len(given) > 1:
        raise NotDoneError(NO_MOTION.at(None, "a layer has one of x, y and z"))
    if given:
        return Cut(*given[0])
    kinematics = works.kinematics
    return Cut(1, kinematics.poses(start)[kinematics.group.base].translation[1])


def _tried(arguments: argparse.Namespace, works: ArmWorks, wish: _ReachModel, cut: Cut | None) -> ReachMap:
    began, found = perf_counter(), ReachMap({}, wish.cell, 0, 0)
    work = reached(
        works.kinematics,
        works.space,
        works.planner.checker,
        side=wish.cell,
        samples=arguments.samples,
        seed=arguments.seed,
        cut=cut,
    )
    while perf_counter() - began < wish.time:
        try:
            found = next(work)
        except StopIteration:
            break
    return found


def _summary(arguments: argparse.Namespace, found: ReachMap, cut: Cut | None, took: float) -> str:
    where = "" if cut is None else f" at {'xyz'[cut.axis]} {cut.at * 100:.1f} cm"
    tried = f"{found.tried:,} random positions, seed {arguments.seed}, {took:.1f} s"
    if not found.cells:
        return f"the tip gets to no cell{where} ({tried})"
    counts = [len(cell.directions) for cell in found.cells.values()]
    best = max(cell.manipulability for cell in found.cells.values())
    some = f"{sum(counts) / len(counts):.1f} of {DIRECTIONS} directions on average, at most {max(counts)}"
    words = some if arguments.what == REACH else f"manipulability up to {best:.3g} m^3/rad^3"
    return f"the tip gets to {len(counts):,} cells of {found.side * 100:g} cm{where}: {words} ({tried})"


def _drawn(what: str, works: ArmWorks, start: Array, found: ReachMap, cut: Cut | None, text: str) -> bytes:
    from rbxcompose.domains.arms.motion.picture import ArmPicture
    from rbxcompose.domains.arms.motion.reach import ReachPicture, draw_reach

    positions = dict(zip(works.space.names, start.tolist(), strict=True))
    robot = ArmPicture(works.kinematics.body, works.meshes, positions, works.objects, caption=text)
    if what == REACH:
        values = {cell: float(len(found_cell.directions)) for cell, found_cell in found.cells.items()}
        legend = f"directions of the tip's x axis, of {DIRECTIONS}"
    else:
        values = {cell: found_cell.manipulability for cell, found_cell in found.cells.items()}
        legend = "manipulability of the tip's position [m^3/rad^3]"
    most = max(values.values(), default=math.nan)
    return draw_reach(ReachPicture(robot, values, found.side, most, legend, cut is not None))
