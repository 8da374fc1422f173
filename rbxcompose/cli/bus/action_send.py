"""`action send`."""

from __future__ import annotations

import argparse
from typing import Any

from rbxcompose.cli.bus.entities import NOBODY, SAID_NO, wanted
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.messages import message_from, to_json, to_text, type_of
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.msgs import registry
from rbxcompose.msgs.plain import to_plain
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.bound import Ended, Outcome

_INTERRUPTED = 130


def send(guest: Guest, arguments: argparse.Namespace) -> int:
    """Send a goal and print its feedback and its result."""
    found = wanted([one for one in guest.graph().actions if one.givers], arguments.name, "action")
    action = type_of(found.kinds[0], "action", registry.action, lambda found: found.SendGoal.HASH)
    goal = message_from(action.Goal, arguments.content)
    if goal is None:
        return 1
    client = guest.bus(found.kinds[0]).action_client(NAME, found.name, action)
    if not guest.run(lambda: client.is_available, arguments.timeout):
        return refuse(NOBODY.at(None, f"the server of '{found.name}' cannot be reached"))
    ends: list[Ended[Any]] = []
    sent = client(goal, ends.append, lambda feedback: _tell("feedback", feedback, arguments.json))
    with guest.interruptible(sent.cancel):
        guest.run(lambda: bool(ends))
    return _end(ends[0], found.name, guest.is_interrupted, arguments.json)


def _end(ended: Ended[Any], name: str, is_interrupted: bool, as_json: bool) -> int:
    if ended.result is not None:
        _tell("result", ended.result, as_json)
    if is_interrupted:
        return _INTERRUPTED
    if ended.outcome is Outcome.SUCCEEDED:
        return 0
    message = getattr(ended.result, "error_msg", "") or ended.message
    return refuse(SAID_NO.at(None, f"'{name}': {ended.outcome}{message and f', {message}'}"))


def _tell(what: str, message: Message, as_json: bool) -> None:
    data = {what: to_plain(message)}
    tell(to_json(data) if as_json else to_text(data))
