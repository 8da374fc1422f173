"""What components have told the supervisor to keep for them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from rbxcompose.plan.model import Instance
from rbxcompose.robot_events import ComponentNoted
from rbxcompose.runtime.channel import Repeated


class KeptWords:
    """By component: requests that it gets again after its process was restarted, and notes for people."""

    def __init__(self) -> None:
        self.notes: dict[str, str] = {}
        self._requests: dict[str, list[dict[str, Any]]] = {}

    def heard(self, message: Repeated | ComponentNoted) -> None:
        """Keep this instead of what the component told before."""
        if isinstance(message, Repeated):
            self._requests[message.instance] = message.requests
        else:
            self.notes[message.component] = message.text

    def repeated(self, instances: Iterable[Instance]) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield the requests for components, each with the name of its component."""
        for one in instances:
            yield from ((one.name, request) for request in self._requests.get(one.name, ()))
