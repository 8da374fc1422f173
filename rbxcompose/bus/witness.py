"""What a witness of a process learns about its services: each request that is sent and each reply that is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rbxcompose.msgs.types import Message, Service


@dataclass(frozen=True, slots=True)
class WitnessedCall:
    """A request, or the reply to one, as it leaves `node`."""

    node: str  # the client's for a request, the server's for a reply
    name: str  # of the service, with its leading slash
    service: type[Service[Any, Any]]
    client: bytes  # GID
    sequence: int  # of the request among those of its client
    is_reply: bool
    message: Message | None  # None: a reply without a response, since the request was refused or failed


Witness = Callable[[WitnessedCall], None]
