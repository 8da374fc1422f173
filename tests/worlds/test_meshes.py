"""Meshes in worlds: seen, touched and pushed as the boxes that they look like."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.contact import first_contact, overlap, touching
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import (
    CircleFootprint,
    Footprint,
    PolygonFootprint,
    WorldBox,
    WorldMesh,
    WorldShape,
)
from rbxcompose.domains.worlds.world import SimulatedWorld, no_walls, world_message, world_of
from rbxcompose.domains.worlds.world_file import world_mesh
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.testing import check_text
from tests.worlds.physical import empty, from_urdf
from tests.worlds.scenes import ANGLES

trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
SIDES = (0.6, 0.4, 0.5)
GRID = GridMap(np.zeros((1, 1), np.int8), 0.1, Pose2(50, 50))
PLACES = st.floats(-1.5, 1.5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("meshes")
    trimesh.creation.box(SIDES).export(made / "box.stl")
    top = trimesh.creation.box((1.2, 0.8, 0.05)).apply_translation((0, 0, 0.7))
    legs = [
        trimesh.creation.box((0.06, 0.06, 0.6)).apply_translation((x, y, 0.3)) for x in (-0.5, 0.5) for y in (-0.3, 0.3)
    ]
    trimesh.util.concatenate([top, *legs]).export(made / "table.stl")
    return made


@pytest.fixture(scope="module")
def box(folder: Path) -> WorldMesh:
    return world_mesh(folder / "box.stl", (1.0, 1.0, 1.0))


def pair(mesh: WorldMesh, x: float, y: float, heading: float) -> tuple[WorldShape, WorldShape]:
    """Return a box as a mesh and as a box, at the same pose."""
    return WorldShape("it", mesh, Pose2(x, y, heading)), WorldShape("it", WorldBox(SIDES), Pose2(x, y, heading))


@given(PLACES, PLACES, ANGLES, st.floats(0.01, 0.49))
def test_a_laser_sees_a_mesh_as_the_box_that_it_is(
    box: WorldMesh, x: float, y: float, heading: float, z: float
) -> None:
    angles = np.linspace(-math.pi, math.pi, 180)
    mesh, other = (
        SimulatedWorld("", shapes=(one,)).distances((0, 0), angles, 5, 0, z) for one in pair(box, x, y, heading)
    )
    differ = ~np.isclose(mesh, other, atol=1e-4)
    assert differ.sum() <= 2  # rays along an edge


@given(PLACES, PLACES, ANGLES, ANGLES, st.booleans())
def test_a_robot_touches_a_mesh_where_it_touches_the_box(
    box: WorldMesh, x: float, y: float, heading: float, ahead: float, is_round: bool
) -> None:
    robot: Footprint = CircleFootprint(0.2)
    if not is_round:
        robot = PolygonFootprint(((0.3, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.3, -0.1)))
    start, end = Pose2(0, 0, ahead), Pose2(0.1 * math.cos(ahead), 0.1 * math.sin(ahead), ahead)
    mesh, other = (first_contact(GRID, one.convex, robot, start, end) for one in pair(box, x, y, heading))
    deep, deep_other = (overlap(GRID, one.convex, robot, start) for one in pair(box, x, y, heading))
    assert deep[0] == pytest.approx(deep_other[0], abs=1e-4)
    if deep[0] > 0:
        return
    assert (mesh is None) == (other is None) or min(one.part for one in (mesh, other) if one is not None) > 0.99
    if mesh is not None and other is not None:
        assert mesh.part == pytest.approx(other.part, abs=1e-3)
        assert mesh.what == "it"


def test_bumpers_feel_a_mesh_in_its_direction(box: WorldMesh) -> None:
    (shape, _) = pair(box, 0.501, 0, 0)
    assert touching(GRID, shape.convex, CircleFootprint(0.2), Pose2(), 0.002) == pytest.approx([0], abs=0.01)


def test_a_laser_looks_between_the_legs_of_a_table_and_a_robot_that_is_low_drives_there(folder: Path) -> None:
    table = WorldShape("table", world_mesh(folder / "table.stl", (1.0, 1.0, 1.0)), Pose2(2, 0))
    assert len(table.convex) == 5
    world = SimulatedWorld("", shapes=(table,), radius=0.15, height=0.3)
    ahead = world.distances((0, 0), np.array([0.0, math.atan2(0.3, 2 - 0.5)]), 9, 0, 0.2)
    assert math.isinf(ahead[0])
    assert ahead[1] == pytest.approx(math.hypot(1.5, 0.3), abs=0.05)
    high = world.distances((0, 0), np.array([0.0]), 9, 0, 0.7)
    assert high == pytest.approx([1.4], abs=1e-4)
    assert world.first_contact(Pose2(2, 0), Pose2(2.1, 0), 0) is None
    tall = SimulatedWorld("", shapes=(table,), radius=0.15, height=1.0)
    assert tall.touching(Pose2(1.24, 0), 0.02, 0).size


def test_a_mesh_arrives_as_it_was_sent(folder: Path) -> None:
    table = WorldShape("table", world_mesh(folder / "table.stl", (1.0, 1.0, 1.0)), Pose2(2, 0, 1))
    again = world_of(world_message(SimulatedWorld("", shapes=(table,)), Header()))
    assert again.shapes[0].outlines == table.outlines
    assert again.shapes[0].solid.height == pytest.approx(0.725)
    assert again.grid is no_walls()


def test_the_engine_lets_a_mesh_stand_and_fall_by_its_mass(folder: Path) -> None:
    pytest.importorskip("mujoco", reason="mujoco is not installed")
    from rbxcompose.domains.worlds.physics.engine import PhysicsWorld

    robot = from_urdf('<link name="base"/>', drives=False)
    table = WorldShape("table", world_mesh(folder / "table.stl", (1.0, 1.0, 1.0)), Pose2(2, 0), z=0.3, mass=12.0)
    engine = PhysicsWorld(robot, empty(robot, table), {"table": 12.0})
    engine.step(1.5)
    pose = engine.shape_pose("table")
    assert pose.translation[:2] == pytest.approx((2, 0), abs=0.01)
    assert pose.translation[2] == pytest.approx(0.725 / 2, abs=0.01)  # its middle, standing on four legs
    engine.close()


def test_a_sheet_that_leans_is_refused(tmp_path: Path) -> None:
    sheet = trimesh.Trimesh([(0, 0, 0), (1, 0, 1), (1, 1, 1), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    sheet.export(tmp_path / "sheet.stl")
    with pytest.raises(ValueError, match="is flat and leans"):
        world_mesh(tmp_path / "sheet.stl", (1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("written", "code"), [("nowhere.stl", "RBX1301"), ("text.stl", "RBX3604"), ("none.step", "RBX3604")]
)
def test_a_mesh_that_cannot_be_used_is_a_finding_at_its_place(tmp_path: Path, written: str, code: str) -> None:
    world = f"rbx: 1\nkind: World\nname: w\nobjects:\n  thing: {{mesh: {written}}}\n"
    others = {"w.yaml": world, "text.stl": "no mesh", "none.step": "no mesh"}
    robot = "rbx: 1\nkind: Robot\nname: r\nworld: w.yaml\ncomponents:\n  base: {type: diff_drive_sim}\n"
    checked = check_text(robot, tmp_path, others=others)
    (finding,) = [each for each in checked.compilation.report if each.code == code]
    assert finding.span is not None
    assert (Path(finding.span.file).name, finding.span.line, finding.span.column) == ("w.yaml", 5, 17)
