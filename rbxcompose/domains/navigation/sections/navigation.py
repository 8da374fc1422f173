"""The section `navigation`: driving through a map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from rbxcompose.base.config import MISSION, Acceleration, Angle, AngularSpeed, Config, Length, Name, Ratio, Speed, Time
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.geometry import Pose2
from rbxcompose.compiler.sections.missions import MissionEntry, missions
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.worlds.grid_map import GridMap, MapError, read_map
from rbxcompose.domains.worlds.sections.world import WorldOfRobot, world
from rbxcompose.domains.worlds.shapes import (
    CircleFootprint,
    Footprint,
    Point2,
    PolygonFootprint,
    WorldHole,
    hull_of,
    outline_of,
)
from rbxcompose.domains.worlds.world_file import PlanarPose
from rbxcompose.manifest.fields import FileName, TopicName
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Contents, Reading, WantedComponent, Wiring
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.sdk.ports import Out

MAP_SERVER, NAVIGATOR, GO_TO, RECOVER = "map_server", "navigator", "go_to", "recover"
LOCALISATION = "localisation"
PEOPLE, FOLLOW, FOLLOWER = "people", "follow_person", "person_follower"
SLIM = 0.2  # [m] radius of a robot without a body
ROUND = 0.01  # [m] between the circles around a footprint and within, below which it counts as a circle
_SCAN, _TAGS = "sensor_msgs/msg/LaserScan", "vision_msgs/msg/Detection3DArray"
NO_MAP, NO_BODY, NO_TRUTH = kind("RBX3601"), kind("RBX3620"), kind("RBX3621")


class FootprintModel(Config):
    """A robot that is a circle, seen from above."""

    radius: Length = Field(gt=0)
    """Its radius."""


def _form(value: object) -> str:
    return "word" if isinstance(value, str) else "corners" if isinstance(value, list | tuple) else "circle"


def _as_footprint(corners: list[Point2]) -> list[Point2]:
    if PolygonFootprint(tuple(corners)).inner <= 0:
        raise ValueError("a footprint is around the origin of the robot")
    return corners


FootprintShape = Annotated[
    Annotated[Literal["body"], Tag("word")]
    | Annotated[FootprintModel, Tag("circle")]
    | Annotated[list[tuple[Length, Length]], AfterValidator(_as_footprint), Tag("corners")],
    Discriminator(_form),
]


class ObstaclesModel(Config):
    """What a laser sees."""

    from_: TopicName | None = Field(None, alias="from")
    """The topic of its scans. Default: the first that a component publishes."""
    frame: str = ""
    """Its frame. Default: that of the component that publishes the scans, or `laser_link`."""
    range: Length = Field(3.0, gt=0)
    """Up to here, obstacles count."""
    silence: Time = Field(1.0, gt=0)
    """Without a scan for so long, the robot stops."""


class InflationModel(Config):
    """Room around obstacles."""

    radius: Length = Field(0.45, gt=0)
    """Up to this distance, ways are dearer."""


class ZoneModel(Config):
    """A part of the map with a rule of its own: to keep out, or to be slow."""

    keep_out: list[tuple[Length, Length]] = []
    """Corners of an area through which no way leads."""
    area: list[tuple[Length, Length]] = []
    """Corners of an area in which the robot is slow."""
    speed: Ratio | None = Field(None, gt=0, le=1)
    """Share of its speed there."""

    @model_validator(mode="after")
    def _is_zone(self) -> ZoneModel:
        if bool(self.keep_out) == bool(self.area) or bool(self.area) != (self.speed is not None):
            raise ValueError("a zone has either 'keep_out', or 'area' and 'speed'")
        if len(self.keep_out or self.area) < 3:
            raise ValueError("an area has at least three corners")
        return self


class CostsModel(Config):
    """What ways keep away from."""

    obstacles: ObstaclesModel = ObstaclesModel()
    """What a laser sees."""
    inflation: InflationModel = InflationModel()
    """Room around obstacles."""
    zones: dict[Name, ZoneModel] = {}
    """Parts of the map with rules of their own."""
    unknown: bool = True
    """Whether ways may lead through what the map does not know."""
    map_only: bool = False
    """Whether the robot keeps off nothing but what the map and the zones say, also if it has a laser."""


class WayPlannerModel(Config):
    """How ways are planned."""

    patience: Time = Field(15.0, gt=0)
    """If the robot gets no further for so long, it tries a recovery; the goal fails if it cannot drive at all."""


class FollowerModel(Config):
    """How ways are driven along."""

    speed: Speed = Field(0.4, gt=0)
    """Largest speed."""
    turn_rate: AngularSpeed = Field(1.309, gt=0)
    """Largest turn rate."""
    acceleration: Acceleration = Field(0.5, gt=0)
    """Acceleration, also for braking."""
    look_ahead: Length = Field(0.5, gt=0)
    """How far ahead on its way the robot aims."""
    tolerance: Length = Field(0.1, gt=0)
    """How far from the goal it may end."""
    heading_tolerance: Angle = Field(0.0873, gt=0)
    """How far from the goal's heading it may end."""


class ParticlesModel(Config):
    """How many particles a filter has: as many as it needs (KLD-sampling), between two numbers."""

    least: int = Field(500, ge=10, le=100_000)
    """When the robot is known well."""
    most: int = Field(2000, ge=10, le=100_000)
    """When it may be in many places."""

    @model_validator(mode="after")
    def _is_range(self) -> ParticlesModel:
        if self.least > self.most:
            raise ValueError("'least' is not above 'most'")
        return self


class LocalisationModel(Config):
    """How the robot knows where it is in the map."""

    type: Literal["odometry", "particles", "tags", "fake"] = "odometry"
    """`odometry`: the odometry of the base is right; `particles`: by a laser, with a particle filter; `tags`: by tags
    that a camera sees; `fake`: the simulator tells."""
    from_: TopicName | None = Field(None, alias="from")
    """The topic of the scans, or of the tags. Default: the first that a component publishes."""
    frame: str = ""
    """The frame of the laser, or the camera. Default: that of the component that publishes the scans or the tags."""
    tags: dict[Name, PlanarPose] = {}
    """Where tags and boards are, by name: each faces in the direction of its `heading`."""
    start: PlanarPose | None = None
    """Where the robot probably is at first. Default: where the simulated world puts it, or the origin of the map."""
    spread: Length = Field(0.2, ge=0)
    """Standard deviation of both coordinates of the start."""
    turn_spread: Angle = Field(0.1745, ge=0)
    """Standard deviation of the heading of the start."""
    anywhere: bool = False
    """Whether the robot may be anywhere at first."""
    particles: ParticlesModel = ParticlesModel()
    """How many particles the filter has."""

    @model_validator(mode="after")
    def _knows_tags(self) -> LocalisationModel:
        if self.type == "tags" and not self.tags:
            raise ValueError("'type: tags' needs 'tags': the places of tags by which the robot is found")
        return self


class TagsOfPeople(Config):
    """Tags that people carry."""

    from_: TopicName | None = Field(None, alias="from")
    """The topic of the tags. Default: the first that a component publishes."""
    frame: str = ""
    """The optical frame of their camera. Default: that of the component that publishes them."""
    names: list[Name] = []
    """The names of the tags and boards; without any, all that are seen are carried by people."""
    behind: Length = Field(0.25, ge=0)
    """From a tag to the middle of who carries it, behind the tag."""


class PeopleModel(Config):
    """People whom the robot sees, and whom it may follow."""

    distance: Length = Field(1.0, gt=0)
    """To keep from the person whom it follows, between the middles of both."""
    patience: Time = Field(5.0, gt=0)
    """How long it waits where that person was last seen."""
    farthest: Length = Field(6.0, gt=0)
    """Who is farther away is not tracked."""
    tags: TagsOfPeople | None = None
    """Tags by which people are known whom a camera sees. Default: the laser sees who walks."""


class NavigationModel(Config):
    """How the robot drives through a map."""

    map: FileName | None = None
    """The YAML file of a map of map_server, relative to this one. Default: the map of the robot's world."""
    footprint: FootprintShape | None = None
    """How much room the robot needs: `body`, the convex hull of its collision shapes from above; a circle; or the
    corners of a convex polygon. Default: the circle around the collision shapes of its body."""
    localisation: LocalisationModel = LocalisationModel()
    """How the robot knows where it is in the map."""
    costs: CostsModel = CostsModel()
    """What ways keep away from."""
    planner: WayPlannerModel = WayPlannerModel()
    """How ways are planned."""
    follower: FollowerModel = FollowerModel()
    """How ways are driven along."""
    people: PeopleModel | None = None
    """Whether it tracks people with its laser, and has the skill `follow_person`; `people: {}` is enough."""
    recoveries: FileName = "rbx:missions/recover.yaml"
    """The mission that runs when the robot gets no further; its input `attempt`, if it has one, counts the tries."""


@dataclass(frozen=True, slots=True)
class NavigationOfRobot:
    """What was read."""

    model: NavigationModel
    map: Path
    grid: GridMap
    footprint: Footprint
    recoveries: MissionEntry
    holes: tuple[WorldHole, ...] = ()
    """Where the ground of its world is missing."""

    @property
    def radius(self) -> float:
        """Return the radius of the robot, or of the circle which it covers [m]."""
        return self.footprint.inner

    @property
    def zones(self) -> tuple[tuple[str, tuple[Point2, ...], float], ...]:
        """Return name, corners in `map` [m] and share of the speed of each zone; the robot keeps out of holes, too."""
        zones = self.model.costs.zones.items()
        written = ((name, tuple(zone.keep_out or zone.area), zone.speed or 0.0) for name, zone in zones)
        return (*written, *((hole.name, hole.corners, 0.0) for hole in self.holes))


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    if (found := contents.of(navigation)) is None:
        return
    model = found.model
    known = contents.of(missions)
    config = {
        **_room(found),
        "unknown_is_free": model.costs.unknown,
        **({} if model.costs.map_only else _laser(model.costs.obstacles, wiring)),
        "patience": model.planner.patience,
        **model.follower.model_dump(),
        "recovery": RECOVER,
        "trees": tuple(known),
        "heading_tolerance": f"{model.follower.heading_tolerance!r} rad",
    }
    follower = {name: ("navigation", "follower", name) for name in FollowerModel.model_fields}
    costs = {"sees": ("obstacles", "range"), "silence": ("obstacles", "silence"), "inflation": ("inflation", "radius")}
    places = {**follower, **{name: ("navigation", "costs", *place) for name, place in costs.items()}}
    if model.localisation.type in ("particles", "tags"):
        yield _localisation(model.localisation, contents.of(world), wiring)
    elif model.localisation.type == "fake":
        yield WantedComponent(LOCALISATION, "fake_localisation", {}, ("navigation", "localisation"))
    yield WantedComponent(MAP_SERVER, MAP_SERVER, {"file": str(found.map)}, ("navigation", "map"))
    yield WantedComponent(GO_TO, NAVIGATOR, config, ("navigation",), places=places)
    if model.people is not None:
        yield from _people(found, model.people, wiring)


def _room(found: NavigationOfRobot) -> dict[str, object]:
    """Return how much room the robot needs around what it sees."""
    costs = found.model.costs
    return {
        "radius": found.radius,
        "corners": found.footprint.points if isinstance(found.footprint, PolygonFootprint) else (),
        "inflation": costs.inflation.radius,
        "zones": found.zones,
        "sees": costs.obstacles.range,
        "silence": costs.obstacles.silence,
    }


def _people(found: NavigationOfRobot, model: PeopleModel, wiring: Wiring) -> Iterator[WantedComponent]:
    laser = _laser(found.model.costs.obstacles, wiring)
    if "scan_frame" in laser:
        laser["frame"] = laser.pop("scan_frame")
    driving = found.model.follower
    config = {
        **laser,
        "distance": model.distance,
        "patience": model.patience,
        **_room(found),
        **{name: getattr(driving, name) for name in ("speed", "turn_rate", "acceleration")},
    }
    tracker, sees, names = "people_tracker", laser, ("navigation", "people", "tags", "names")
    if (tags := model.tags) is not None:
        tracker, sees = "tagged_people", _camera(tags.from_, tags.frame, wiring)
        sees |= {"tags": tags.names, "behind": tags.behind}
    config_of_tracker = {**sees, "farthest": model.farthest}
    yield WantedComponent(PEOPLE, tracker, config_of_tracker, ("navigation", "people"), places={"tags": names})
    yield WantedComponent(FOLLOW, FOLLOWER, config, ("navigation", "people"))


def _localisation(model: LocalisationModel, around: WorldOfRobot | None, wiring: Wiring) -> WantedComponent:
    start = model.start.pose if model.start else around.start if around else Pose2()
    config: dict[str, object] = {
        "start": (start.x, start.y, start.heading),
        "spread": model.spread,
        "turn_spread": f"{model.turn_spread!r} rad",
        "anywhere": model.anywhere,
    }
    if model.type == "tags":
        tags = {name: (place.x, place.y, place.heading) for name, place in model.tags.items()}
        config |= {**_camera(model.from_, model.frame, wiring), "tags": tags}
        return WantedComponent(LOCALISATION, "tag_localisation", config, ("navigation", "localisation"))
    config |= {**_laser(model, wiring), **model.particles.model_dump()}
    return WantedComponent(LOCALISATION, "particle_localisation", config, ("navigation", "localisation"))


def _defaults(contents: Contents) -> Mapping[str, object]:
    found = contents.of(navigation)
    return {"is_localised": True} if found is not None and found.model.localisation.type != "odometry" else {}


def _laser(model: ObstaclesModel | LocalisationModel, wiring: Wiring) -> dict[str, object]:
    """Return the topic and the frame of a laser; nothing if there is none."""
    topic, frame = _sensor(_SCAN, model.from_, model.frame, wiring)
    return {"scan": topic, **({"scan_frame": frame} if frame else {})} if topic else {}


def _camera(topic: str | None, frame: str, wiring: Wiring) -> dict[str, object]:
    """Return where tags are told, and the frame of their camera; nothing if there are none."""
    topic, frame = _sensor(_TAGS, topic, frame, wiring)
    return {"topic": topic, **({"frame": frame} if frame else {})} if topic else {}


def _sensor(kind: str, topic: str | None, frame: str, wiring: Wiring) -> tuple[str | None, str]:
    """Return the topic and the frame of what publishes messages of a type, on a topic if one is given."""
    for made in wiring.components.values():
        for end in made.ends:
            is_meant = topic is None or end.topic.lstrip("/") == topic.lstrip("/")
            if isinstance(end.port, Out) and end.type_name == kind and is_meant:
                return end.topic, frame or getattr(made.config, "frame", "")
    return topic, frame


def _missions(read: NavigationOfRobot | None) -> Mapping[str, Mapping[str, object]]:
    return {MISSION: {RECOVER: read.recoveries}} if read else {}


@section(
    "navigation",
    NavigationModel,
    files=(ROBOT, OVERLAY),
    order=66,
    brings=(MAP_SERVER, LOCALISATION, GO_TO, PEOPLE, FOLLOW),
    outputs={one: {"cmd_vel": "cmd_vel"} for one in (GO_TO, FOLLOW, LOCALISATION)},
    wires=True,
    components=_components,
    defaults=_defaults,
    defines=(MISSION,),
    defined=_missions,
)
def navigation(reading: Reading[NavigationModel]) -> NavigationOfRobot | None:
    """Driving to poses of a map, around walls and what a laser sees; the skill is `go_to`.

    Example:
        navigation:
          map: rbx:worlds/one_wall_map.yaml
          follower: {speed: 0.3 m/s}
    """
    read = reading.whole()
    if read is None or reading.node is None:
        return None
    around = reading.contents.of(world)
    if read.map is not None:
        span = reading.value("navigation", "map")
        path = resolve(read.map, reading.writer(reading.node), span)
        if isinstance(path, Finding):
            reading.report.add(path)
            return None
        try:
            grid = read_map(path)
        except MapError as error:
            reading.report.add(NO_MAP.at(span, str(error)))
            return None
    elif around is not None and around.file.map is not None:
        path, grid = around.file.map, around.file.grid
    elif around is None and "world" in reading.contents.root:
        return None  # what is wrong with the world is reported there
    else:
        help_text = "write 'map: FILE' below it, or give the robot a 'world' with a map"
        reading.report.add(NO_MAP.at(reading.key("navigation"), "navigation needs a map", help=help_text))
        return None
    if read.localisation.type == "fake" and (around is None or not reading.contents.is_simulated):
        words = "the robot is real" if around else "the robot is in no 'world'"
        help_text = "write 'type: particles', or 'odometry'"
        where = reading.value("navigation", "localisation", "type")
        reading.report.add(NO_TRUTH.at(where, f"{words}, so nobody knows where it is in truth", help=help_text))
    footprint = _footprint(reading, read.footprint)
    if isinstance(footprint, Finding):
        reading.report.add(footprint)
        return None
    where = reading.value("navigation", "recoveries")
    mission = resolve(read.recoveries, reading.writer(reading.node), where)
    if isinstance(mission, Finding):
        reading.report.add(mission)
        return None
    recoveries = MissionEntry(RECOVER, mission, MappingNode(), where)
    holes = around.file.holes.items() if around else ()
    return NavigationOfRobot(
        read, path, grid, footprint, recoveries, tuple(model.placed(name) for name, model in holes)
    )


def _footprint(reading: Reading[NavigationModel], wanted: object) -> Footprint | Finding:
    """Return how much room the robot needs; one that is as good as round is a circle."""
    around, described = reading.contents.of(world), reading.contents.of(body)
    if isinstance(wanted, FootprintModel):
        return CircleFootprint(wanted.radius)
    if isinstance(wanted, list):
        return PolygonFootprint(tuple(wanted))
    if wanted is None:
        outline = around.radius if around else outline_of(described.body)[0] if described else 0.0
        return CircleFootprint(outline or SLIM)
    corners = hull_of(described.body) if described else ()
    hull = PolygonFootprint(corners) if len(corners) > 2 else None
    if hull is None or hull.inner <= 0:
        why = "the body has no collision shapes around its origin" if described else "there is no 'body'"
        words, help_text = f"{why} to take the footprint from", "write '{radius: LENGTH}', or a list of corners"
        return NO_BODY.at(reading.value("navigation", "footprint"), words, help=help_text)
    return CircleFootprint(hull.reach) if hull.reach - hull.inner < ROUND else hull
