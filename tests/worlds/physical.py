"""Shipped robots and worlds for tests of the physics engine."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Report, Span
from rbxcompose.base.geometry import NO_TRANSLATION, Pose2, Vector3
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.body.urdf import read_text
from rbxcompose.domains.worlds.physics.conversion import OF_ROBOT, OF_WORLD
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.domains.worlds.physics.robot import PhysicsRobot, outline_body
from rbxcompose.domains.worlds.physics.solids import rotation_matrix
from rbxcompose.domains.worlds.shapes import WorldShape, outline_of
from rbxcompose.domains.worlds.world import SimulatedWorld, no_walls
from rbxcompose.domains.worlds.world_file import read_world
from rbxcompose.manifest.documents import Documents
from tests.shipped import compiled

pytest.importorskip("mujoco")

ROOT = Path(__file__).parents[2]
STEP = 0.02
ORIGIN = Pose2()
SEEN = np.array([group == OF_WORLD for group in range(6)], np.uint8)  # groups that rays see


@cache
def description(name: str) -> Description | None:
    """Return what a shipped robot says about its body."""
    robot = compiled(f"robots/{name}", environment={}).robot
    assert robot is not None
    return robot.manifest.contents.of(body)


def shipped(name: str, **options: object) -> PhysicsRobot:
    """Return a shipped robot; one without a body has an outline only."""
    found = description(name)
    if found is None:
        return PhysicsRobot(outline_body(0.2, 0.5), drives=True)
    return PhysicsRobot(found.body, found.meshes, **options)  # type: ignore[arg-type]


def from_urdf(links_and_joints: str, **options: object) -> PhysicsRobot:
    found, mistakes = read_text(f'<robot name="test">{links_and_joints}</robot>')
    assert not mistakes
    return PhysicsRobot(found, **options)  # type: ignore[arg-type]


def empty(robot: PhysicsRobot, *shapes: WorldShape, start: Pose2 = ORIGIN) -> SimulatedWorld:
    return SimulatedWorld("empty", no_walls(), shapes, start, *outline_of(robot.body))


@cache
def shipped_world(name: str, start: Pose2) -> SimulatedWorld:
    """Return a world that ships with a robot of 20 cm at a pose."""
    span = Span("", 1, 1, 1, 1)
    file = read_world(ROOT / f"worlds/{name}.yaml", Documents(Report(), {}), span)
    assert file is not None
    shapes = tuple(model.placed(name) for name, model in file.objects.items())
    return SimulatedWorld(name, file.grid, shapes, start, 0.2, 0.5)


def shipped_robots() -> Iterable[str]:
    return sorted(file.parent.name for file in ROOT.glob("robots/*/robot.yaml"))


def ray(
    physics: PhysicsWorld, link: str, directions: ArrayLike, most: float, origin: Vector3 = NO_TRANSLATION
) -> NDArray[np.float64]:
    """Return how far rays go [m] until they hit anything but the robot itself; inf for `most` [m] and beyond.

    `origin` [m] and `directions` (n, 3), unit vectors, are in the frame of a link.
    """
    pose = physics.pose_of(link)
    vectors = np.ascontiguousarray(np.asarray(directions, float).reshape(-1, 3) @ rotation_matrix(pose.rotation).T)
    count = len(vectors)
    hit, found = np.empty(count, np.int32), np.empty(count)
    begin = np.array(pose.apply(origin))
    physics._mj.mj_multiRay(
        physics._model, physics._data, begin, vectors.ravel(), SEEN, 1, -1, hit, found, None, count, most
    )
    return np.where((hit >= 0) & (found < most), found, math.inf)


@dataclass(frozen=True, slots=True)
class Touch:
    """A point where a link of the robot touches something."""

    link: str
    what: str
    """`the ground`, `map`, a shape of the world, or another link."""
    point: Vector3
    """In `map` [m]."""
    normal: Vector3
    """From what is touched to the link, a unit vector in `map`."""
    force: float
    """Along the normal [N]."""
    is_own: bool
    """Whether what is touched is a link, too: things of the world may have the names of links."""


def contacts(physics: PhysicsWorld) -> list[Touch]:
    """Return where links of the robot touch anything but links that they are fixed to."""
    found = []
    force = np.zeros(6)
    for index in range(physics._data.ncon):
        contact = physics._data.contact[index]
        first, second = (int(geom) for geom in contact.geom)
        own = [physics._model.geom_group[geom] == OF_ROBOT for geom in (first, second)]
        if not any(own):
            continue
        physics._mj.mj_contactForce(physics._model, physics._data, index, force)
        if force[0] <= 0.0:
            continue
        link, other = (second, first) if own[1] else (first, second)
        towards = 1.0 if own[1] else -1.0  # the normal of MuJoCo points from the first to the second
        (px, py, pz), (nx, ny, nz) = contact.pos.tolist(), (contact.frame[:3] * towards).tolist()
        names = physics.converted.touching
        point, normal = (px, py, pz), (nx, ny, nz)
        found.append(Touch(names[link], names[other], point, normal, float(force[0]), all(own)))
    return found


def target(physics: PhysicsWorld, joint: str, position: float) -> None:
    """Let a servo move to a position as fast as its URDF has it, within its limits."""
    limits = physics.converted.robot.body.joints[joint].limits
    speed = limits.velocity if limits and limits.velocity else math.inf
    if limits and limits.lower is not None and limits.upper is not None:
        position = min(max(position, limits.lower), limits.upper)
    physics.target(joint, position, abs(position - physics.position(joint)) / speed)
