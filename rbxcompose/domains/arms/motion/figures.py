"""What an arm achieves: speed and success of its kinematics and plans, on random and on published problems.

`SecondChecker` is a second opinion on a motion: Pinocchio's own reading of the URDF and its own geometry, every pair
tried by itself. It shares the shapes of objects, the meshes that are not STL, since it would misread them, and the
pairs that may touch with the examination of a plan, and nothing else: neither its broad phase nor its samples. So what
benchmarks call free does not rest on what the planner believes.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping
from dataclasses import astuple
from itertools import combinations, islice, pairwise
from pathlib import Path
from typing import Any, TypeVar

import yaml

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import STL, TOUCH, coal_shape
from rbxcompose.domains.arms.motion.groups import JointSpace, leader_of
from rbxcompose.domains.arms.motion.inverse_kinematics import PoseSearch, PoseTarget, SolverSettings, solved
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionPlanner, MotionRequest
from rbxcompose.domains.arms.motion.scene import PlacedObject, ScenePiece
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import LinkPair, pair_of
from rbxcompose.domains.body.model import Geometry
from rbxcompose.domains.body.pinocchio_model import PinocchioModel

GRID = 20  # instants for each point of a trajectory, at which its greatest speed is looked for


class SecondChecker:
    """The body among objects; pairs in `allowed` do not count, nor those that the arm does not move to each other."""

    def __init__(
        self,
        description: Description,
        joints: tuple[str, ...],
        allowed: Collection[LinkPair],
        objects: Iterable[PlacedObject] = (),
        positions: Mapping[str, float] | None = None,
    ) -> None:
        """Build it; `joints` are those of the arm, `positions` where all others are [rad or m], or they are at rest."""
        import pinocchio

        self._pinocchio, self._joints, self._positions = pinocchio, joints, dict(positions or {})
        self._whole = PinocchioModel(description)
        model, text = self._whole.model, description.text
        for name, path in description.meshes.items():
            text = text.replace(f'"{name}"', f'"{path.absolute()}"')
        self._geometry: Any = pinocchio.buildGeomFromUrdfString(model, text, pinocchio.COLLISION)
        for geometry_object in self._geometry.geometryObjects:
            is_mesh = str(geometry_object.geometry.getObjectType()) == "OT_BVH"
            if is_mesh and not geometry_object.meshPath.lower().endswith(STL):
                geometry_object.geometry = coal_shape(
                    Geometry("mesh", tuple(geometry_object.meshScale), geometry_object.meshPath), {}
                )
        owners = [model.frames[object_.parentFrame].name for object_ in self._geometry.geometryObjects]
        touching, there = set(allowed), tuple(objects)
        for thing in there:
            owners += [thing.name] * self._add(thing)
            touching |= {pair_of(thing.name, other) for other in (*thing.touches, *thing.touches_objects)}
        every = description.body.joints
        arm = {model.getJointId(name) for name, joint in every.items() if leader_of(joint, every)[0] in joints}
        moved = [arm & set(model.supports[object_.parentJoint]) for object_ in self._geometry.geometryObjects]
        for first, second in combinations(range(len(owners)), 2):
            if moved[first] != moved[second] and pair_of(owners[first], owners[second]) not in touching:
                self._geometry.addCollisionPair(pinocchio.CollisionPair(first, second))
        self._data = self._geometry.createData()
        for request, pair in zip(self._data.collisionRequests, self._geometry.collisionPairs, strict=True):
            shapes = (self._geometry.geometryObjects[one].geometry for one in (pair.first, pair.second))
            is_alike = len({str(shape.getObjectType()) for shape in shapes}) == 1
            request.security_margin = -TOUCH if is_alike else 0.0  # coal has none between a mesh and another shape

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides at positions of the arm's joints, of shape (n,)."""
        whole, at = self._whole, dict(zip(self._joints, values.tolist(), strict=True))
        q = whole.q({**self._positions, **at})
        return not self._pinocchio.computeCollisions(whole.model, whole.data, self._geometry, self._data, q, True)

    def is_free_along(self, trajectory: Trajectory, step: float) -> bool:
        """Return whether nothing collides on the curves of a motion, every `step` [rad or m]."""
        return all(map(self.is_free, sampled(trajectory, step)))

    def _add(self, thing: PlacedObject) -> int:
        """Add an object; return how many shapes it has."""
        pinocchio, pieces = self._pinocchio, tuple(thing.all_pieces)
        frame = self._whole.model.frames[self._whole.frames[thing.link]]
        for number, piece in enumerate(pieces):
            pose = np.array((*piece.pose.translation, *piece.pose.rotation), dtype=float)
            placement, shape = frame.placement * pinocchio.XYZQUATToSE3(pose), coal_shape(piece.shape, {})
            name = f"{thing.name}/{number}"
            self._geometry.addGeometryObject(pinocchio.GeometryObject(name, frame.parentJoint, placement, shape))
        return len(pieces)


def sampled(trajectory: Trajectory, step: float) -> Array:
    """Return positions on the curves of a motion, of shape (m, n), at equal times, at most `step` [rad or m] apart."""
    grid = _at(trajectory, GRID * len(trajectory.times))
    farthest = float(np.abs(np.diff(grid, axis=0)).max()) * (len(grid) - 1)  # if it always went as fast as it does once
    return _at(trajectory, math.ceil(1.1 * farthest / step) + 2)


def _at(trajectory: Trajectory, count: int) -> Array:
    """Return positions at equal times, of shape (count, n), by Hermite's cubic base functions."""
    knots, times = trajectory.times, np.linspace(0.0, trajectory.duration, count)
    index = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
    length = np.diff(knots)[index]
    s = ((times - knots[index]) / length)[:, None]
    rest, h = 1.0 - s, length[:, None]
    places = (1.0 + 2.0 * s) * rest**2 * trajectory.positions[index] + s**2 * (3.0 - 2.0 * s) * trajectory.positions[
        index + 1
    ]
    return np.asarray(
        places + h * s * rest * (rest * trajectory.velocities[index] - s * trajectory.velocities[index + 1])
    )


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
        return Tries(*(one + two for one, two in zip(astuple(self), astuple(other), strict=True)))


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
    return PlacedObject.of(str(data["id"]), root, whole, pieces)


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
