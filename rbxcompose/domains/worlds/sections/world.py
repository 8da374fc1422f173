"""The section `world`: where a simulated robot is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import Field

from rbxcompose.base.config import PLACE, Config, Length, Name
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, suggest
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.worlds.sections.simulator import PHYSICS, simulator
from rbxcompose.domains.worlds.shapes import WorldShape, outline_of
from rbxcompose.domains.worlds.world_file import WORLD, WorldFile, WorldModel, read_world
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Contents, Reading, Short, WantedComponent, Wiring, entry_type_of
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.manifest.validate import NOT_A_CHOICE
from rbxcompose.sdk.capabilities import Drives, SensesPhysics, TurnsJoints

COMPONENT = "world"
OUTLINED = "base_footprint"  # the link of a robot without a body
SLIM, LOW = 0.2, 0.5  # [m] radius and height of a robot without a body


class WorldChoice(Config):
    """A world, and where the robot is in it."""

    file: FileName
    """Its file, of the kind `World`, relative to this one."""
    spawn: str = ""
    """Where the robot is put: a name in `spawn` of that file. Default: the first one, or the origin of `map`."""
    radius: Length | None = Field(None, gt=0)
    """Radius of the robot seen from above. Default: that of the collision shapes of its body."""
    robot: str = ""
    """The robot's name in its system, which says this and the next one."""
    robots: tuple[Name, ...] = ()
    """The robots of a system that are in the same world."""


@dataclass(frozen=True, slots=True)
class WorldOfRobot:
    """The world of a robot; lengths are in metres."""

    file: WorldFile
    start: Pose2
    radius: float
    height: float
    robot: str = ""
    robots: tuple[str, ...] = ()

    def solid_at(self, time: float) -> list[WorldShape]:
        """Return the convex things besides walls, at a time [s] and at the height of the robot."""
        things = (model.placed(name).at(time) for name, model in self.file.objects.items())
        return [part for thing in things for part in thing.convex if part.is_between(0.0, self.height)]

    @property
    def standing(self) -> list[WorldShape]:
        """Return what always stands there besides walls, at the height of the robot."""
        return [thing for thing in self.solid_at(0.0) if not self.file.objects[thing.name].path]


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    if not contents.is_simulated or (found := contents.of(world)) is None:
        return
    config = {
        "name": found.file.name,
        "map": str(found.file.map or ""),
        "objects": dict(found.file.objects),
        "holes": dict(found.file.holes),
        "lights": dict(found.file.lights),
        "start": _put_at(found),
        "radius": found.radius,
        "height": found.height,
        "robot": found.robot,
        "robots": found.robots,
    }
    yield WantedComponent(COMPONENT, COMPONENT, config, (world.name,))
    if contents.of(simulator) == PHYSICS:
        yield WantedComponent(PHYSICS, PHYSICS, _engine(contents, wiring), (simulator.name,))


def _engine(contents: Contents, wiring: Wiring) -> dict[str, object]:
    """Return what the physics engine moves."""
    bases = [made for made in wiring.components.values() if made.declared(Drives)]
    distances = (getattr(made.config, "wheel_distance", 0.0) for made in bases)
    commanded = any(not made.declared(TurnsJoints) for made in bases)
    config: dict[str, object] = {"drives": bool(bases), "commanded": commanded}
    if distance := next(filter(None, distances), 0.0):
        config["wheel_distance"] = distance
    described = contents.of(body)
    sensing = (one for made in wiring.components.values() for one in made.declared(SensesPhysics))
    config["sensors"] = {
        one.topic.value: {"frame": one.frame.value, "view": one.view.value if one.view else None}
        for one in sensing
        if described is not None or one.frame.value == OUTLINED
    }
    if described is not None:
        turning = (able for made in wiring.components.values() for able in made.declared(TurnsJoints))
        efforts = {name: effort for able in turning for name, effort in able.efforts.value.items()}
        known = described.body.joints
        config["servos"] = {name: effort for name, effort in efforts.items() if name in known}
        config["urdf"] = described.text
        config["meshes"] = {name: str(path) for name, path in described.meshes.items()}
    return config


def _places(read: WorldOfRobot | None) -> Mapping[str, Mapping[str, object]]:
    return {PLACE: read.file.places} if read else {}


def _defaults(contents: Contents) -> Mapping[str, object]:
    if not contents.is_simulated or (found := contents.of(world)) is None:
        return {}
    return {"in_world": True, "by_physics": contents.of(simulator) == PHYSICS, "put_at": _put_at(found)}


def _put_at(found: WorldOfRobot) -> tuple[float, float, float]:
    return found.start.x, found.start.y, found.start.heading


@section(
    "world",
    entry_type_of(WorldChoice, Short("file")),
    files=(ROBOT, OVERLAY),
    documents={WORLD: WorldModel},
    order=63,
    brings=(COMPONENT, PHYSICS),
    wires=True,
    components=_components,
    defaults=_defaults,
    defines=(PLACE,),
    defined=_places,
)
def world(reading: Reading[Any]) -> WorldOfRobot | None:
    """Where the robot is: a file with a map and things, or a map of it with `file` and `spawn`.

    Example:
        world: rbx:worlds/one_wall.yaml
    """
    read, node = reading.whole(), reading.node
    if read is None or node is None:
        return None
    span = reading.value("world") if isinstance(node, ScalarNode) else reading.value("world", "file")
    path = resolve(read.file, reading.writer(node), span)
    if isinstance(path, Finding):
        reading.report.add(path)
        return None
    file = read_world(path, reading.contents.documents, span)
    if file is None:
        return None
    if read.spawn and read.spawn not in file.spawn:
        where = reading.value("world", "spawn")
        help_text = suggest(read.spawn, file.spawn, "its spawns")
        reading.report.add(NOT_A_CHOICE.at(where, f"'{file.name}' has no spawn '{read.spawn}'", help=help_text))
        return None
    start = file.spawn[read.spawn] if read.spawn else next(iter(file.spawn.values()), Pose2())
    described = reading.contents.of(body)
    radius, height = outline_of(described.body) if described else (0.0, 0.0)
    return WorldOfRobot(file, start, read.radius or radius or SLIM, height or LOW, read.robot, read.robots)
