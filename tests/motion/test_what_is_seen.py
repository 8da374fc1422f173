"""Arms that keep free what is seen: their spheres cover all shapes, and their plans lead all shapes past things."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import MeshChecker
from rbxcompose.domains.arms.motion.figures import ended, sampled
from rbxcompose.domains.arms.motion.groups import ArmGroup
from rbxcompose.domains.arms.motion.planner import MotionPlan, MotionRequest
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.motion.sphere_checker import Trees, compiled_model
from rbxcompose.domains.arms.section_models import FAST
from rbxcompose.domains.body.description import covering, to_xml
from rbxcompose.domains.body.model import Geometry, Shape
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from tests.body.kinematics import description_of
from tests.motion.test_coal_shapes import OBJ
from tests.motion.test_sphere_trees import on_surface
from tests.parts.project import Project
from tests.soak import rare

Array = NDArray[np.float64]
NUMBERS = st.floats(-1.0, 1.0).map(lambda value: round(value, 3))
SIZES = st.floats(0.01, 1.0).map(lambda value: round(value, 3))
SHAPES = st.one_of(
    st.builds('<box size="{} {} {}"/>'.format, SIZES, SIZES, SIZES),
    st.builds('<sphere radius="{}"/>'.format, SIZES),
    st.builds('<cylinder radius="{}" length="{}"/>'.format, SIZES, SIZES),
    st.builds('<mesh filename="pieces.obj" scale="{} {} {}"/>'.format, SIZES, SIZES, NUMBERS.filter(bool)),
)
POSES = st.builds('<origin xyz="{} {} {}" rpy="{} {} {}"/>'.format, *[NUMBERS] * 6)
ELEMENTS = st.lists(st.tuples(st.sampled_from(("visual", "collision")), POSES, SHAPES), min_size=1, max_size=5)
LAMP = """<robot name="lamp"><link name="post"><visual>
<origin xyz="0.1 0 0"/><geometry><box size="0.2 0.02 0.02"/></geometry></visual></link></robot>"""
ROBOT = """
body: {{pieces: {{lamp: {{urdf: lamp.urdf, attach: {{to: arm_tip}}}}}}, cover: {cover}}}
buses: {{servos: {{type: dynamixel}}}}
include: {{arm: {{part: rbx:parts/servo_arm.yaml, with: {{bus: servos}}}}}}
arms: {{arm: {{planner: {{type: {planner}}}}}}}
"""


@given(ELEMENTS, st.integers(0, 2**31))
def test_each_point_of_what_is_seen_or_hit_is_in_a_sphere_of_its_link(
    tmp_path_factory: pytest.TempPathFactory, elements: list[tuple[str, str, str]], seed: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "pieces.obj"
    path.write_text(OBJ)
    shapes = "".join(f"<{tag}>{pose}<geometry>{shape}</geometry></{tag}>" for tag, pose, shape in elements)
    text = f"""<robot name="r"><link name="ground"/><link name="arm">{shapes}</link>
    <joint name="j" type="continuous"><parent link="ground"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>"""
    root = read_urdf(text, "r.urdf")
    assert isinstance(root, XmlElement)
    body, _ = read_body(root)
    meshes = {path.name: path}
    description = replace(description_of(to_xml(covering(root, body))), meshes=meshes)
    checker = MeshChecker(ArmKinematics(description, ArmGroup(("j",), "ground", "arm")), meshes)
    spheres = compiled_model(checker, Trees()).spheres
    leaves = spheres.children < 0
    link, rng = body.links["arm"], np.random.default_rng(seed)
    for shape in (*link.visuals, *link.collisions):
        points = _points(shape, rng)
        away = np.linalg.norm(points[:, None] - spheres.centres[leaves], axis=2)
        assert np.all(np.any(away <= spheres.radii[leaves], axis=1))


def _points(shape: Shape, rng: np.random.Generator) -> Array:
    """Return points on the surface of a shape in the frame of its link, of shape (200, 3)."""
    size, points = shape.geometry.size, rng.normal(size=(200, 3))
    match shape.geometry.kind:
        case "sphere":
            points *= size[0] / np.linalg.norm(points, axis=1)[:, None]
        case "box":
            points *= np.array(size) / 2 / np.abs(points).max(axis=1)[:, None]
        case "cylinder":
            points[:, :2] *= size[0] / np.linalg.norm(points[:, :2], axis=1)[:, None]
            points[:, 2] = rng.uniform(-1, 1, 200) * size[1] / 2
            points[::2, :2] *= np.sqrt(rng.uniform(0, 1, 100))[:, None]
            points[::2, 2] = np.sign(points[::2, 2]) * size[1] / 2
        case _:
            rows = [line.split()[1:] for line in OBJ.splitlines() if line[0] in "vf"]
            corners = np.array(rows[:6], dtype=float) * np.array(size)
            points = on_surface(corners[np.array(rows[6:], dtype=int) - 1], 200, rng)
    return np.array([shape.origin.apply((x, y, z)) for x, y, z in points.tolist()])


@pytest.mark.parametrize("planner", [FAST, *rare("rrt_connect")])
def test_what_is_seen_passes_a_pole_that_it_would_hit_otherwise(planner: str, tmp_path: Path) -> None:
    clear = {cover: _is_seen_clear_of_a_pole(cover, planner, tmp_path) for cover in ("collision", "visual")}
    assert clear == {"collision": False, "visual": True}


def _is_seen_clear_of_a_pole(cover: str, planner: str, folder: Path) -> bool:
    """Plan around a pole that only a lamp at the tip reaches; return whether other code finds no visual shape in it."""
    project = Project(folder)
    project.check(ROBOT.format(cover=cover, planner=planner), files={"robots/one/lamp.urdf": LAMP})
    assert project.checked is not None
    assert project.checked.compilation.robot is not None
    config = project.checked.compilation.robot.components["arm"].config
    assert isinstance(config, ArmConfig)
    works = ArmWorks(config, lambda: 0.0)
    ahead = np.array([config.poses["straight_forward"].get(name, 0.0) for name in works.space.names])
    pole = Geometry("cylinder", (0.01, 1.0))
    there = Transform3(works.kinematics.tip_pose(ahead).apply((0.1, 0.0, 0.0)))
    works.place_objects([PlacedObject("pole", pole, works.kinematics.body.root, there)])
    turned = np.eye(len(ahead))[works.space.names.index("arm_shoulder_pan_joint")] * 0.8
    plan = ended(works.planner.plan(MotionRequest(ahead - turned, ahead + turned)))
    assert isinstance(plan, MotionPlan), plan
    assert plan.trajectory is not None
    model = pinocchio.buildModelFromXML(config.urdf)
    seen = pinocchio.buildGeomFromUrdfString(model, config.urdf, pinocchio.VISUAL)
    seen.addGeometryObject(
        pinocchio.GeometryObject(
            "pole", 0, pinocchio.SE3(np.eye(3), np.array(there.translation)), coal.Cylinder(*pole.size)
        )
    )
    for index in range(len(seen.geometryObjects) - 1):
        seen.addCollisionPair(pinocchio.CollisionPair(index, len(seen.geometryObjects) - 1))
    data, found = model.createData(), seen.createData()
    columns = [model.joints[model.getJointId(name)].idx_q for name in works.space.names]
    for values in sampled(plan.trajectory, 0.005):
        q = pinocchio.neutral(model)
        q[columns] = values
        if pinocchio.computeCollisions(model, data, seen, found, q, True):
            return False
    return True
