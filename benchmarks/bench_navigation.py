"""Worlds and navigation: how fast lasers, ways and followers are, and whether goals are reached.

Nav2 is not installable beside this project, and publishes no figures of single plans on such grids, so there is no peer
but the bars.
"""

from __future__ import annotations

import math
import random
import time
from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.measuring import ROOT, Row, Samples, timed
from rbxcompose.base.geometry import Pose2
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveSim
from rbxcompose.domains.navigation.components.mapper import Mapper
from rbxcompose.domains.navigation.costs import INSCRIBED, LETHAL, CostSettings, LayeredCosts
from rbxcompose.domains.navigation.follower import FollowerSettings, FollowState, PathFollower
from rbxcompose.domains.navigation.localisation import LocalisationSettings, ParticleFilter
from rbxcompose.domains.navigation.planner import plan
from rbxcompose.domains.navigation.reach import ReachableAreas
from rbxcompose.domains.worlds.contact import first_contact, overlap
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap, read_map
from rbxcompose.domains.worlds.ray_casting import Rays
from rbxcompose.domains.worlds.sections.world import world
from rbxcompose.domains.worlds.shapes import CircleFootprint, PolygonFootprint
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import message_of
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing.bench import Bench, run_robot

MEASURES = ("rbxcompose/domains/worlds", "rbxcompose/domains/navigation")

HOUSE: Path = ROOT / "worlds/house_map.yaml"
RADIUS, PERIOD = 0.18, 0.05  # [m], [s]
PAIRS, LONGEST = 500, 180.0  # goals, and the time for each [s]
OVER = (FollowState.REACHED, FollowState.BLOCKED, FollowState.STUCK)
LONG = PolygonFootprint(((0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2), (0.4, -0.2)))
LONG_PAIRS = 100
MEETINGS, PATIENCE = 100, 300.0  # goals with somebody in the house, and the time for each [s]
WALKS, PAUSES, AROUND = 0.8, 3.0, 0.26  # of somebody: [m/s], [s] in each room, [m] around him
NEAR, APART = 0.005, 0.05  # [m] of gap: at which they touch, and from which on they do no more
DRIVES_INTO = 0.05  # [m/s] towards somebody
TOUR = ("living_room", "hallway", "kitchen", "hallway", "bathroom", "hallway", "dock", "living_room")
ROBOTS, SECONDS = 20, 20  # of a fleet, and how long it is looked at [s]
PASSER = """rbx: 1
kind: Robot
name: passer
world: world.yaml
body: {urdf: rbx:robots/turtlebot/turtlebot.urdf}
components:
  base: {type: diff_drive_sim}
  laser: {type: laser_sim, frame: base_link, farthest: 8 m, noise: 1 cm}
navigation:
  costs: {obstacles: {range: 4 m}}
"""
MAPPED = """rbx: 1
kind: Overlay
name: mapped
components: {mapper: {type: mapper, frame: base_link}}
navigation: {localisation: {type: fake}}
"""
ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False)


def rows() -> list[Row]:
    """Return the figures of worlds and navigation."""
    return [
        *_lasers(),
        *_plans(),
        *_filters(),
        *_drives(),
        *_long_drives(),
        *_meetings(),
        _mapping(),
        _cleaning(),
        _fleet(),
    ]


def _lasers() -> Iterator[Row]:
    rays = Rays(read_map(HOUSE))
    times = timed(lambda: rays.cast((4.8, 2.5), ANGLES, 10.0), 200)
    yield Row(
        name="navigation: a laser of 360 rays of 10 m in the house",
        unit="ms",
        how="all rays against a map of 160 x 120 cells, exactly; numpy",
        ours=times.median * 1e3,
        p99=times.p99 * 1e3,
        most=1.0,
    )


def _plans() -> Iterator[Row]:
    open_map = GridMap(np.zeros((1000, 1000), np.int8), 0.05)
    maze = np.zeros((1000, 1000), np.int8)
    maze[333, :800] = maze[666, 200:] = 100
    for name, grid in {"an open map": open_map, "two walls across it": GridMap(maze, 0.05)}.items():
        costs = LayeredCosts(grid, CostSettings())
        times = timed(partial(plan, costs, Pose2(1, 1), Pose2(49, 49), 0.1), 15)
        yield Row(
            name=f"navigation: a plan on 1,000 x 1,000 cells, {name}",
            unit="ms",
            how="from corner to corner, on costs; scipy, roughly first",
            ours=times.median * 1e3,
            p99=times.p99 * 1e3,
            most=50.0,
        )


def _drives() -> Iterator[Row]:
    grid = read_map(HOUSE)
    costs, draw = LayeredCosts(grid, CostSettings(radius=RADIUS)), random.Random(3)  # noqa: S311
    cycles: list[float] = []
    reached = touched = count = 0
    longest = 0.0
    while count < PAIRS:
        start, goal = (Pose2(draw.uniform(0, 8), draw.uniform(0, 6), draw.uniform(-3, 3)) for _ in range(2))
        if any(costs.value_at(at.x, at.y) in (INSCRIBED, LETHAL) for at in (start, goal)):
            continue
        count += 1
        way = plan(costs, start, goal, 0.1)
        follower, pose, driven, spent = PathFollower(FollowerSettings()), start, 0.0, 0.0
        follower.start(way)
        state, poses = FollowState.FOLLOWS, [start]
        while state not in OVER and spent < LONGEST:
            began = time.perf_counter()
            velocity, state = follower.update(pose, costs, PERIOD)
            cycles.append(time.perf_counter() - began)
            pose = pose.moved(velocity, PERIOD)
            poses.append(pose)
            driven, spent = driven + abs(velocity.linear) * PERIOD, spent + PERIOD
        reached += state is FollowState.REACHED
        touched += any(first_contact(grid, (), CircleFootprint(RADIUS), *motion) for motion in pairwise(poses))
        longest = max(longest, driven / max(sum(one.distance(other) for one, other in pairwise(way.poses)), 1.0))
    how = f"{PAIRS} pairs of poses in the house, a base that does what it is told"
    times = Samples(tuple(cycles))
    yield Row("navigation: a cycle of the follower", "ms", how, times.median * 1e3, times.p99 * 1e3, most=1.0)
    yield Row("navigation: goals that are reached", "%", how, 100 * reached / PAIRS, least=99.0)
    yield Row("navigation: drives that touch something", "", how, float(touched), most=0.0)
    yield Row("navigation: the longest drive beside its way", "x", how, longest, most=1.15)


def _long_drives() -> Iterator[Row]:
    grid, draw = read_map(HOUSE), random.Random(4)  # noqa: S311
    costs = LayeredCosts(grid, CostSettings(LONG.inner, 0.6, outline=LONG))
    plans: list[float] = []
    cycles: list[float] = []
    reached = touched = 0
    while len(plans) < LONG_PAIRS:
        start, goal = (Pose2(draw.uniform(0, 8), draw.uniform(0, 6), draw.uniform(-3, 3)) for _ in range(2))
        if costs.room_at(np.array([(at.x, at.y) for at in (start, goal)])) < LONG.reach + grid.resolution:
            continue  # it has no room to turn there
        began = time.perf_counter()
        way = plan(costs, start, goal, 0.1)
        plans.append(time.perf_counter() - began)
        follower, pose, state, poses = PathFollower(FollowerSettings()), start, FollowState.FOLLOWS, [start]
        follower.start(way)
        while state not in OVER and len(poses) * PERIOD < LONGEST:
            began = time.perf_counter()
            velocity, state = follower.update(pose, costs, PERIOD)
            cycles.append(time.perf_counter() - began)
            pose = pose.moved(velocity, PERIOD)
            poses.append(pose)
        reached += state is FollowState.REACHED
        touched += any(first_contact(grid, (), LONG, *motion) for motion in pairwise(poses))
    how = f"{LONG_PAIRS} pairs of poses in the house at which a robot of 80 x 40 cm has room to turn, no recoveries"
    times, planned = Samples(tuple(cycles)), Samples(tuple(plans))
    yield Row("navigation: a plan of a long robot", "ms", how, planned.median * 1e3, planned.p99 * 1e3, most=200.0)
    yield Row("navigation: a cycle of its follower", "ms", how, times.median * 1e3, times.p99 * 1e3, most=2.0)
    yield Row("navigation: goals that a long robot reaches", "%", how, 100 * reached / LONG_PAIRS, least=99.0)
    yield Row("navigation: drives of a long robot that touch something", "", how, float(touched), most=0.0)


def _mapping() -> Row:
    with TemporaryDirectory() as folder:
        Path(folder, "mapped.yaml").write_text(MAPPED, encoding="utf-8")
        robot, overlay, sets = str(ROOT / "robots/house"), f"{folder}/mapped.yaml", ("start=clean_house",)
        # A profile, since the overlay changes what another one builds upon.
        found = compile_robot(robot, profiles=["watchman"], overlays=[overlay], sets=sets, environment={})
    if found.robot is None or found.plan is None:
        raise ValueError("the house does not compile with a mapper")
    mapper, around = run_robot(found.plan).bench.component("mapper"), found.robot.manifest.contents.of(world)
    if not isinstance(mapper, Mapper) or mapper.mapper.grid is None or around is None:
        raise ValueError("the robot has made no map")
    made = mapper.mapper.grid
    rows, columns = np.nonzero(made.cells >= 0)
    middles = made.to_points(np.stack((columns + 0.5, rows + 0.5), -1))
    point = CircleFootprint(1e-6)
    solid = [overlap(around.file.grid, around.standing, point, Pose2(x, y))[0] > 0 for x, y in middles.tolist()]
    return Row(
        name="navigation: cells of a map of the house that are right",
        unit="%",
        how="of those seen while cleaning, with walls and furniture; a laser with noise of 1 cm, true poses",
        ours=100 * float(np.mean((made.cells[rows, columns] >= SOLID) == np.array(solid))),
        least=97.0,
    )


def _cleaning() -> Row:
    _, compiled = _compiled(str(ROOT / "robots/house"))
    began = time.perf_counter()
    ran = run_robot(compiled)
    took = time.perf_counter() - began
    return Row(
        name="navigation: robot time of the house beside real time",
        unit="x",
        how="a stepped clock: laser of 10 Hz, contacts at 50 Hz, costs, ways, the mission",
        ours=ran.bench.clock.now() / took,
        least=20.0,
    )


def _compiled(file: str) -> tuple[Robot, Plan]:
    found = compile_robot(file, environment={})
    if found.robot is None or found.plan is None:
        raise ValueError(f"{file} does not compile")
    return found.robot, found.plan


def _fleet() -> Row:
    _, compiled = _compiled(str(ROOT / "robots/house"))
    benches = [Bench(plan=compiled) for _ in range(ROBOTS)]
    for bench in benches:
        bench.advance(2.0)
    began = time.process_time()
    for _ in range(10 * SECONDS):
        for bench in benches:
            bench.advance(0.1)
    return Row(
        name=f"navigation: {ROBOTS} robots that clean houses, in real time",
        unit="%",
        how="of one core; each with its world, laser, costs, ways and mission, all in one process",
        ours=100 * (time.process_time() - began) / SECONDS,
        most=100.0,
    )


def _filters() -> Iterator[Row]:
    grid = read_map(HOUSE)
    places = Pose2(4.8, 1.5), Pose2(4.8, 2.0)
    scans = [Rays(grid).cast((at.x, at.y), ANGLES, 10.0) for at in places]
    for count in (500, 2000):
        core = ParticleFilter(grid, LocalisationSettings(least=count, most=count))
        core.start(places[0], 0.1, 0.1)
        turns = iter(range(1_000_000))

        def update(core: ParticleFilter = core, turns: Iterator[int] = turns) -> None:
            turn = next(turns) % 2
            core.move(places[turn])
            core.see(Pose2(), ANGLES, scans[turn])

        times = timed(update, 100)
        yield Row(
            name=f"navigation: a scan in a particle filter of {count:,} particles",
            unit="ms",
            how="60 beams of 360 weighed in the house after 50 cm, and drawn again; numpy",
            ours=times.median * 1e3,
            p99=times.p99 * 1e3,
            most=20.0,
        )


def _walk(robot: Robot) -> str:
    """Return the path of somebody who walks through all rooms, around walls and furniture, as a world has it."""
    found = robot.manifest.contents.of(world)
    if found is None:
        raise ValueError("the house has no world")
    grid, places = found.file.grid, found.file.places
    solid = ReachableAreas(grid, 0.0, found.standing).areas == 0
    settings = CostSettings(radius=AROUND)
    costs = LayeredCosts(GridMap(np.where(solid, 100, 0).astype(np.int8), grid.resolution, grid.origin), settings)
    spots: list[tuple[float, float, float]] = []
    for begin, end in pairwise(places[name] for name in TOUR):
        way = plan(costs, Pose2(begin.x, begin.y), Pose2(end.x, end.y), 0.5).poses
        now = spots[-1][0] + PAUSES if spots else 0.0
        spots.append((now, way[0].x, way[0].y))
        for at in (*way[5:-2:5], way[-1]):
            now += max(math.dist(spots[-1][1:], (at.x, at.y)), 1e-3) / WALKS
            spots.append((now, at.x, at.y))
    return ", ".join(f"[{now:.4f} s, {x:.3f} m, {y:.3f} m]" for now, x, y in spots)


def _meetings() -> Iterator[Row]:
    house, _ = _compiled(str(ROOT / "robots/house"))
    somebody = f"  somebody: {{shape: person, repeats: true, path: [{_walk(house)}]}}\nspawn:"
    text = (ROOT / "worlds/house.yaml").read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        Path(folder, "world.yaml").write_text(
            text.replace("house_map", "rbx:worlds/house_map").replace("spawn:", somebody), encoding="utf-8"
        )
        Path(folder, "robot.yaml").write_text(PASSER, encoding="utf-8")
        robot, compiled = _compiled(f"{folder}/robot.yaml")
        bench = Bench(plan=compiled)
    bench.advance(0.5)
    base, around = bench.component("base"), robot.manifest.contents.of(world)
    if not isinstance(base, DiffDriveSim) or base.world is None or around is None:
        raise ValueError("the robot is in no world")
    person = base.world.shapes[-1]
    towards: list[float] = []  # [m/s] at which the robot drives when they touch
    touching, speed = False, 0.0  # a base that touches something stands already

    def look(_: Odometry) -> None:
        nonlocal touching, speed
        at, other = base.core.pose, person.pose_at(bench.clock.now())
        gap = at.distance(other) - around.radius - person.solid.reach
        if gap < NEAR and not touching:
            towards.append(speed * math.cos(at.bearing(other)))
        touching, speed = gap < (APART if touching else NEAR), base.core.velocity.linear

    bench.bus.subscribe("bench", "/odom", Odometry, Qos.STATE, look)
    areas, draw = ReachableAreas(around.file.grid, around.radius + 0.05, around.standing), random.Random(5)  # noqa: S311
    home = areas.area_at((around.start.x, around.start.y))
    reached = count = 0
    while count < MEETINGS:
        goal = Pose2(draw.uniform(0, 8), draw.uniform(0, 6), draw.uniform(-3, 3))
        if areas.area_at((goal.x, goal.y)) != home:
            continue
        count += 1
        ends: list[Ended[NavigateToPose.Result]] = []
        wanted = NavigateToPose.Goal(pose=PoseStamped(Header(frame_id="map"), message_of(goal)))
        bench.bus.action_client("bench", "/go_to", NavigateToPose)(wanted, ends.append)
        bench.run_until(lambda ends=ends: bool(ends), PATIENCE)  # type: ignore[misc]
        reached += bool(ends) and ends[0].outcome is Outcome.SUCCEEDED
    how = f"{MEETINGS} goals in the house, in which somebody walks at {WALKS:g} m/s and looks at nothing"
    into = sum(speed > DRIVES_INTO for speed in towards)
    yield Row("navigation: times the robot drives into somebody", "", how, float(into), most=5.0)
    yield Row("navigation: times that they touch at all", "", how, float(len(towards)))
    yield Row("navigation: goals that are reached in spite of somebody", "%", how, 100 * reached / count, least=99.0)
