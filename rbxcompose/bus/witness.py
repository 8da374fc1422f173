"""What a witness learns about the services of a process: each request sent and each reply given."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rbxcompose.dataclass import dataclass
from rbxcompose.msgs.types import Message, Service


@dataclass(frozen=True, slots=True)
class WitnessedCall:
    """A request, or the reply to one, as it leaves `node`."""

    node: str  # the client's for a request, the server's for a reply
    name: str  # of the service, with its leading slash
    service: type[Service[Any, Any]]
    client: bytes  # GID
    sequence: int  # of the request among those of its client; a reply has the same
    is_reply: bool
    message: Message | None  # None: a reply without a response, since the request was refused or failed


Witness = Callable[[WitnessedCall], None]
