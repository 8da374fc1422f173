"""`arm bench`: measures the kinematics of an arm, and motions between random positions and of published problems."""

from __future__ import annotations

import argparse
import json
import math
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from rbxcompose.arm_config import ArmWorks
from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import misused, tell
from rbxcompose.motion.arm_figures import NO_TRIES, Tries, call_time, free_pairs, inverse_tries, motion_tries
from rbxcompose.motion.problem_sets import MotionProblem, ProblemError, problem_files, read_problem

COUNT, MOST, SEED, SHOWN = 100, 100_000, 3, 3
HEAD = ("what", "solved", "median", "p95", "length", "collide")


def add_bench_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `arm bench`."""
    words = "poses, motions, and problems of each scenario (default: 100)"
    parser.add_argument("--count", type=_count, default=COUNT, metavar="N", help=words)
    words = "published problems: SCENARIO/scene0001.yaml with SCENARIO/request0001.yaml, as MotionBenchMaker has them"
    parser.add_argument("--problems", type=Path, metavar="FOLDER", help=words)


def _count(text: str) -> int:
    if not text.isdecimal() or not 0 < len(text) <= len(str(MOST)) or not 0 < int(text) <= MOST:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 to {MOST}, not '{text}'")
    return int(text)


def run_bench(arguments: argparse.Namespace, works: ArmWorks) -> int:
    """Measure, and print the figures; return 1 if a plan collides by the second examination."""
    problems = list[MotionProblem]()
    if arguments.problems is not None:
        try:
            files = problem_files(arguments.problems, arguments.count)
            problems = [read_problem(*one, works.kinematics.body.root) for one in files]
            for each in problems:
                _prove_fit(works, each)
        except ProblemError as error:
            return misused("arm bench", str(error))
    kinematics, clock = works.kinematics, process_time
    samples = works.space.samples(arguments.count, SEED)
    rest = np.array([kinematics.body.joints[name].rest for name in works.space.names])
    calls = {
        "forward kinematics": call_time(partial(kinematics.tip, with_jacobian=False), samples, clock),
        "Jacobian": call_time(partial(kinematics.tip, with_jacobian=True), samples, clock),
    }
    tries = {
        "inverse kinematics": inverse_tries(kinematics, works.space, works.solver, rest, samples, clock),
        "random motions": _motions(works, arguments.count),
    }
    for scenario, found in _solved(works, problems):
        tries[scenario] = tries.get(scenario, NO_TRIES).with_(found)
    is_fast = kinematics.compiled is not None
    if arguments.json:
        data = {name: _data(one) for name, one in tries.items()}
        tell(json.dumps({"compiled": is_fast, "calls": calls, "tries": data}))
    else:
        how = "compiled by numba" if is_fast else "not compiled: pip install 'rbxcompose[fast]' makes it faster"
        tell(f"{len(works.space.joints)} joints, inverse kinematics {how}; times are those of the processor")
        rows = [(name, "", f"{1e6 * took:.1f} us", "", "", "") for name, took in calls.items()]
        tell(table([HEAD, *rows, *(_row(name, one) for name, one in tries.items())]))
        for name, one in tries.items():
            for reason, count in Counter(one.failures).most_common(SHOWN):
                tell(
                    f"not solved in {name}, {count} times: {reason}" if count > 1 else f"not solved in {name}: {reason}"
                )
    return 1 if any(one.colliding for one in tries.values()) else 0


def _motions(works: ArmWorks, count: int) -> Tries:
    second = works.second_checker(works.objects)
    return motion_tries(works.planner, free_pairs(works.planner, count, SEED), second.is_free_along, process_time)


def _solved(works: ArmWorks, problems: list[MotionProblem]) -> Iterator[tuple[str, Tries]]:
    """Yield what became of each problem, with its scenario."""
    names = works.space.names
    for one in problems:
        others = {name: at for name, at in one.start.items() if name not in names}
        works.kinematics.place(others)
        works.place_objects(one.objects)
        second = works.second_checker(one.objects, others)
        start, goal = (np.array([at[name] for name in names]) for at in (one.start, one.goal))
        yield one.scenario, motion_tries(works.planner, [(start, goal)], second.is_free_along, process_time)


def _prove_fit(works: ArmWorks, problem: MotionProblem) -> None:
    """Raise if a problem is about another arm.

    Raises:
        ProblemError: with what it lacks.
    """
    for at, word in ((problem.start, "start"), (problem.goal, "goal")):
        if lacking := [name for name in works.space.names if name not in at]:
            raise ProblemError(f"{word} {problem.scenario}/{problem.name} does not say where '{lacking[0]}' is")


def _row(name: str, one: Tries) -> tuple[str, ...]:
    times = [f"{1e3 * took:.3g} ms" if one.times else "" for took in (one.median, one.p95)]
    ways = (f"{one.length:.2f} rad", f"{one.colliding}") if one.lengths else ("", "")
    return (name, f"{one.solved} of {one.count}", *times, *ways)


def _data(one: Tries) -> dict[str, object]:
    figures = {"median": one.median, "p95": one.p95, "length": one.length}
    known = {name: value for name, value in figures.items() if math.isfinite(value)}
    return {"count": one.count, "solved": one.solved, **known, "colliding": one.colliding}
