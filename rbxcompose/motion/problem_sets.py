"""Published problems of motion planning: scenes and requests as MoveIt writes them, one YAML or JSON file each.

MotionBenchMaker's sets are such folders (Chamzas et al., MotionBenchMaker: A Tool to Generate and Benchmark Motion
Planning Datasets, 2021): `SCENARIO/scene0001.yaml` with the obstacles, `SCENARIO/request0001.yaml` with start and goal.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from rbxcompose.body.model import Geometry
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3
from rbxcompose.motion.scene import PlacedObject, ScenePiece
from rbxcompose.regular_files import read_regular

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
    scenes = sorted(one for one in folder.rglob(f"{SCENE}*") if one.suffix in SUFFIXES)
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
        objects = tuple(_object(one, root) for one in _data(scene)["world"]["collision_objects"])
        here, asked = request, _data(request)
        state = asked["start_state"]["joint_state"]
        start = {str(name): float(at) for name, at in zip(state["name"], state["position"], strict=True)}
        wanted = asked["goal_constraints"][0]["joint_constraints"]
        goal = {str(one["joint_name"]): float(one["position"]) for one in wanted}
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
        ScenePiece(_shape(one), _pose(pose))
        for one, pose in zip(data["primitives"], data["primitive_poses"], strict=True)
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
    return [float(data[name]) for name in names] if isinstance(data, dict) else [float(one) for one in data]
