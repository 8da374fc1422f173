"""Topics that have only one end."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.bus.graph import GraphName
from rbxcompose.sdk.ports import In
from rbxcompose.tools.doctor import HostFacts, RunningRobot, examination

NOBODY_PUBLISHES = kind("RBX9407", Severity.WARNING)
_MOST = 8  # names


@examination
def wires(facts: HostFacts) -> Iterator[str | Finding]:
    """Report the ends of wires that have no partner on the bus of each robot."""
    for robot in facts.running:
        if robot.bus is not None:
            yield from _of(robot, [topic for topic in robot.bus.graph.topics if not topic.is_hidden])


def _of(running_robot: RunningRobot, topics: list[GraphName]) -> Iterator[str | Finding]:
    ends = running_robot.robot.ends if running_robot.robot else ()
    open_inputs = {end.topic for end in ends if isinstance(end.port, In) and end.port.is_open}
    alone = [topic for topic in topics if topic.takers and not topic.givers and topic.name not in open_inputs]
    for topic in alone:
        nodes = ", ".join(sorted({end.node for end in topic.takers}))
        words = f"{plain(nodes)} of '{running_robot.name}' subscribes to {plain(topic.name)}, which has no publisher"
        yield NOBODY_PUBLISHES.at(None, words, help="'rbxcompose topic ls' shows what is published")
    unheard = [plain(topic.name) for topic in topics if topic.givers and not topic.takers]
    more = f" and {len(unheard) - _MOST} more" if len(unheard) > _MOST else ""
    heard = f"; published without a subscriber: {', '.join(unheard[:_MOST])}{more}" if unheard else ""
    yield f"{running_robot.name}: {len(topics) - len(alone)} topics are published or open to the outside{heard}"
