"""Two ends of a topic with different QoS classes."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.two_writers import is_command
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.ports import In, Out


@check("RBX3120", Severity.WARNING, closed=())
def unlike_classes(robot: Robot) -> Iterator[Finding]:
    """A port reads messages of another QoS class than they are published in."""
    for topic, readers in robot.readers.items():
        writers = robot.writers.get(topic, [])
        for reader in readers:
            if is_command(reader) and len(writers) > 1:
                continue  # that there are two is told, and the worse mistake
            for writer in writers:
                mine, theirs = reader.port, writer.port
                if not isinstance(mine, In) or not isinstance(theirs, Out) or reader.type_name != writer.type_name:
                    continue
                if mine.qos is not theirs.qos:
                    yield unlike_classes.at(
                        robot.end_span(reader),
                        f"'{reader.instance}' reads '{topic}' as {mine.qos.value}, "
                        f"and '{writer.instance}' publishes it as {theirs.qos.value}",
                        label=f"its port '{reader.name}'",
                        help="give both ports the same 'qos'",
                        related=[Related(robot.end_span(writer), f"its port '{writer.name}'")],
                    )
