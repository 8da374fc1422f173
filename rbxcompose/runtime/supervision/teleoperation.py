"""Where a person may command a base: in front of its muxes, never behind them."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.sdk.capabilities import Drives, Forwards
from rbxcompose.sdk.ports import Out
from rbxcompose.sdk.registry import component_type, declared


def teleoperated(plan: Plan) -> dict[str, str]:
    """Return the topic that takes a person's velocities, by base; a base that no input is free for is left out.

    If a mux decides who commands the base, this is its open input of the highest priority on which nothing in the
    robot publishes. An input that another mux feeds leads to the inputs of that one.
    """
    found = dict[str, str]()
    for base in plan.instances:
        for drives in declared(base.type, base.config, Drives):
            wire = next(one for one in base.wires if one.port == drives.commands)
            if wire.type == Twist.TYPE and (first := next(_free(plan, wire.topic, ()), None)):
                found[base.name] = first
    return found


def _free(plan: Plan, topic: str, passed: tuple[str, ...]) -> Iterator[str]:
    """Yield the topics that nobody writes and that command what listens to `topic`, the best one first."""
    writers = [one for one in plan.instances if topic in _written(one)]
    if topic in passed:
        return
    if not writers:
        yield topic
    for mux in writers:
        for forwards in declared(mux.type, mux.config, Forwards):
            if mux.topic(forwards.output) == topic:
                for name in forwards.inputs:
                    yield from _free(plan, mux.topic(name), (*passed, topic))


def _written(instance: Instance) -> set[str]:
    ports = component_type(instance.type).ports(instance.config)
    return {instance.topic(name) for name, port in ports.items() if isinstance(port, Out)}
