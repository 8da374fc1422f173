"""Arms: kinematics of well-known arms, where their descriptions are installed, and planned motions."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from itertools import combinations
from pathlib import Path

import numpy as np

from benchmarks.arm_scenes import PANDA, described, panda, problems
from benchmarks.measuring import ROOT, Row, Samples
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.compiled_collisions import matrix_of
from rbxcompose.domains.arms.motion.figures import (
    NO_TRIES,
    MotionProblem,
    SecondChecker,
    Tries,
    call_time,
    free_pairs,
    inverse_tries,
    motion_tries,
    problem_files,
    read_problem,
)
from rbxcompose.domains.arms.motion.groups import ArmJoint, JointSpace, chain, interpolated
from rbxcompose.domains.arms.motion.inverse_kinematics import SolverSettings
from rbxcompose.domains.arms.motion.planner import first_bad
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import pair_of
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from rbxcompose.domains.servos.limits import MotionLimits

MEASURES = ("rbxcompose/domains/arms", "rbxcompose/domains/body")

TARGETS, MOTIONS, PROBLEMS, SOME, EXACT, STEP = 1000, 40, 10, 30, 1e-4, 0.005
TRIED = "searched, timed and examined, the scene is known before"
PEER = "RBXCOMPOSE_ROBOPLAN"  # names a Python that has RoboPlan, if this one has not
PUBLISHED = "RBXCOMPOSE_PROBLEMS"  # names the folder of a robot with an arm, and of published problems below it
ARMS = {
    "Panda": (PANDA, "panda_link0", "panda_hand"),
    "UR5": ("ur_description/urdf/ur5_robot.urdf", "base_link", "tool0"),
    "TIAGo": ("tiago_description/robots/tiago.urdf", "torso_fixed_link", "arm_tool_link"),
}
HOW = f"positions of joints for {TARGETS} poses that it can take, within 0.1 mm and 0.1 mrad, from its rest"
OWN = f"{PROBLEMS} each of a table, a bookshelf, a box and a cage, made by seeds"


def rows() -> list[Row]:
    """Return the figures of arms."""
    found = []
    for name, (file, base, tip) in ARMS.items():
        if (path := described(file)) is not None:
            found += _kinematics(name, *_arm(path, base, tip))
    works = _works("porter")
    found += _kinematics("porter, as Fetch", works.kinematics, works.space)
    return [*found, *_motions(), *_problems(), *_published()]


def _kinematics(name: str, arm: ArmKinematics, space: JointSpace) -> list[Row]:
    """Return the rows of an arm, by plain code and by that of numba."""
    goals, rest = space.samples(TARGETS, 7), np.zeros(len(space.joints))
    what, settings = f"{name}, {len(space.joints)} joints", SolverSettings(tolerance=EXACT, angle_tolerance=EXACT)
    found = []
    for how, is_wanted, most in (("", False, 1.5), (", compiled", True, 0.3)):
        if arm.hasten(is_wanted=is_wanted) is is_wanted:
            tries = inverse_tries(arm, space, settings, rest, goals, time.process_time)
            line = f"inverse kinematics of {what}{how}"
            p99 = Samples(tries.times).p99
            found += [
                Row(line, "ms", HOW, 1e3 * tries.median, p99=1e3 * p99, most=most),
                Row(f"{line}: solved", "%", HOW, 100 * tries.solved / tries.count, least=99.5),
            ]
    for word, with_jacobian in (("forward kinematics", False), ("Jacobian", True)):
        took = call_time(lambda at, wish=with_jacobian: arm.tip(at, with_jacobian=wish), goals, time.process_time)  # type: ignore[misc]
        found.append(Row(f"{word} of {what}", "us", "of the tip", 1e6 * took))
    return found


def _arm(path: Path, base: str, tip: str) -> tuple[ArmKinematics, JointSpace]:
    text = path.read_text(encoding="utf-8")
    root = read_urdf(text, path.name)
    if not isinstance(root, XmlElement):
        raise ValueError(root.message)
    description = Description(text, read_body(root)[0])
    group = chain(description.body, base, tip)
    if group is None:
        raise ValueError(f"{path.name} has no arm from {base} to {tip}")
    return ArmKinematics(description, group), JointSpace(tuple(_joint(description, joint) for joint in group.joints))


def _joint(description: Description, name: str) -> ArmJoint:
    joint = description.body.joints[name]
    if joint.kind == "continuous" or joint.limits is None:
        return ArmJoint(name, MotionLimits(), is_continuous=True)
    return ArmJoint(name, MotionLimits(joint.limits.lower, joint.limits.upper), slides=joint.slides)


def _works(robot: str) -> ArmWorks:
    made = compile_robot(str(ROOT / "robots" / robot), environment={}).robot
    config = made.components["right_arm"].config if made is not None else None
    if not isinstance(config, ArmConfig):
        raise ValueError(f"robots/{robot} has no right arm")
    return ArmWorks(config, time.process_time)


def _motions() -> list[Row]:
    works = _works("pi_robot")
    second = works.second_checker(())
    tries = motion_tries(works.planner, free_pairs(works.planner, MOTIONS, 3), second.is_free_along, time.process_time)
    how = "searched, timed and examined every 0.0015 rad on the shapes of the whole body"
    return _told("a motion of pi_robot's arm between random positions", how, tries, 150)


def _problems() -> list[Row]:
    """Return the rows of our own problems for the Panda, by us and by RoboPlan."""
    if (path := described(PANDA)) is None:
        return []
    works = panda(path)
    given = [one.problem(works.space.names) for one in problems(works, PROBLEMS)]
    mine, theirs = _tried(works, path.read_text(encoding="utf-8"), given)
    return _told("a motion of the Panda into boxes", f"{OWN}; {TRIED}", mine, None, theirs, most_ratio=2.0)


def _published() -> list[Row]:
    """Return the rows of published problems, by us and by RoboPlan, of each scenario in a folder that is named."""
    if not (folder := os.environ.get(PUBLISHED)):
        return []
    made = compile_robot(folder, environment={}).robot
    config = (
        next(component.config for component in made.components.values() if isinstance(component.config, ArmConfig))
        if made
        else None
    )
    if not isinstance(config, ArmConfig):
        raise ValueError(f"{folder} has no arm")
    works, given = ArmWorks(config, time.process_time), dict[str, list[MotionProblem]]()
    for files in problem_files(Path(folder), SOME):
        problem = read_problem(*files, works.kinematics.body.root)
        given.setdefault(problem.scenario, []).append(problem)
    found = []
    for scenario, some in given.items():
        mine, theirs = _tried(works, config.urdf, some)
        found += _told(f"{scenario} of MotionBenchMaker", f"{SOME}; {TRIED}", mine, 20.0, theirs)
    return found


def _tried(works: ArmWorks, urdf: str, given: Sequence[MotionProblem]) -> tuple[Tries, Tries | None]:
    """Return how we do, and how RoboPlan does, if it is installed, with the same shapes and pairs."""
    names, total, asked, seconds = works.space.names, NO_TRIES, list[object](), list[SecondChecker]()
    for problem in given:
        others = {name: at for name, at in problem.start.items() if name not in names}
        works.kinematics.place(others)
        works.place_objects(problem.objects)
        second = works.second_checker(problem.objects, others)
        ends = [np.array([at[name] for name in names]) for at in (problem.start, problem.goal)]
        first_bad(works.planner.checker, ends[0][None])  # takes over the scene, which RoboPlan has before it is timed
        total = total.with_(motion_tries(works.planner, [(ends[0], ends[1])], second.is_free_along, time.process_time))
        seconds.append(second)
        asked.append(_asked(works, problem, others, [end.tolist() for end in ends]))
    for name, file in works.meshes.items():
        urdf = urdf.replace(f'"{name}"', f'"{file.absolute()}"')
    return total, _roboplan({"urdf": urdf, "joints": names, "step": 0.02, "problems": asked}, seconds)


def _asked(works: ArmWorks, problem: MotionProblem, others: Mapping[str, float], ends: list[list[float]]) -> object:
    """Return a problem for RoboPlan: pieces of objects are `NAME/NUMBER`; it watches the pairs that we do."""
    pieces = {
        f"{each.name}/{number}": (each.name, piece)
        for each in problem.objects
        for number, piece in enumerate(each.all_pieces)
    }
    owners = {name: owner for name, (owner, _) in pieces.items()}
    owners |= {name: name for name, link in works.kinematics.body.links.items() if link.collisions}
    watched = works.checker(problem.objects).watched_pairs
    return {
        "scenario": problem.scenario,
        "shapes": [
            (name, piece.shape.kind, piece.shape.size, matrix_of(piece.pose).tolist())
            for name, (_, piece) in pieces.items()
        ],
        "off": [pair for pair in combinations(owners, 2) if pair_of(*(owners[side] for side in pair)) not in watched],
        "others": dict(others),
        "start": ends[0],
        "goal": ends[1],
    }


def _told(
    what: str, how: str, tries: Tries, most: float | None, peer: Tries | None = None, most_ratio: float | None = None
) -> list[Row]:
    name = "RoboPlan, path only" if peer is not None else ""
    theirs = peer or NO_TRIES
    share = 100 * theirs.solved / theirs.count if theirs.count else None
    return [
        Row(
            what,
            "ms",
            how,
            1e3 * tries.median,
            1e3 * tries.p95,
            1e3 * theirs.median if peer else None,
            name,
            most,
            most_ratio=most_ratio,
        ),
        Row(f"{what}: planned", "%", how, 100 * tries.solved / tries.count, None, share, name),
        Row(f"{what}: length", "rad", how, tries.length, None, theirs.length if peer else None, name),
        Row(
            f"{what}: in collision",
            "",
            "of those that were planned, by Pinocchio's own geometry, every 0.005 rad",
            tries.colliding,
            peer=theirs.colliding if peer else None,
            against=name,
            most=0,
        ),
    ]


def _roboplan(asked: Mapping[str, object], seconds: Sequence[SecondChecker]) -> Tries | None:
    """Return how RoboPlan does, whose paths are examined as ours are; None if it is not installed."""
    python = os.environ.get(PEER) or (sys.executable if find_spec("roboplan") is not None else "")
    if not python:
        return None
    done = subprocess.run(
        [python, str(Path(__file__).with_name("roboplan_ends.py"))],
        input=json.dumps(asked),
        env={**os.environ, "PYTHONPATH": ""},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    total = NO_TRIES
    for second, answer in zip(seconds, json.loads(done.stdout), strict=True):
        path_found = np.array(answer["path"])
        if not len(path_found):
            total = total.with_(Tries(1, 0, (answer["time"],)))
            continue
        length = float(np.linalg.norm(np.diff(path_found, axis=0), axis=1).sum())
        is_free = all(map(second.is_free, interpolated(path_found, STEP)))
        total = total.with_(Tries(1, 1, (answer["time"],), (length,), int(not is_free)))
    return total
