"""How long a base moves on after a link is cut that its commands cross, or the goals of what commands it. Pure.

The base is the only one that can tell that commands are missing, so the time is its own: until it misses them, two
cycles in which it notices, and braking from its limits. A goal is cancelled once its sender has been silent for the
lease of the link, and what it moved commands nothing from then on. So the lease is what is left of the time allowed.
"""

from collections.abc import Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.units import LENGTH, TIME, format_quantity
from rbxcompose.bus.endpoints import LINK_LEASE
from rbxcompose.compiler.model.flow import MessageFlow
from rbxcompose.compiler.model.robot import RobotComponent
from rbxcompose.compiler.model.robot import resolve as absolute
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.sdk.capabilities import Drives, Setting
from rbxcompose.sdk.ports import ServesAction

CYCLES = 2
SLOWEST = 50.0  # [Hz] of a base that does not tell its rate
SHORTEST_LEASE = 0.4  # [s]; links that pause for less are common

LONGEST = 60.0  # [s] that a system may let a base drive on: links do not pause for so long

LATE_STOP = kind("RBX6140")
LONG_STOP = kind("RBX6153", Severity.WARNING)


@dataclass(frozen=True, slots=True)
class StopAfterCut:
    """A base that is commanded from another host: when it stands still after the last command [s], None: unknown."""

    base: str
    host: str
    waiting: float | None  # until it misses commands, and two cycles [s]
    braking: float | None  # from its largest speed and turn rate [s]

    @property
    def time(self) -> float | None:
        """Return the whole time [s]."""
        return None if self.waiting is None or self.braking is None else self.waiting + self.braking

    @property
    def text(self) -> str:
        """Return it in words."""
        if self.time is None:
            unknown = "its deadline" if self.waiting is None else "how it brakes"
            return f"'{self.base}' on {self.host} moves for an unknown time: {unknown} is unknown"
        words = (format_quantity(value, TIME) for value in (self.time, self.waiting or 0.0, self.braking or 0.0))
        return "'{}' on {} stands still within {}: {} until it misses commands, {} of braking".format(
            self.base, self.host, *words
        )


def stops_after_cut(robot: PlacedRobot) -> Iterator[StopAfterCut]:
    """Yield the bases whose commands cross between hosts, anywhere on their way through muxes."""
    flow = MessageFlow(robot.robot)
    for base, drives in robot.robot.declared(Drives):
        end, host = base.end(drives.commands), robot.hosts.get(base.name)
        writers = {robot.hosts.get(port_end.instance) for port_end in flow.upstream(end)} if end else set()
        if host is not None and writers - {host}:
            yield _stop_of(base, drives, host)


def _stop_of(base: RobotComponent, drives: Drives, host: str) -> StopAfterCut:
    cycles = CYCLES / (base.cls.rate_of(base.config) or SLOWEST)
    waiting = drives.stops_after.value + cycles if drives.stops_after else None
    times = (_braking(drives.max_speed, drives.acceleration), _braking(drives.max_turn_rate, drives.turn_acceleration))
    known = [time for time in times if time is not None]
    return StopAfterCut(base.name, host, waiting, max(known) if len(known) == len(times) else None)


def _braking(speed: Setting[float] | None, acceleration: Setting[float] | None) -> float | None:
    return speed.value / acceleration.value if speed and acceleration else None


@dataclass(frozen=True, slots=True)
class StopOfGoal:
    """A base that moves for goals from another host or robot: when it stands still after these are cut off."""

    server: str  # the component that carries out the goals
    is_shared: bool  # with other robots
    lease: float  # of the link [s]
    stop: StopAfterCut  # after the goal is cancelled, as if commands were missing then

    @property
    def time(self) -> float | None:
        """Return the whole time [s]; None: unknown."""
        return None if self.stop.time is None else self.lease + self.stop.time

    @property
    def text(self) -> str:
        """Return it in words."""
        from_whom = "another robot" if self.is_shared else "another host"
        goals = f"goals of '{self.server}' from {from_whom}"
        if self.time is None:
            return f"{goals} are cancelled, and {self.stop.text}"
        whole, lease = (format_quantity(round(value, 6), TIME) for value in (self.time, self.lease))
        return f"{goals} are cancelled after {lease}, and '{self.stop.base}' stands still within {whole}"


def stops_of_goals(robot: PlacedRobot) -> Iterator[StopOfGoal]:
    """Yield the bases that move for goals from another host or robot."""
    crossing = {end.component for one in robot.crossings for end in one.givers if isinstance(end.port, ServesAction)}
    called = {absolute(name, robot.plan.bus.namespace) for name in robot.model.share if robot.model.callers}
    shared = {one.end.component for one in robot.ends if isinstance(one.end.port, ServesAction) and one.topic in called}
    if not crossing and not shared:
        return
    flow = MessageFlow(robot.robot)
    for base, drives in robot.robot.declared(Drives):
        end = base.end(drives.commands)
        movers = dict.fromkeys(port_end.instance for port_end in flow.upstream(end)) if end else {}
        stop = _stop_of(base, drives, robot.hosts.get(base.name, ""))
        left = LINK_LEASE if stop.time is None else robot.model.stop_within - stop.time
        lease = min(max(int(1000 * left) / 1000, SHORTEST_LEASE), LINK_LEASE)
        for is_shared, servers in ((False, crossing), (True, shared)):
            yield from (StopOfGoal(mover, is_shared, lease, stop) for mover in movers if mover in servers)


def lease_of(robot: PlacedRobot, *, is_shared: bool) -> float:
    """Return the silence [s] after which links between its hosts, or with other robots, count as lost."""
    return min((stop.lease for stop in stops_of_goals(robot) if stop.is_shared is is_shared), default=LINK_LEASE)


def every_stop(robot: PlacedRobot) -> Iterator[tuple[str, StopAfterCut | StopOfGoal]]:
    """Yield the bases that a cut link lets move on for a while, and why."""
    yield from ((stop.base, stop) for stop in stops_after_cut(robot))
    yield from ((goal.stop.base, goal) for goal in stops_of_goals(robot))


def slow_stops(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    """Yield the bases that move on for longer than the system allows."""
    allowed, reported = robot.model.stop_within, set[str]()
    if allowed > LONGEST:
        yield from _long_stop(system, robot)
    for base, one in every_stop(robot):
        if base not in reported and (one.time is None or one.time > allowed + 1e-9):
            reported.add(base)
            written = "stop_within" in robot.model.model_fields_set
            span = robot.span(system.root, "stop_within" if written else "robot")
            message = f"after a link is cut, {one.text}; allowed is {format_quantity(allowed, TIME)}"
            yield LATE_STOP.at(span, message, help="shorten its 'command_timeout' or limit its speeds in a profile")


def _long_stop(system: System, robot: PlacedRobot) -> Iterator[Finding]:
    """Yield the finding about a `stop_within` that was surely meant in milliseconds, with how far a base may drive."""
    allowed = robot.model.stop_within
    speeds = [drives.max_speed.value for _, drives in robot.robot.declared(Drives) if drives.max_speed]
    far = f": {format_quantity(round(allowed * max(speeds), 1), LENGTH)}" if speeds else ""
    message = f"'{robot.name}' may drive on for {format_quantity(allowed, TIME)} after a link is cut{far}"
    help_text = f"a second or two is usual; if these are milliseconds, write '{allowed:g} ms'"
    yield LONG_STOP.at(robot.span(system.root, "stop_within"), message, help=help_text)
