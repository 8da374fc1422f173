"""Where a person may drive: the topics that take velocities and that nothing else in the robot publishes on."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.sdk.capabilities import TELEOP, Drives, Forwards
from rbxcompose.sdk.ports import Out
from rbxcompose.sdk.registry import declared


def teleoperated(plan: Plan) -> dict[str, str]:
    """Return the topic that takes a person's velocities, by base; a base that no input is free for is left out.

    If a mux decides who commands the base, this is its input `teleop`, or else that of the highest priority, of those
    on which nothing in the robot publishes. An input that another mux feeds leads to the inputs of that one.
    """
    found = dict[str, str]()
    for base in plan.everywhere:
        for drives in declared(base.type, base.config, Drives):
            wire = next(candidate for candidate in base.wires if candidate.port == drives.commands)
            free = list(_free(plan, wire.topic, ())) if wire.type == Twist.TYPE else []
            for topic in sorted(free, key=lambda topic: topic.rpartition("/")[2] != TELEOP)[:1]:
                found[base.name] = topic
    return found


def _free(plan: Plan, topic: str, passed: tuple[str, ...]) -> Iterator[str]:
    """Yield the topics that nobody writes and that command what listens to `topic`, the best one first."""
    writers = [instance for instance in plan.everywhere if topic in _written(plan, instance)]
    if topic in passed:
        return
    if not writers:
        yield topic
    for mux in writers:
        for forwards in declared(mux.type, mux.config, Forwards):
            if mux.topic(forwards.output) == topic:
                for name in forwards.inputs:
                    yield from _free(plan, mux.topic(name), (*passed, topic))


def _written(plan: Plan, instance: Instance) -> set[str]:
    return {instance.topic(name) for name, port in plan.ports(instance).items() if isinstance(port, Out)}
