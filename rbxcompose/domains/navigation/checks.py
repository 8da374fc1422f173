"""Rules about navigation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

from rbxcompose.base.arrays import np
from rbxcompose.base.config import Place
from rbxcompose.base.findings import NAMES, WIRING, Finding, Severity, Span
from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.base.units import FREQUENCY, LENGTH, TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.navigation.costs import CostZone
from rbxcompose.domains.navigation.sections.navigation import GO_TO, NavigationOfRobot, navigation
from rbxcompose.domains.worlds.contact import MAP, outside_polygon, overlap
from rbxcompose.domains.worlds.sections.world import WorldOfRobot, world
from rbxcompose.domains.worlds.shapes import Point2, PolygonFootprint, hull_of, outline_of, sections_of
from rbxcompose.manifest.tree import at
from rbxcompose.sdk.capabilities import CommandsMotion, Navigates
from rbxcompose.sdk.ports import Out

SCANS = 2  # within the time after which a laser counts as silent: one may come late
BLIND = 2.0  # [m] at most, driven without a scan
ROUNDING = 1e-3  # [m] of lengths that people measure, and of round shapes


@check("RBX3602", Severity.WARNING, closed=())
def place_without_room(robot: Robot) -> Iterator[Finding]:
    """A place, or where the robot is to start, is outside of the map, or the robot does not fit there."""
    if (found := _navigation(robot)) is None:
        return
    around, localisation = robot.manifest.contents.of(world), found.model.localisation
    for name, place in robot.manifest.places.items():
        if why := _why_not(found, around, place):
            yield place_without_room.at(_written(robot, name), f"the robot cannot drive to '{name}': {why}")
    start = None if localisation.anywhere else localisation.start
    if start is not None and (why := _why_not(found, around, start.pose)):
        span = robot.value("navigation", "localisation", "start")
        yield place_without_room.at(span, f"the robot cannot be where it starts: {why}")


@check("RBX3610", Severity.WARNING, closed=())
def place_cut_off(robot: Robot) -> Iterator[Finding]:
    """No way leads from where the robot starts to a place."""
    if (found := _navigation(robot)) is None:
        return
    around = robot.manifest.contents.of(world)
    places = {name: place for name, place in robot.manifest.places.items() if not _why_not(found, around, place)}
    if not places:
        return
    from rbxcompose.domains.navigation.reach import ReachableAreas

    model = found.model
    things, zones = around.standing if around else (), [CostZone(*zone) for zone in found.zones]
    ground = ReachableAreas(found.grid, found.radius, things, zones, unknown_is_free=model.costs.unknown)
    origin, pose = _start(found, around, places)
    away, begin, area = ground.nearest((pose.x, pose.y))
    if is_shut_in := away > (limit := found.radius + 2 * found.grid.resolution):
        unzoned = ReachableAreas(found.grid, found.radius, things, unknown_is_free=model.costs.unknown)
        if unzoned.nearest((pose.x, pose.y))[0] > limit:
            return  # it does not stand on the map, or in something: not even a way out is known
    for name, place in places.items():
        if is_shut_in:
            if math.dist((pose.x, pose.y), (place.x, place.y)) > model.follower.tolerance:
                words = f"no way leads from {origin} to '{name}': zones to keep out of leave no way out of there"
                yield place_cut_off.at(_written(robot, name), words)
            continue
        nearest, spot, _ = ground.nearest((place.x, place.y), area)
        if ground.area_at((place.x, place.y)) == area or nearest <= model.follower.tolerance:
            continue
        _, end, other = ground.nearest((place.x, place.y))
        words = f"it gets no nearer than {_shown(nearest)}, at {_point(spot)}"
        if other == area:
            words = f"{words}, and its tolerance is {_shown(model.follower.tolerance)}"
        elif neck := ground.bottleneck(begin, end):
            fits = f"there is room for a radius of {_shown(neck[0])}, and it has {_shown(found.radius)}"
            words = f"at {_point(neck[1])} {fits}"
        else:
            words = f"something is all around; {words}"
        yield place_cut_off.at(_written(robot, name), f"no way leads from {origin} to '{name}': {words}")


@check("RBX3612", Severity.WARNING, closed=(WIRING, NAMES))
def navigation_without_laser(robot: Robot) -> Iterator[Finding]:
    """Nothing tells navigation what is in the way but its map."""
    found, go_to = _navigation(robot), robot.components.get(GO_TO)
    if found is None or found.model.costs.map_only or go_to is None or go_to.end("scan") is not None:
        return
    yield navigation_without_laser.at(
        robot.key("navigation"),
        "without a laser, navigation sees nothing that is not in the map",
        help="add a laser, name its topic in 'costs: obstacles: from', or write 'costs: {map_only: true}'",
    )


@check("RBX3613", Severity.WARNING, closed=())
def footprint_too_small(robot: Robot) -> Iterator[Finding]:
    """Navigation takes the robot for smaller than it is."""
    if (found := _navigation(robot)) is None:
        return
    radius, _ = _kept(robot, found)
    if found.model.footprint is None and radius == found.radius:
        return
    described, around = robot.manifest.contents.of(body), robot.manifest.contents.of(world)
    if isinstance(footprint := found.footprint, PolygonFootprint):
        if described and (beyond := _beyond(footprint, hull_of(described.body))) > ROUNDING:
            yield footprint_too_small.at(
                robot.value("navigation", "footprint"),
                f"its body extends {_shown(beyond)} beyond the footprint that navigation keeps free",
                help="write 'footprint: body'",
            )
        return
    outline = outline_of(described.body)[0] if described else 0.0
    if outline > radius + ROUNDING:
        larger, words = outline, "its body extends"
    elif around is not None and around.radius > radius + ROUNDING:
        larger, words = around.radius, "in its world it extends"
    else:
        return
    yield footprint_too_small.at(
        robot.value("navigation", "footprint", "radius"),
        f"navigation keeps {_shown(radius)} free around the robot, and {words} {_shown(larger)}",
        help="leave out 'footprint': the radius is that of the body" if described else "make it at least as large",
    )


@check("RBX3614", Severity.WARNING, closed=())
def inflation_within_robot(robot: Robot) -> Iterator[Finding]:
    """Ways are not dearer near to obstacles, because inflation ends within the robot."""
    if (found := _navigation(robot)) is None:
        return
    reach, inflation = _kept(robot, found)
    if inflation > reach:
        return
    yield inflation_within_robot.at(
        robot.value("navigation", "costs", "inflation", "radius"),
        f"inflation of {_shown(inflation)} ends within the robot, which has a radius of {_shown(reach)}",
        help="ways lead right along obstacles: make it larger by the distance that they should keep",
    )


@check("RBX3615", Severity.WARNING, closed=())
def zone_beside_map(robot: Robot) -> Iterator[Finding]:
    """A zone covers nothing of the map."""
    if (found := _navigation(robot)) is None or not found.zones:
        return
    rows, columns = found.grid.cells.shape
    low, high = (_point((x, y)) for x, y in found.grid.to_points([(0, 0), (columns, rows)]).tolist())
    for zone in found.zones:
        if zone[0] in found.model.costs.zones and not CostZone(*zone).cells(found.grid).any():
            yield zone_beside_map.at(
                robot.value("navigation", "costs", "zones", zone[0]),
                f"the zone '{zone[0]}' covers no cell of the map, which goes from {low} to {high}",
            )


@check("RBX3616", Severity.WARNING, closed=())
def idle_localisation_key(robot: Robot) -> Iterator[Finding]:
    """A key of a localisation says where the robot is, and odometry alone tells that."""
    if (found := _navigation(robot)) is None or (model := found.model.localisation).type != "odometry":
        return
    for name in sorted(model.model_fields_set - {"type"}):
        key = name.rstrip("_")
        yield idle_localisation_key.at(
            robot.key("navigation", "localisation", key),
            f"'{key}' has no effect with 'type: odometry': the robot is where its odometry begins, and drives on",
            help="write 'type: particles' for a robot with a laser, or 'type: tags' for one with a camera",
        )


@check("RBX3622", Severity.WARNING, closed=(WIRING, NAMES))
def scans_too_rare(robot: Robot) -> Iterator[Finding]:
    """Scans come so rarely that the robot takes its laser for silent in between."""
    if (found := _navigation(robot)) is None or (laser := _laser(robot)) is None:
        return
    silence = found.model.costs.obstacles.silence
    if (rate := laser[1]) and rate * silence < SCANS:
        yield scans_too_rare.at(
            robot.value("navigation", "costs", "obstacles", "silence"),
            f"'{laser[0].name}' scans every {format_quantity(1 / rate, TIME)}, and after"
            f" {format_quantity(silence, TIME)} without a scan the robot stops",
            help=f"scan at {format_quantity(SCANS / silence, FREQUENCY)} at least, or make 'silence' longer",
        )


@check("RBX3642", Severity.WARNING, closed=())
def drives_blind(robot: Robot) -> Iterator[Finding]:
    """Obstacles count so near, or a laser counts as silent so late, that the robot cannot stop in time."""
    if (found := _navigation(robot)) is None or (go_to := robot.components.get(GO_TO)) is None:
        return
    reach, _ = _kept(robot, found)
    for made, motion in product(go_to.declared(Navigates), go_to.declared(CommandsMotion)):
        if not (made.sees and made.silence and motion.max_speed and motion.acceleration):
            continue
        needs = reach + motion.max_speed.value**2 / (2 * motion.acceleration.value)
        if made.sees.value < needs:
            yield drives_blind.at(
                setting_span(robot, (go_to, made.sees.field)),
                f"obstacles count within {_shown(made.sees.value)} only, and the robot needs {_shown(needs)} to stop",
                help=f"make it larger: the robot extends {_shown(reach)}, and brakes on the rest",
            )
        if (blind := motion.max_speed.value * made.silence.value) > BLIND:
            yield drives_blind.at(
                setting_span(robot, (go_to, made.silence.field)),
                f"after its last scan, the robot drives on for {format_quantity(made.silence.value, TIME)}:"
                f" {_shown(blind)} at full speed",
                help="a few times the time between two scans is enough, such as '1 s'",
            )


@check("RBX3623", Severity.WARNING, closed=(WIRING, NAMES))
def laser_sees_robot(robot: Robot) -> Iterator[Finding]:
    """A laser sees a link of its own robot, which navigation takes for an obstacle."""
    described, laser = robot.manifest.contents.of(body), _laser(robot)
    if _navigation(robot) is None or described is None or laser is None:
        return
    made, frame = laser[0], getattr(robot.components[GO_TO].config, "scan_frame", "")
    if (at_rest := described.body.poses({}).get(frame)) is None or frame == described.body.root:
        return
    (x, y, z), heading = at_rest.translation, at_rest.to_pose2().heading
    view, nearest = getattr(made.config, "view", math.tau), getattr(made.config, "nearest", 0.0)
    others: list[tuple[str, list[Point2]]] = []
    for link, corners in sections_of(described.body, z):
        around = [(u - x, v - y) for u, v in corners]
        if link == frame or (len(around) > 2 and PolygonFootprint(tuple(around)).inner > 0):
            nearest = max(nearest, *(math.hypot(u, v) for u, v in around))  # its housing: what is within is not seen
        else:
            others.append((link, around))
    seen: dict[str, float] = {}  # links, and how near they are [m]
    for link, around in others:
        for u, v in around:
            if math.hypot(u, v) > nearest and abs(wrap_angle(math.atan2(v, u) - heading)) <= view / 2:
                seen[link] = min(math.hypot(u, v), seen.get(link, math.inf))
    if seen:
        links = ", ".join(f"'{link}', {_shown(away)} away" for link, away in seen.items())
        yield laser_sees_robot.at(
            robot.component_span(made.name),
            f"the laser '{made.name}' at '{frame}' looks at its own robot: at {links}",
            help="put it where nothing is at its height, or narrow its 'view'",
        )


def _navigation(robot: Robot) -> NavigationOfRobot | None:
    contents = robot.manifest.contents
    return contents.of(navigation) if "navigation" in contents.root else None


def _kept(robot: Robot, found: NavigationOfRobot) -> tuple[float, float]:
    """Return how far the robot extends for navigation, and up to where ways are dearer [m], as it is set now."""
    radius, inflation = found.footprint.reach, found.model.costs.inflation.radius
    for _, made in robot.declared(Navigates):
        radius = made.radius.value if made.radius else radius
        inflation = made.inflation.value if made.inflation else inflation
    return radius, inflation


def _laser(robot: Robot) -> tuple[RobotComponent, float | None] | None:
    """Return the component from which navigation takes scans, and their rate [Hz]; None if it is not of the robot."""
    wanted = robot.components[GO_TO].end("scan") if GO_TO in robot.components else None
    if wanted is None:
        return None
    for made in robot.components.values():
        for end in made.ends:
            if isinstance(end.port, Out) and end.topic == wanted.topic:
                return made, end.port.rate
    return None


def _beyond(footprint: PolygonFootprint, corners: tuple[Point2, ...]) -> float:
    """Return how far some points of the frame of a robot are outside of its footprint [m]; 0 if none is."""
    if not corners:
        return 0.0
    return float(outside_polygon(footprint, np.array(corners)).max())


def _written(robot: Robot, name: str) -> Span:
    """Return where a place is written: in the robot, or in its world."""
    is_own = at(robot.manifest.root, ("places", name)) is not None
    return robot.value("places", name) if is_own else robot.value("world")


def _why_not(found: NavigationOfRobot, around: WorldOfRobot | None, place: Place | Pose2) -> str:
    """Return why a robot cannot stand at a place; nothing if it can."""
    if not found.grid.contains((place.x, place.y)):
        return "it is outside of the map"
    things, pose = around.standing if around else [], Pose2(place.x, place.y, place.heading)
    depth, what = overlap(found.grid, things, found.footprint, pose)
    return "" if depth <= ROUNDING else "a wall is there" if what == MAP else f"'{what}' is there"


def _start(
    found: NavigationOfRobot, around: WorldOfRobot | None, places: dict[str, Place]
) -> tuple[str, Pose2 | Place]:
    """Return where the robot is at first, in words and as a pose; its first place if that is not known."""
    given, anywhere = found.model.localisation.start, found.model.localisation.anywhere
    if given is not None and not anywhere:
        return "where the robot starts", given.pose
    if around is not None and not anywhere:
        return "where the robot starts", around.start
    name, place = next(iter(places.items()))
    return f"'{name}'", place


def _shown(length: float) -> str:
    return "nowhere" if math.isinf(length) else format_quantity(round(length, 2), LENGTH)


def _point(place: tuple[float, float]) -> str:
    return f"({place[0]:.1f} m, {place[1]:.1f} m)"
