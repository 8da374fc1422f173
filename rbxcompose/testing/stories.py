"""The laws of a robot, from its plan, and its story, from recorded messages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from rbxcompose.bus.goals import GoalState
from rbxcompose.bus.names import ActionNames
from rbxcompose.clock import NANOSECONDS
from rbxcompose.msgs import registry
from rbxcompose.msgs.action_msgs import GoalStatusArray
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.mux.config import MuxConfig
from rbxcompose.plan.model import Instance, Plan
from rbxcompose.recording.message import Recorded
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.sdk.ports import ServesAction
from rbxcompose.sdk.registry import component_type, declared
from rbxcompose.testing.invariants import (
    ActionClaim,
    Base,
    Laws,
    ObservedEvent,
    Ordered,
    SentVelocity,
    Switch,
    SwitchInput,
    ToldGoals,
)


def laws_of(plan: Plan, *, slack: float = 0.0, is_lossless: bool = False, longest_goal: float = 60.0) -> Laws:
    """Return the laws of a robot: its bases, its velocity muxes, and the claims of its actions."""
    switches = (_switch(one) for one in plan.instances if isinstance(one.config, MuxConfig) and _is_judged(one.config))
    return Laws(
        bases=list(_bases(plan)),
        switches=list(switches),
        claims=dict(_claims(plan)),
        longest_goal=longest_goal,
        slack=slack,
        is_lossless=is_lossless,
    )


def events_of(laws: Laws, told: Iterable[Recorded | Ordered], start: int = 0) -> Iterator[ObservedEvent]:
    """Yield the events of messages in order, merged with orders. `start`: robot time 0 on the messages' clock [ns]."""
    commands = {one.command for one in laws.bases} | {one.output for one in laws.switches}
    commands |= {topic for one in laws.switches for topic in one.inputs}
    motions = {one.motion for one in laws.bases}
    goals = {ActionNames.of(name).status: name for name in laws.claims}
    for message in told:
        if isinstance(message, Ordered):
            yield message
            continue
        time, topic = (message.log_time - start) / NANOSECONDS, message.topic.name
        if topic in motions:
            yield SentVelocity(time, topic, _velocity(decode(Odometry, message.payload).twist.twist))
        elif topic in commands and message.topic.type == Twist.TYPE:
            yield SentVelocity(time, topic, _velocity(decode(Twist, message.payload)))
        elif topic in goals:
            statuses = decode(GoalStatusArray, message.payload).status_list
            yield ToldGoals(time, goals[topic], {one.goal_info.goal_id.uuid: GoalState(one.status) for one in statuses})


def _velocity(twist: Twist) -> tuple[float, float]:
    return twist.linear.x, twist.angular.z


def _bases(plan: Plan) -> Iterator[Base]:
    """Yield the bases that declare how they brake."""
    for one in plan.instances:
        for drives in declared(one.type, one.config, Drives):
            timeout, straight, turning = drives.stops_after, drives.acceleration, drives.turn_acceleration
            if timeout and straight and turning and drives.odometry:
                command, motion = one.topic(drives.commands), one.topic(drives.odometry)
                cycle = 1.0 / component_type(one.type).rate_of(one.config)
                yield Base(command, motion, one.process, timeout.value, cycle, (straight.value, turning.value))


def _is_judged(config: MuxConfig) -> bool:
    """Return whether the laws are those of this mux; one with a hand-over sends what no input has sent."""
    is_plain = config.profile == "default" and config.handover is None
    return is_plain and registry.message(config.message) is Twist


def _switch(instance: Instance) -> Switch:
    config = instance.config
    assert isinstance(config, MuxConfig)  # noqa: S101
    inputs = {
        instance.topic(name): SwitchInput(one.priority, math.inf if one.timeout is None else one.timeout)
        for name, one in config.inputs.items()
    }
    return Switch(instance.topic("output"), instance.process, inputs)


def _claims(plan: Plan) -> Iterator[tuple[str, ActionClaim]]:
    """Yield each action whose goals claim a part of the robot, by its full name."""
    for one in plan.instances:
        for name, port in component_type(one.type).ports(one.config).items():
            if isinstance(port, ServesAction) and port.claims:
                yield one.topic(name), ActionClaim(port.claims, one.process)
