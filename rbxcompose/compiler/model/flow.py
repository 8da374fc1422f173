"""How messages flow: publishers and subscribers of a topic, which commands reach which base; what starts after what."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.compiler.composition.robot_manifest import IncludedPart
from rbxcompose.compiler.model.robot import PortEnd, Robot, RobotComponent
from rbxcompose.manifest.arguments import decided_at
from rbxcompose.manifest.tree import at
from rbxcompose.sdk.capabilities import CommandsMotion, Drives, Forwards
from rbxcompose.sdk.ports import In, Out, Qos, Serves, ServesAction, ServesTopic

OTHER_TYPE = "take another type for one of them"  # the remedy if no setting can be changed


@dataclass(frozen=True, slots=True)
class Drive:
    """A component whose commands reach a base."""

    driver: RobotComponent
    commands: CommandsMotion
    base: RobotComponent
    drives: Drives


@dataclass(frozen=True, slots=True)
class MessageFlow:
    """Which messages of a robot reach which component."""

    robot: Robot

    def upstream(self, end: PortEnd, passed: tuple[PortEnd, ...] = ()) -> Iterator[PortEnd]:
        """Yield all outputs on the way to an input: those of muxes, and those whose messages these may let through."""
        for writer in self.robot.writers.get(end.topic, ()):
            if writer in passed or writer.type_name != end.type_name:
                continue
            yield writer
            for port_end in self._let_through(writer) or ():
                yield from self.upstream(port_end, (*passed, writer))

    def sources(self, end: PortEnd) -> Iterator[PortEnd]:
        """Yield the outputs whose messages reach an input; for a mux, those it may let through."""
        return (port_end for port_end in self.upstream(end) if self._let_through(port_end) is None)

    def _let_through(self, output: PortEnd) -> list[PortEnd] | None:
        """Return the inputs that a mux lets through to an output; None if it is not an output of a mux."""
        component = self.robot.components[output.instance]
        muxed = [forwards.inputs for forwards in component.declared(Forwards) if forwards.output == output.name]
        return [end for end in component.ends if any(end.name in names for names in muxed)] if muxed else None

    def fed_by(self, component: RobotComponent, port: str) -> Iterator[PortEnd]:
        """Yield the outputs whose messages reach an input of a component, directly or through muxes."""
        end = component.end(port)
        yield from self.sources(end) if end else ()

    def drives(self) -> Iterator[Drive]:
        """Yield which component commands which base, directly or through muxes."""
        for base, drives in self.robot.declared(Drives):
            for source in self.fed_by(base, drives.commands):
                driver = self.robot.components[source.instance]
                for motion in driver.declared(CommandsMotion):
                    if motion.commands == source.name:
                        yield Drive(driver, motion, base, drives)


def period_of(component: RobotComponent) -> float | None:
    """Return the time between two messages of a component [s], None if it does not send at its own rate only.

    Who commands motion does so in each step, whatever it listens to.
    """
    listens = any(isinstance(end.port, In) for end in component.ends) and not component.declared(CommandsMotion)
    rate = component.cls.rate_of(component.config)
    return None if listens or rate <= 0 else 1 / rate


def setting(component: RobotComponent, name: str) -> float | None:
    """Return a number from a component's configuration, in SI; None if it is in doubt, or there is no such setting."""
    value = getattr(component.config, name, None) if component.is_sound else None
    return value if isinstance(value, float) else None


def setting_span(robot: Robot, *settings: tuple[RobotComponent, str]) -> Span:
    """Return the place of the first of these settings that is written, else that of the first one's component.

    A setting is the name of a field of the configuration; without one, the value comes from the component's type.
    """
    for component, name in settings:
        if is_written(robot, component, name):
            place = component.place(name)
            return decided_at(robot.manifest.root, place, robot.value(*place))
    component, name = settings[0]
    return robot.component_span(component.name) if name else robot.value(*component.path, "type")


def is_written(robot: Robot, component: RobotComponent, name: str) -> bool:
    """Return whether a field of the configuration is written down in the manifest."""
    return bool(name) and at(robot.manifest.root, component.place(name)) is not None


@dataclass(frozen=True, slots=True)
class Wrong:
    """An error in a source of messages: what may help, and the name in it that is not one of `valid`, if any."""

    message: str
    help: str = ""
    name: str = ""
    valid: Collection[str] = ()


def answers(end: PortEnd) -> bool:
    """Return whether a client of this end waits for an answer; an order whose end is not reported may go to several."""
    return isinstance(end.port, Serves | ServesAction) or (isinstance(end.port, ServesTopic) and bool(end.port.ends))


def part_of(robot: Robot, component: str) -> IncludedPart | None:
    """Return the outermost instance that brings a component, None if the robot itself lists it."""
    found = [part for part in robot.manifest.parts.values() if component in part.components]
    return min(found, key=lambda part: part.name.count("."), default=None)


def shared_names(robot: Robot, part: IncludedPart, other: IncludedPart) -> dict[str, str]:
    """Return what both instances publish or serve, by topic: its name in the part, which `connect` takes."""
    theirs = _published(robot, other)
    return {topic: name for topic, name in _published(robot, part).items() if topic in theirs}


def _published(robot: Robot, part: IncludedPart) -> dict[str, str]:
    ends = [end for name in sorted(part.components & robot.components.keys()) for end in robot.components[name].ends]
    published = [end for end in ends if answers(end) or (isinstance(end.port, Out) and end.port.qos is not Qos.COMMAND)]
    return {end.topic: end.port.topic for end in published if not end.port.topic.startswith("/")}


After = Mapping[str, Sequence[str]]  # name -> the names that start before it


def cycle_of(after: After) -> list[str]:
    """Return names each of which waits for the next, the last for the first; empty if there is no such cycle."""
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        circle: list[str] = error.args[1][:0:-1]  # the sorter lists predecessors first, and repeats the first
        first = circle.index(min(circle))
        return circle[first:] + circle[:first]
    return []


def start_order(after: After) -> list[str]:
    """Return all names so that each comes after those it waits for, otherwise in the given order.

    There must be no cycle.
    """
    ordered: dict[str, None] = {}
    for first in after:
        waiting = [(first, iter(after[first]))]  # no recursion: a chain may be longer than Python's stack
        while waiting:
            name, others = waiting[-1]
            other = next((candidate for candidate in others if candidate in after and candidate not in ordered), None)
            if other is not None:
                waiting.append((other, iter(after[other])))
            else:
                ordered.setdefault(name)
                waiting.pop()
    return list(ordered)
