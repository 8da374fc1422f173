"""The configuration of an arm, and what is made of it: its joints, its body, its planner."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

from pydantic import Field

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.config import Config
from rbxcompose.base.geometry import Vector3
from rbxcompose.base.units import ANGLE, LENGTH, Dimension
from rbxcompose.domains.arms.motion import collisions
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.figures import SecondChecker
from rbxcompose.domains.arms.motion.groups import ArmGroup, ArmJoint, JointSpace, interpolated
from rbxcompose.domains.arms.motion.hand_task import PlanningHelper
from rbxcompose.domains.arms.motion.inverse_kinematics import ANGLE_TOLERANCE, RESTARTS, TOLERANCE, SolverSettings
from rbxcompose.domains.arms.motion.numba_cache import is_installed, keep_libraries
from rbxcompose.domains.arms.motion.planner import MotionPlanner, PlannerSettings, can_search
from rbxcompose.domains.arms.motion.scene import PairDistance, PlacedObject
from rbxcompose.domains.arms.section_models import AUTOMATIC, FAST, HandConfig, PlannerModel
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import LinkPair
from rbxcompose.domains.body.urdf import body_of
from rbxcompose.domains.servos.limits import MotionLimits

WAY_STEP, MOST_OF_WAY = 0.05, 200  # [rad or m] between points that are shown of a way, and how many there are


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
    jerk: float | None = None
    """Greatest jerk of planned motions."""
    is_continuous: bool = False
    """Whether it turns without an end."""
    slides: bool = False
    """Whether its positions are lengths."""


class ArmSolverConfig(Config):
    """How positions of joints are searched that bring the tip to a pose."""

    restarts: int = RESTARTS
    """How many random positions the search begins from, after the present ones."""
    time: float = 5.0
    """How long it may take [s]."""
    tolerance: float = TOLERANCE
    """How far the tip may be off [m], if a goal does not say."""
    angle_tolerance: float = ANGLE_TOLERANCE
    """How far it may be turned [rad], if a goal does not say."""
    prefer: str | None = None
    """The pose that joints should be near to where several positions do, if a goal does not say."""

    @property
    def settings(self) -> SolverSettings:
        """Return them for the search."""
        return SolverSettings(self.restarts, self.time, self.tolerance, self.angle_tolerance, self.prefer or "")


class LinkPairsConfig(Config):
    """Pairs of links that an arm need not watch, each in the order of the alphabet."""

    adjacent: list[tuple[str, str]] = []
    """A joint connects them: they are not watched."""
    ignored: list[tuple[str, str]] = []
    """They always collide, or somebody said so: they are not watched."""
    unlikely: list[tuple[str, str]] = []
    """They were never seen to collide: a search leaves them out, and the motion that it finds is examined with them."""


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
    stream: str = ""
    """The topic on which the controller takes trajectories one after the other; empty if it takes none."""
    planner: PlannerModel = PlannerModel()
    """How motions are planned."""
    kinematics: ArmSolverConfig = ArmSolverConfig()
    """How positions of joints are searched for a pose of the tip."""
    pairs: LinkPairsConfig | None = None
    """Pairs of links that it need not watch; without them, it looks for those that it cannot help."""
    hand: HandConfig | None = None
    """Its gripper, if it has one."""


def dimensions_of(config: ArmConfig) -> dict[str, Dimension]:
    """Return what the positions of its joints measure."""
    return {name: LENGTH if joint.slides else ANGLE for name, joint in config.joints.items()}


def space_of(config: ArmConfig) -> JointSpace:
    """Return the joints of an arm."""
    limits = {
        name: MotionLimits(item.lower, item.upper, item.velocity, item.acceleration, jerk=item.jerk)
        for name, item in config.joints.items()
    }
    joints = config.joints.items()
    return JointSpace(tuple(ArmJoint(name, limits[name], item.is_continuous, item.slides) for name, item in joints))


def description_of(config: ArmConfig) -> Description:
    """Return the body that an arm is part of; the plan has only what could be read."""
    return Description(config.urdf, body_of(config.urdf), {name: Path(path) for name, path in config.meshes.items()})


def mesh_bytes(config: ArmConfig) -> int:
    """Return how large the files of the meshes are [bytes] that an arm plans with."""
    links = description_of(config).body.links.values()
    used = {shape.geometry.file for link in links for shape in link.collisions} & config.meshes.keys()
    return sum(Path(config.meshes[name]).stat().st_size for name in used)


class ArmWorks:
    """What plans for an arm: its kinematics, and its planner among the objects of a scene."""

    def __init__(
        self,
        config: ArmConfig,
        now: Callable[[], float],
        objects: Iterable[PlacedObject] = (),
        paddings: Mapping[str, float] = MappingProxyType({}),
        *,
        is_fast: bool = True,
    ) -> None:
        """Build it; `now` is a time [s] that passes while it plans.

        With `is_fast`, code is compiled where numba is installed: that takes long for the first time on a machine, and
        seconds to load, which pays for many motions.

        Raises:
            ModuleNotFoundError: if the extra `arm` is not installed, or `fast` for a planner that needs it.
            ValueError: if a mesh cannot be read.
        """
        type_ = config.planner.type
        is_compiled = type_ == FAST or (type_ == AUTOMATIC and is_fast and is_installed())
        collisions.load_libraries(with_ompl=not is_compiled)
        self.space, self._description = space_of(config), description_of(config)
        self.kinematics = ArmKinematics(self._description, ArmGroup(self.space.names, config.base, config.tip))
        if is_fast:
            self.kinematics.hasten()
        if (pairs := config.pairs) is None:
            adjacent, self.always = collisions.always_colliding(self.kinematics, self.space, self._description.meshes)
            """Pairs that collide wherever the arm is, and are not watched."""
        else:
            adjacent, self.always = frozenset(pairs.adjacent), frozenset(pairs.ignored)
        self._allowed: frozenset[LinkPair] = adjacent | self.always
        self._shapes = collisions.Shapes(self._description.meshes)
        self.objects = tuple(objects)
        """Those that it plans among."""
        self.paddings = paddings
        """By which links keep away from them [m]."""
        self._checker = self._checker_among(self.objects)
        self.helpers: Sequence[PlanningHelper] = ()
        """Those that plan elsewhere meanwhile."""
        self._fast: Callable[[collisions.MeshChecker], collisions.Checker] = (
            _hastened() if is_compiled else lambda same: same
        )
        unlikely = frozenset(pairs.unlikely if pairs is not None else ())
        self.solver, own = config.kinematics.settings, config.planner
        settings = PlannerSettings(own.type, own.time, own.attempts, own.seed, own.simplify)
        self.planner = MotionPlanner(self.space, self._fast(self._checker), settings, now, unlikely)
        if can_search(self.planner.checker):
            self.planner.checker.prepare(self.space)
        keep_libraries()

    def place_objects(
        self, objects: Iterable[PlacedObject], paddings: Mapping[str, float] = MappingProxyType({})
    ) -> None:
        """Plan among these objects from now on; links keep away from them by `paddings` [m].

        Raises:
            ValueError: if a mesh cannot be read.
        """
        self.objects, self.paddings = tuple(objects), paddings
        own = (shape.geometry for link in self.kinematics.body.links.values() for shape in link.collisions)
        self._shapes.keep((*own, *(piece.shape for thing in self.objects for piece in thing.own_pieces)))
        self._checker = self._checker_among(self.objects)
        self.planner.checker = self._fast(self._checker)

    def checker(self, objects: Iterable[PlacedObject]) -> collisions.MeshChecker:
        """Return what examines positions of the arm among some objects; raises as `place_objects` does."""
        there = tuple(objects)
        return self._checker if there == self.objects else self._checker_among(there)  # asked for each grasp

    def _checker_among(self, objects: Iterable[PlacedObject]) -> collisions.MeshChecker:
        return collisions.MeshChecker(
            self.kinematics, self._description.meshes, self._allowed, objects, self.paddings, shapes=self._shapes
        )

    def second_checker(
        self, objects: Iterable[PlacedObject], positions: Mapping[str, float] = MappingProxyType({})
    ) -> SecondChecker:
        """Return what examines motions by other code; `positions` are those of joints that are not the arm's."""
        return SecondChecker(self._description, self.space.names, self._allowed, objects, positions)

    @property
    def meshes(self) -> Mapping[str, Path]:
        """Return the files of meshes by their names in the URDF."""
        return self._description.meshes

    @property
    def watched(self) -> frozenset[str]:
        """Return the links and objects that may collide."""
        return self._checker.watched

    def pairs(self, positions: Mapping[str, float], between: Collection[str]) -> tuple[PairDistance, ...]:
        """Return the distances of pairs at positions of its joints, as `MeshChecker.pairs` does."""
        return self._checker.pairs(np.array([positions[name] for name in self.space.names]), between)

    def way(self, points: Array) -> tuple[Vector3, ...]:
        """Return where its tip is in the root's frame [m] on straight lines between points of shape (m, n)."""
        dense = interpolated(points, WAY_STEP)
        some = dense[np.linspace(0, len(dense) - 1, min(len(dense), MOST_OF_WAY)).astype(int)]
        return tuple(self.kinematics.tip_pose(values).translation for values in some)


def _hastened() -> Callable[[collisions.MeshChecker], collisions.Checker]:
    """Return what makes a checker that gives the same answers, and searches fast.

    Raises:
        ModuleNotFoundError: without numba, which is imported here and not before.
    """
    from rbxcompose.domains.arms.motion.sphere_checker import SphereChecker, Trees

    return partial(SphereChecker, trees=Trees())
