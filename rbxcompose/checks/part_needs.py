"""A need of a part that the rest of the robot does not meet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from rbxcompose.check_runner import check
from rbxcompose.composition.robot_manifest import About, IncludedPart
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd, resolve
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, Serves, ServesAction

WIRES: tuple[tuple[type[Port[Any]], type[Port[Any]]], ...] = ((Out, In), (Calls, Serves), (CallsAction, ServesAction))
"""The classes of the two ends of a wire."""


@check("RBX3021", closed=(WIRING, NAMES))
def part_needs(robot: Robot) -> Iterator[Finding]:
    """A part needs a topic that nothing else provides."""
    for part in robot.manifest.parts.values():
        for need in part.claims:
            if need.about is not About.NEED:
                continue
            others = [end for end in _at(robot, need.name) if end.instance not in own_instances(part)]
            fitting = [end for end in others if is_type(end, need.type)]
            answers = _answers(end for end in _at(robot, need.name) if end.instance in own_instances(part))
            if any(not answers or isinstance(end.port, answers) for end in fitting):
                continue
            wrong = next((end for end in others if end.type_name and end not in fitting), None)
            if wrong:
                yield part_needs.at(
                    need.span,
                    f"part '{part.name}' needs '{need.name}' as {short(need.type)}, and '{wrong.instance}' has it as "
                    f"{short(wrong.type_name)}",
                    help=f"write '{short(wrong.type_name)}', or connect the part to another topic with 'connect:'",
                )
                continue
            yield part_needs.at(
                part.span,
                f"part '{part.name}' needs '{need.name}' ({short(need.type)}) from outside, and nothing has it",
                help=f"include a part with '{need.name}', or connect it to the right topic with 'connect:'",
                related=[Related(need.span, "needed here")],
            )


def own_instances(part: IncludedPart) -> frozenset[str]:
    """Return all instances that a part brought, including muxes: a mux that it feeds is its own end of the wire."""
    return part.components | part.muxes


def is_type(end: PortEnd, written: str) -> bool:
    """Return whether an end has the type written in a part: `geometry_msgs/Twist`."""
    return short(end.type_name) == short(written)


def short(type_name: str) -> str:
    """Return the short form of a type: `geometry_msgs/msg/Twist` without its middle."""
    package, _, name = type_name.partition("/")
    return f"{package}/{name.rpartition('/')[-1]}"


def _at(robot: Robot, topic: str) -> list[PortEnd]:
    absolute = resolve(topic, robot.manifest.bus.namespace or "")
    return [end for end in robot.ends if end.topic == absolute]


def _answers(own: Iterable[PortEnd]) -> tuple[type[Port[Any]], ...]:
    """Return the types of ports that may be at the other end of the wires of `own`."""
    pairs = [*WIRES, *(wire[::-1] for wire in WIRES)]
    return tuple({other for end in own for one, other in pairs if isinstance(end.port, one)})
