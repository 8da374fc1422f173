"""`service call`."""

from __future__ import annotations

import argparse
from typing import Any

from rbxcompose.cli.bus.entities import NOBODY, SAID_NO, wanted
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.messages import message_from, shown, type_of
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.msgs import registry
from rbxcompose.msgs.plain import to_plain
from rbxcompose.sdk.bound import Reply


def call(guest: Guest, arguments: argparse.Namespace) -> int:
    """Send a request and print the response."""
    found = wanted([one for one in guest.graph().services if one.givers], arguments.name, "service")
    kind = found.kinds[0]
    service = type_of(kind, "srv", registry.service)
    request = message_from(service.Request, arguments.content)
    if request is None:
        return 1
    client = guest.bus(kind).client(NAME, found.name, service)
    if not guest.run(lambda: client.is_available, arguments.timeout):
        return refuse(NOBODY.at(None, f"the server of '{found.name}' cannot be reached"))
    replies: list[Reply[Any]] = []
    client(request, replies.append, timeout=arguments.timeout)
    guest.run(lambda: bool(replies))
    if replies[0].response is None:
        return refuse(SAID_NO.at(None, f"'{found.name}': {replies[0].error}"))
    tell(shown(to_plain(replies[0].response), arguments.json))
    return 0
