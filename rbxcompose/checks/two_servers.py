"""Two servers of one service or action."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.composition.robot_manifest import IncludedPart
from rbxcompose.findings import Finding, Related
from rbxcompose.model.instances import answers, part_of, shared_names
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.rules import WIRING
from rbxcompose.sdk.ports import Out


@check("RBX3008", closed=(WIRING,))
def two_servers(robot: Robot) -> Iterator[Finding]:
    """Two components serve the same service or action."""
    first: dict[str, str] = {}
    instances: dict[tuple[str, str], tuple[IncludedPart, IncludedPart]] = {}
    for end in robot.ends:
        if not answers(end):
            continue
        other = first.setdefault(end.topic, end.instance)
        parts = (part_of(robot, end.instance), part_of(robot, other))
        if other == end.instance:
            continue
        if parts[0] and parts[1] and parts[0].name != parts[1].name:
            instances.setdefault((parts[0].name, parts[1].name), (parts[0], parts[1]))
        else:
            yield two_servers.at(
                robot.component_span(end.instance),
                f"'{end.instance}' and '{other}' both serve '{end.topic}'",
                label="this one",
                help=f"give one of them names of its own: 'connect: {{{_own_names(robot, end, other)}}}'",
                related=[Related(robot.component_span(other), "and this one")],
            )
    for part, earlier in instances.values():
        yield _of_instances(robot, part, earlier)


def _of_instances(robot: Robot, part: IncludedPart, earlier: IncludedPart) -> Finding:
    """Return the finding for two instances that serve the same, with names for all that both of them have."""
    shared = shared_names(robot, part, earlier)
    served = sorted({end.topic for end in robot.ends if answers(end)} & shared.keys())
    # A skill is called by the last word of its topic, so that one needs to differ.
    renamed = {
        name: f"{name}_{part.name}" if topic in served else f"{part.name}/{name}" for topic, name in shared.items()
    }
    names = ", ".join(f"{name}: {new}" for name, new in renamed.items())
    return two_servers.at(
        part.span,
        f"the instances '{part.name}' and '{earlier.name}' both serve {' and '.join(map(repr, served))}",
        help=f"give one of them names of its own: 'connect: {{{names}}}'",
        related=[Related(earlier.span, f"the instance '{earlier.name}'")],
    )


def _own_names(robot: Robot, end: PortEnd, other: str) -> str:
    """Return what to write below `connect` for all that both instances write or serve."""
    theirs = {one.topic for one in robot.components[other].ends if _tells(one)}
    both = (one for one in robot.components[end.instance].ends if one.topic in theirs and _tells(one))
    return ", ".join(f"{one.name}: {end.instance}/{one.name}" for one in both)


def _tells(end: PortEnd) -> bool:
    return isinstance(end.port, Out) or answers(end)
