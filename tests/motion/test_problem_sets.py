"""Published problems are read as they are written; what is none says why."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.domains.arms.motion.figures import ProblemError, problem_files, read_problem
from rbxcompose.domains.body.model import Geometry
from tests.loops import for_all

SCENE = """
world:
  collision_objects:
    - id: can
      primitive_poses:
        - {position: [0.5, 0.1, 0.2], orientation: [0, 0, 0, 1]}
      primitives:
        - {type: cylinder, dimensions: [0.14, 0.03]}
    - id: shelf
      pose: {position: {x: 1, y: 0, z: 0}, orientation: {x: 0, y: 0, z: 0, w: 1}}
      primitives: [{type: 1, dimensions: [1, 2, 3]}, {type: sphere, dimensions: [0.1]}]
      primitive_poses:
        - {position: [0, 0, 0], orientation: [0, 0, 0, 1]}
        - {position: [0, 0, 1], orientation: [0, 0, 0, 1]}
"""
REQUEST = """
start_state: {joint_state: {name: [a, b], position: [0, 0.5]}}
goal_constraints: [{joint_constraints: [{joint_name: a, position: 1}]}]
"""


def written(folder: Path, scene: str = SCENE, request: str = REQUEST, number: int = 1) -> tuple[Path, Path]:
    folder.mkdir(exist_ok=True)
    files = folder / f"scene000{number}.yaml", folder / f"request000{number}.yaml"
    for path, text in zip(files, (scene, request), strict=True):
        path.write_text(text, encoding="utf-8")
    return files


def test_obstacles_start_and_goal_are_those_of_the_files(tmp_path: Path) -> None:
    problem = read_problem(*written(tmp_path / "box"), "base")
    assert (problem.scenario, problem.name) == ("box", "0001")
    assert problem.start == {"a": 0.0, "b": 0.5}
    assert problem.goal == {"a": 1.0}
    can, shelf = problem.objects
    assert can.shape == Geometry("cylinder", (0.03, 0.14))
    assert [piece.pose.translation for piece in can.all_pieces] == [(0.5, 0.1, 0.2)]
    assert [piece.shape.kind for piece in shelf.all_pieces] == ["box", "sphere"]
    assert [piece.pose.translation for piece in shelf.all_pieces] == [(1.0, 0.0, 0.0), (1.0, 0.0, 1.0)]
    assert {placed_object.link for placed_object in problem.objects} == {"base"}


def test_at_most_so_many_of_each_scenario_are_taken_and_those_without_a_request_are_not(tmp_path: Path) -> None:
    for number in range(1, 5):
        for name in ("box", "cage"):
            written(tmp_path / name, number=number)
    (tmp_path / "box/request0001.yaml").unlink()
    found = [f"{path.parent.name}/{path.name}" for path, _ in problem_files(tmp_path, 2)]
    assert found == ["box/scene0002.yaml", "box/scene0003.yaml", "cage/scene0001.yaml", "cage/scene0002.yaml"]


@for_all(
    "scene, request_, told",
    [
        ("[", REQUEST, "scene0001.yaml' is neither YAML nor JSON"),
        ("!!python/object:os.system {}", REQUEST, "scene0001.yaml' is neither YAML nor JSON"),
        ("{}", REQUEST, "is no scene of MoveIt: it lacks 'world'"),
        ("- 1", REQUEST, "is no scene of MoveIt"),
        (SCENE.replace("sphere", "torus"), REQUEST, "there is no 'torus'"),
        (SCENE.replace("[0.14, 0.03]", "[0.14]"), REQUEST, "is no scene of MoveIt"),
        (SCENE, REQUEST.replace("[0, 0.5]", "[0]"), "is no request of MoveIt"),
        (SCENE, REQUEST.replace("position: 1", "position: x"), "is no request of MoveIt"),
        (SCENE, "goal_constraints: []", "it lacks 'start_state'"),
    ],
)
def test_what_is_no_problem_says_why(scene: str, request_: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(ProblemError, match=told):
        read_problem(*written(tmp_path / "box", scene, request_), "base")


def test_a_folder_without_problems_says_what_they_look_like(tmp_path: Path) -> None:
    with pytest.raises(ProblemError, match="there are no scenes"):
        list(problem_files(tmp_path, 1))
