"""Problems for the Panda among boxes, made by seeds: they are ours, since published sets may not be on this machine."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmJointConfig, ArmWorks, LinkPairsConfig
from rbxcompose.domains.arms.motion.figures import MotionProblem, ended
from rbxcompose.domains.arms.motion.inverse_kinematics import PoseSearch, PoseTarget, solved
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.body.link_pairs import pair_of
from rbxcompose.domains.body.model import Geometry

Array = NDArray[np.float64]
Boxes = list[tuple[tuple[float, float, float], tuple[float, float, float]]]  # sizes, and where their middles are

PANDA, ROOT_LINK, TIP = "panda_description/urdf/panda.urdf", "panda_link0", "panda_hand"
MESH = re.compile(r'filename="(package://([^"]+))"')
DISABLED = re.compile(r'<disable_collisions\s+link1="([^"]+)"\s+link2="([^"]+)"')
READY = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
DOWN, FORWARD = (math.pi, 0.0), (0.0, math.pi / 2)  # roll and pitch of the hand


@dataclass(frozen=True, slots=True)
class BoxProblem:
    """Positions of the joints at the start and at the goal, of shape (n,), and boxes in the frame of the root."""

    scenario: str
    start: Array
    goal: Array
    boxes: Boxes

    @property
    def objects(self) -> tuple[PlacedObject, ...]:
        """Return the boxes as objects of a scene."""
        return tuple(
            PlacedObject(f"box{number}", Geometry("box", size), ROOT_LINK, Transform3(middle))
            for number, (size, middle) in enumerate(self.boxes)
        )

    def problem(self, joints: Sequence[str]) -> MotionProblem:
        """Return it in the form of published ones."""
        start, goal = (dict(zip(joints, array.tolist(), strict=True)) for array in (self.start, self.goal))
        return MotionProblem(self.scenario, "", start, goal, self.objects)


def described(file: str) -> Path | None:
    """Return a file of the package example-robot-data, None without it."""
    try:
        there = files("example-robot-data") or []
    except PackageNotFoundError:
        return None
    return next((Path(str(one.locate())) for one in there if str(one).endswith(file)), None)


def panda(urdf: Path) -> ArmWorks:
    """Return the Panda; as its SRDF says, some pairs of links are not watched."""
    text, share = urdf.read_text(encoding="utf-8"), urdf.parents[4]
    srdf = (urdf.parents[1] / "srdf/panda.srdf").read_text(encoding="utf-8")
    config = ArmConfig(
        name="panda",
        urdf=text,
        meshes={name: str(share / path) for name, path in MESH.findall(text)},
        base=ROOT_LINK,
        tip=TIP,
        joints={f"panda_joint{number}": ArmJointConfig() for number in range(1, 8)},
        controller="",
        follow="",
        pairs=LinkPairsConfig(ignored=[pair_of(*pair) for pair in DISABLED.findall(srdf)]),
    )
    limits = {name: joint.limits for name, joint in ArmWorks(config, time.process_time).kinematics.body.joints.items()}
    joints = {
        name: ArmJointConfig(lower=limit.lower, upper=limit.upper, velocity=limit.velocity)
        for name in config.joints
        if (limit := limits[name]) is not None
    }
    return ArmWorks(config.model_copy(update={"joints": joints}), time.process_time)


def problems(works: ArmWorks, count: int) -> Iterator[BoxProblem]:
    """Yield as many problems of each scenario, from the ready pose to where the hand reaches into it."""
    for scenario, made in SCENARIOS.items():
        found, seed = 0, 0
        while found < count:
            seed += 1
            boxes, point, (roll, pitch) = made(np.random.default_rng(seed))
            problem = BoxProblem(scenario, np.array(READY), np.array(READY), boxes)
            works.place_objects(problem.objects)
            is_free = works.planner.checker.is_free
            target = PoseTarget(Transform3(point, quaternion_from_rpy(roll, pitch, 0.0)))
            search = solved(
                PoseSearch(works.kinematics, works.space, target, problem.start, is_free, seed=seed, enough=1)
            )
            solutions = ended(search).free
            if solutions and is_free(problem.start):
                found += 1
                yield BoxProblem(scenario, problem.start, solutions[0], boxes)


def _table(random: np.random.Generator) -> tuple[Boxes, tuple[float, float, float], tuple[float, float]]:
    x, y, height = random.uniform((0.5, -0.3, 0.1), (0.65, 0.3, 0.3)).tolist()
    things: Boxes = [
        ((0.06, 0.06, tall), (x + dx, y + dy, height + tall / 2))
        for dx, dy, tall in random.uniform((-0.2, -0.4, 0.1), (0.2, 0.4, 0.3), (6, 3)).tolist()
        if math.hypot(dx, dy) > 0.15
    ]
    return [((0.7, 1.2, 0.04), (0.65, 0.0, height - 0.02)), *things], (x, y, height + 0.15), DOWN


def _bookshelf(random: np.random.Generator) -> tuple[Boxes, tuple[float, float, float], tuple[float, float]]:
    x, y, low = random.uniform((0.7, -0.25, 0.15), (0.8, 0.25, 0.3)).tolist()
    boards: Boxes = [((0.3, 0.9, 0.03), (x, 0.0, low + 0.32 * number)) for number in range(4)]
    sides: Boxes = [((0.3, 0.03, 1.0), (x, side, low + 0.48)) for side in (-0.45, 0.0, 0.45)]
    level = int(random.integers(0, 3))
    beside = y + math.copysign(0.13, y)
    return [*boards, *sides], (x - 0.17, beside, low + 0.32 * level + 0.16), FORWARD


def _box(random: np.random.Generator) -> tuple[Boxes, tuple[float, float, float], tuple[float, float]]:
    x, y, floor = random.uniform((0.45, -0.2, -0.1), (0.55, 0.2, 0.1)).tolist()
    half = 0.22
    walls: Boxes = [
        ((2 * half, 0.02, 0.35), (x, y - half, floor + 0.175)),
        ((2 * half, 0.02, 0.35), (x, y + half, floor + 0.175)),
        ((0.02, 2 * half, 0.35), (x - half, y, floor + 0.175)),
        ((0.02, 2 * half, 0.35), (x + half, y, floor + 0.175)),
    ]
    return [((2 * half, 2 * half, 0.02), (x, y, floor)), *walls], (x, y, floor + 0.2), DOWN


def _cage(random: np.random.Generator) -> tuple[Boxes, tuple[float, float, float], tuple[float, float]]:
    turn, height = random.uniform((-0.6, 0.3), (0.6, 0.6)).tolist()
    angles = [turn + (2 * number + 1) * math.pi / 10 for number in range(10)]
    bars: Boxes = [((0.03, 0.03, 1.2), (0.62 * math.cos(angle), 0.62 * math.sin(angle), 0.6)) for angle in angles]
    return bars, (0.5 * math.cos(turn), 0.5 * math.sin(turn), height), DOWN


Made = Callable[[np.random.Generator], tuple[Boxes, tuple[float, float, float], tuple[float, float]]]
SCENARIOS: dict[str, Made] = {"table": _table, "bookshelf": _bookshelf, "box": _box, "cage": _cage}
