"""The nodes on a bus that have parameters, ours and those of ROS 2, and requests to many of them at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from rbxcompose.bus.graph import GraphName
from rbxcompose.bus.services import Client
from rbxcompose.cli.bus.entities import NO_NAME, NOBODY, SAID_NO
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.messages import type_of
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.msgs import registry
from rbxcompose.msgs.types import Message, Service
from rbxcompose.sdk.bound import Reply

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

_GET = "/get_parameters"


class ParameterNodes:
    """The nodes on the bus that have parameters, by their `names`; `guest` is how they are reached."""

    def __init__(self, guest: Guest, timeout: float) -> None:
        """An answer may take `timeout` [s]."""
        self.guest, self._timeout = guest, timeout
        self._services: Mapping[str, GraphName] = {one.name: one for one in guest.graph().services if one.givers}
        self.names = sorted(name.removesuffix(_GET) for name in self._services if name.endswith(_GET))

    def find(self, wanted: str) -> str:
        """Return the full name of a node.

        Raises:
            NotDoneError: if no node of that name has parameters.
        """
        full = wanted if wanted.startswith("/") else f"/{wanted}"
        near = [name for name in self.names if name.endswith(full)]
        if full in self.names or len(near) == 1:
            return full if full in self.names else near[0]
        bare = [name.removeprefix("/") for name in self.names]
        words = f"no component '{wanted}' has parameters"
        raise NotDoneError(NO_NAME.misspelt(None, words, wanted.removeprefix("/"), bare, "components"))

    def serves(self, node: str, what: str) -> bool:
        """Return whether a node has a service, such as `set_parameters`."""
        return f"{node}/{what}" in self._services

    def ask(self, nodes: Sequence[str], what: str, service: type[Service[Q, R]], requests: Sequence[Q]) -> list[R]:
        """Request `what` from all `nodes` in parallel, and return their answers.

        Raises:
            NotDoneError: if one of them does not answer.
        """
        guest, replies = self.guest, dict[str, Reply[R]]()
        clients = [self._client(node, what) for node in nodes]
        guest.run(lambda: all(client.is_available for client in clients), self._timeout)
        for node, client, request in zip(nodes, clients, requests, strict=True):
            client(request, lambda reply, node=node: replies.update({node: reply}), timeout=self._timeout)  # type: ignore[misc]
        guest.run(lambda: len(replies) == len(nodes))
        return [_response(node, replies[node]) for node in nodes]

    def _client(self, node: str, what: str) -> Client[Any, Any]:
        found = self._services.get(f"{node}/{what}")
        if found is None:
            raise NotDoneError(NOBODY.at(None, f"'{node}' has no service '{what}'"))
        kind = found.kinds[0]
        return self.guest.bus(kind).client(NAME, found.name, type_of(kind, "srv", registry.service))


def _response(node: str, reply: Reply[R]) -> R:
    if reply.response is None:
        raise NotDoneError(SAID_NO.at(None, f"'{node}': {reply.error}"))
    return reply.response
