"""The configuration of an arm, and what is made of it: its joints, its body, its planner."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from pydantic import Field

from rbxcompose.body.description import Description
from rbxcompose.body.urdf import read_body
from rbxcompose.body.xml_reader import XmlElement, read_urdf
from rbxcompose.config import Config
from rbxcompose.control.limits import MotionLimits
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import LinkPair, MeshChecker
from rbxcompose.motion.groups import ArmGroup
from rbxcompose.motion.joint_space import ArmJoint, JointSpace
from rbxcompose.motion.planner import MotionPlanner, PlannerSettings
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.motion.setting_up import always_colliding, load_libraries
from rbxcompose.units import ANGLE, LENGTH, Dimension


class ArmJointConfig(Config):
    """Limits of a joint in SI; None where there is none."""

    lower: float | None = None
    """Least position."""
    upper: float | None = None
    """Greatest position."""
    velocity: float | None = None
    """Greatest speed."""
    acceleration: float | None = None
    """Greatest acceleration."""
    is_continuous: bool = False
    """Whether it turns without an end."""
    slides: bool = False
    """Whether its positions are lengths."""


class ArmPlannerConfig(Config):
    """How motions are planned."""

    type: str = "rrt_connect"
    """The planner of OMPL."""
    time: float = 5.0
    """How long it may search [s]."""
    attempts: int = 5
    """How many paths it may find that collide when they are examined finely."""
    seed: int = 1
    """The same seed gives the same path."""


class ArmConfig(Config):
    """An arm, and the body that it is part of."""

    name: str
    """Its name, which begins the topic of its action."""
    urdf: str
    """Text of the URDF of the whole body."""
    meshes: dict[str, str] = {}
    """Files of meshes by their names in the URDF."""
    base: str
    """The link that carries it."""
    tip: str
    """The link at its end."""
    joints: dict[str, ArmJointConfig] = Field(min_length=1)
    """Its joints, from the base to the tip."""
    poses: dict[str, dict[str, float]] = {}
    """Positions of joints [rad or m] by the name of the pose."""
    controller: str
    """The controller that leads its joints."""
    follow: str
    """The action of the controller."""
    planner: ArmPlannerConfig = ArmPlannerConfig()
    """How motions are planned."""


def dimensions_of(config: ArmConfig) -> dict[str, Dimension]:
    """Return what the positions of its joints measure."""
    return {name: LENGTH if one.slides else ANGLE for name, one in config.joints.items()}


def space_of(config: ArmConfig) -> JointSpace:
    """Return the joints of an arm."""
    return JointSpace(
        tuple(
            ArmJoint(
                name, MotionLimits(one.lower, one.upper, one.velocity, one.acceleration), one.is_continuous, one.slides
            )
            for name, one in config.joints.items()
        )
    )


def description_of(config: ArmConfig) -> Description:
    """Return the body that an arm is part of; the plan has only what could be read."""
    root = read_urdf(config.urdf, "urdf")
    if not isinstance(root, XmlElement):
        raise ValueError(root.message)
    return Description(config.urdf, read_body(root)[0], {name: Path(path) for name, path in config.meshes.items()})


class ArmWorks:
    """What plans for an arm: its kinematics, and its planner among the objects of a scene."""

    def __init__(self, config: ArmConfig, now: Callable[[], float], objects: Iterable[PlacedObject] = ()) -> None:
        """Build it; `now` is a time [s] that passes while it plans.

        Raises:
            ModuleNotFoundError: if the extra `arm` is not installed.
            ValueError: if a mesh cannot be read.
        """
        load_libraries()
        self.space, self._description = space_of(config), description_of(config)
        self.kinematics = ArmKinematics(self._description, ArmGroup(self.space.names, config.base, config.tip))
        adjacent, self.always = always_colliding(self.kinematics, self.space, self._description.meshes)
        """Pairs that collide wherever the arm is, and are not watched."""
        self._allowed: frozenset[LinkPair] = adjacent | self.always
        one = config.planner
        settings = PlannerSettings(one.type, one.time, one.attempts, one.seed)
        self.planner = MotionPlanner(self.space, self._checker(objects), settings, now)

    def place_objects(self, objects: Iterable[PlacedObject]) -> None:
        """Plan among these objects from now on."""
        self.planner.checker = self._checker(objects)

    def _checker(self, objects: Iterable[PlacedObject]) -> MeshChecker:
        return MeshChecker(self.kinematics, self._description.meshes, self._allowed, objects)
