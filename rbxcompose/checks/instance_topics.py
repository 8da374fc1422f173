"""Two instances of one part that publish on one topic."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.two_writers import is_command
from rbxcompose.findings import Finding, Related
from rbxcompose.model.instances import answers, shared_names
from rbxcompose.model.robot import Robot
from rbxcompose.rules import WIRING
from rbxcompose.sdk.ports import Out


@check("RBX3023", closed=(WIRING,))
def instance_topics(robot: Robot) -> Iterator[Finding]:
    """Two instances of a part publish on the same topic."""
    first: dict[tuple[str, str], str] = {}  # file and topic -> instance
    for part in robot.manifest.parts.values():
        told = {
            end.topic: end.port.topic
            for name in part.components & robot.components.keys()
            for end in robot.components[name].ends
            if isinstance(end.port, Out) and not is_command(end)
        }
        for topic, short in sorted(told.items()):
            other = robot.manifest.parts[first.setdefault((part.file, topic), part.name)]
            if other is part or short.startswith("/"):
                continue
            shared = shared_names(robot, part, other)
            if not any(end.topic in shared for end in robot.ends if answers(end)):  # else it is told with those
                yield instance_topics.at(
                    part.span,
                    f"the instances '{part.name}' and '{other.name}' of one part both publish on '{topic}'",
                    help=f"give one of them another topic: 'connect: {{{short}: {part.name}/{short}}}'",
                    related=[Related(other.span, f"the instance '{other.name}'")],
                )
