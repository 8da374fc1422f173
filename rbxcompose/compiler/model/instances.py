"""Order and overlap of components: what starts after what, what two instances of a part share."""

from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

from rbxcompose.compiler.composition.robot_manifest import IncludedPart
from rbxcompose.compiler.model.robot import PortEnd, Robot
from rbxcompose.sdk.ports import Out, Qos, Serves, ServesAction, ServesTopic


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
