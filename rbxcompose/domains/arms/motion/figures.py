"""What an arm achieves: speed and success of its kinematics and plans, on random and on published problems."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yaml

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.groups import Array, JointSpace
from rbxcompose.domains.arms.motion.inverse_kinematics import PoseSearch, PoseTarget, SolverSettings, solved
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionPlanner, MotionRequest
from rbxcompose.domains.arms.motion.scene import PlacedObject, ScenePiece
from rbxcompose.domains.body.model import Geometry

Seconds = Callable[[], float]
T = TypeVar("T")
CALLS, TURNS = 100, 15  # of something that takes microseconds
AGAIN = 0.005  # [rad or m] between positions that are examined once more
SHARE = 100  # random positions for each that is wanted and collides with nothing


@dataclass(frozen=True, slots=True)
class Tries:
    """How many of `count` tries succeeded, how long each of all took [s], and what is known of those that succeeded."""

    count: int
    solved: int
    times: tuple[float, ...]
    lengths: tuple[float, ...] = ()
    """Of ways [rad], as the Euclidean distance of joints."""
    colliding: int = 0
    """Of the ways, by a second examination."""
    failures: tuple[str, ...] = ()
    """Why tries did not succeed."""

    @property
    def median(self) -> float:
        """Return the median time [s]; of nothing, it is not a number."""
        return statistics.median(self.times) if self.times else math.nan

    @property
    def p95(self) -> float:
        """Return the time that 95 of 100 stay below [s]."""
        ordered = sorted(self.times)
        return ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))] if ordered else math.nan

    @property
    def length(self) -> float:
        """Return the median length of ways [rad]."""
        return statistics.median(self.lengths) if self.lengths else math.nan

    def with_(self, other: Tries) -> Tries:
        """Return these tries and others."""
        return Tries(
            self.count + other.count,
            self.solved + other.solved,
            self.times + other.times,
            self.lengths + other.lengths,
            self.colliding + other.colliding,
            self.failures + other.failures,
        )


NO_TRIES = Tries(0, 0, ())


def call_time(job: Callable[[Array], object], inputs: Array, clock: Seconds) -> float:
    """Return the median time of a call [s], for inputs of shape (m, n)."""
    job(inputs[0])
    found = []
    for _ in range(TURNS):
        began = clock()
        for index in range(CALLS):
            job(inputs[index % len(inputs)])
        found.append((clock() - began) / CALLS)
    return statistics.median(found)


def inverse_tries(
    kinematics: ArmKinematics, space: JointSpace, settings: SolverSettings, start: Array, goals: Array, clock: Seconds
) -> Tries:
    """Solve for the poses of the tip at positions of shape (m, n), each from `start`; collisions are not looked at."""
    times, found = [], 0
    for seed, goal in enumerate(goals):
        target = PoseTarget(kinematics.tip_pose(goal), False, settings.tolerance, settings.angle_tolerance)
        began = clock()
        search = PoseSearch(kinematics, space, target, start, lambda _: True, seed, settings.restarts, 1)
        found += bool(ended(solved(search)).free)
        times.append(clock() - began)
    return Tries(len(goals), found, tuple(times))


def motion_tries(
    planner: MotionPlanner,
    pairs: Iterable[tuple[Array, Array]],
    is_free_along: Callable[[Trajectory, float], bool],
    clock: Seconds,
) -> Tries:
    """Plan from each start to its goal, timed and examined; what comes out is examined once more."""
    total = NO_TRIES
    for start, goal in pairs:
        began = clock()
        found = ended(planner.plan(MotionRequest(start, goal)))
        took = clock() - began
        if not isinstance(found, MotionPlan):
            total = total.with_(Tries(1, 0, (took,), failures=(f"{found.reason}: {found.text}",)))
            continue
        length = float(np.linalg.norm(np.diff(found.waypoints, axis=0), axis=1).sum())
        is_free = found.trajectory is None or is_free_along(found.trajectory, AGAIN)
        total = total.with_(Tries(1, 1, (took,), (length,), int(not is_free)))
    return total


def free_pairs(planner: MotionPlanner, count: int, seed: int) -> list[tuple[Array, Array]]:
    """Return at most so many pairs of random positions that collide with nothing, each of shape (n,)."""
    samples = planner.space.samples(SHARE * (count + 1), seed)
    return list(pairwise(islice(filter(planner.checker.is_free, samples), count + 1)))


def ended(work: Generator[object, None, T]) -> T:
    """Return what a generator returns, after all that it yields."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            result: T = end.value
            return result


LARGEST = 10_000_000  # [bytes] of a file
SCENE, REQUEST = "scene", "request"  # what names of files begin with
SUFFIXES = (".yaml", ".yml", ".json")
PRIMITIVES = {"1": "box", "2": "sphere", "3": "cylinder", "4": "cone"}  # MoveIt's numbers
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class ProblemError(ValueError):
    """Raised for files that are no problems, with the reason."""


@dataclass(frozen=True, slots=True)
class MotionProblem:
    """Positions of joints [rad or m] at the start and at the goal, and obstacles in the frame of the root."""

    scenario: str
    name: str
    start: Mapping[str, float]
    goal: Mapping[str, float]
    objects: tuple[PlacedObject, ...]


def problem_files(folder: Path, most: int) -> Iterator[tuple[Path, Path]]:
    """Yield scenes with their requests, at most so many of each folder, in the order of their names.

    Raises:
        ProblemError: if there are none.
    """
    taken: dict[Path, int] = {}
    scenes = sorted(path for path in folder.rglob(f"{SCENE}*") if path.suffix in SUFFIXES)
    for scene in scenes:
        request = scene.with_name(scene.name.replace(SCENE, REQUEST, 1))
        if request.is_file() and taken.get(scene.parent, 0) < most:
            taken[scene.parent] = taken.get(scene.parent, 0) + 1
            yield scene, request
    if not taken:
        raise ProblemError(f"there are no scenes with requests in '{folder}': 'scene0001.yaml' and 'request0001.yaml'")


def read_problem(scene: Path, request: Path, root: str) -> MotionProblem:
    """Read one; `root` is the link in whose frame obstacles are.

    Raises:
        ProblemError: if it cannot be read.
    """
    here = scene
    try:
        objects = tuple(_object(each, root) for each in _data(scene)["world"]["collision_objects"])
        here, asked = request, _data(request)
        state = asked["start_state"]["joint_state"]
        start = {str(name): float(at) for name, at in zip(state["name"], state["position"], strict=True)}
        wanted = asked["goal_constraints"][0]["joint_constraints"]
        goal = {str(constraint["joint_name"]): float(constraint["position"]) for constraint in wanted}
    except OSError as error:
        raise ProblemError(f"'{here}' cannot be read: {error.strerror or error}") from error
    except yaml.YAMLError as error:
        raise ProblemError(f"'{here}' is neither YAML nor JSON") from error
    except KeyError as error:
        raise ProblemError(f"'{here}' is no {_kind(here)} of MoveIt: it lacks {error}") from error
    except (IndexError, RecursionError, TypeError, ValueError) as error:
        raise ProblemError(f"'{here}' is no {_kind(here)} of MoveIt: {error}") from error
    return MotionProblem(scene.parent.name, scene.stem.removeprefix(SCENE), start, goal, objects)


def _kind(path: Path) -> str:
    return SCENE if path.name.startswith(SCENE) else REQUEST


def _data(path: Path) -> Any:
    loader = _Loader(read_regular(path, LARGEST))
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


def _object(data: Any, root: str) -> PlacedObject:
    whole = _pose(data["pose"]) if "pose" in data else Transform3()
    pieces = [
        ScenePiece(_shape(primitive), _pose(pose))
        for primitive, pose in zip(data["primitives"], data["primitive_poses"], strict=True)
    ]
    first, *others = pieces
    return PlacedObject(str(data["id"]), first.shape, root, whole, pieces=tuple(others), shape_pose=first.pose)


def _shape(data: Any) -> Geometry:
    kind, sizes = str(data["type"]), tuple(map(float, data["dimensions"]))
    kind = PRIMITIVES.get(kind, kind)
    if kind in ("cylinder", "cone"):
        height, radius = sizes
        return Geometry(kind, (radius, height))
    if kind not in PRIMITIVES.values() or len(sizes) != {"box": 3, "sphere": 1}[kind]:
        raise ValueError(f"there is no '{kind}' of {len(sizes)} lengths")
    return Geometry(kind, sizes)


def _pose(data: Any) -> Transform3:
    x, y, z = _numbers(data["position"], "xyz")
    a, b, c, w = _numbers(data["orientation"], "xyzw")
    return Transform3((x, y, z), (a, b, c, w))


def _numbers(data: Any, names: str) -> list[float]:
    """Return numbers that are a list or a map."""
    return [float(data[name]) for name in names] if isinstance(data, dict) else [float(item) for item in data]
