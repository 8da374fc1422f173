"""`topic pub`."""

from __future__ import annotations

import argparse
import math

from rbxcompose.bus.graph import GraphName, WireType, find
from rbxcompose.bus.names import name_problem
from rbxcompose.cli.bus.entities import NO_NAME, NOBODY
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.messages import message_from, message_type, to_json
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import Finding
from rbxcompose.msgs.types import Message
from rbxcompose.qos import Qos


def publish(guest: Guest, arguments: argparse.Namespace) -> int:
    """Publish a message as soon as there is a subscriber, and report how often."""
    message = message_type(arguments.type)
    made = message_from(message, arguments.message)
    if made is None:
        return 1
    name = f"/{arguments.topic.lstrip('/')}"
    if problem := name_problem(name):
        return refuse(NO_NAME.at(None, problem))
    topic = find(guest.graph().topics, name)
    of_type = [kind for kind in (topic.kinds if topic else ()) if kind.type == message.TYPE]
    publisher = guest.bus(of_type[0] if of_type else None).publisher(NAME, name, message, Qos.EVENT)
    if not guest.run(lambda: publisher.has_match, arguments.timeout):
        raise NotDoneError(_nobody(topic, name, message, of_type))
    most = arguments.count or (math.inf if arguments.rate else 1)
    sent = 0
    with guest.interruptible():
        while sent < most and not guest.is_interrupted:
            publisher(made)
            sent += 1
            if sent < most:
                guest.run(lambda: guest.is_interrupted, 1 / (arguments.rate or 1.0))
    tell(to_json({"topic": name, "type": message.TYPE, "sent": sent}) if arguments.json else f"{name}: {sent} sent")
    return 0


def _nobody(topic: GraphName | None, name: str, message: type[Message], of_type: list[WireType]) -> Finding:
    if topic is None or not topic.takers:
        return NOBODY.at(None, f"nothing subscribes to '{name}'")
    others = ", ".join(topic.types)
    if not of_type:
        return NOBODY.at(None, f"'{name}' is not of type {message.TYPE}, but {others}")
    return NOBODY.at(None, f"the subscribers of '{name}' have another definition of {message.TYPE}")
