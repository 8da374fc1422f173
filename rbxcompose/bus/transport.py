"""The interface of a transport between processes, and the transport that reaches no other process.

A transport calls its callbacks in its own threads: they may only put items into an inbox, or bring them in.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from rbxcompose.base.dataclass import dataclass
from rbxcompose.sdk.ports import Qos

LONGEST_WAIT = 600.0  # [s] of real time for an answer; the transport keeps a little of each request that long
EXPIRED = "no answer in time"


class Closable(Protocol):
    """Something that was declared and can be withdrawn."""

    def close(self) -> None:
        """Withdraw it; a second call does nothing."""
        ...


class Arrival(Protocol):
    """Bytes from another process."""

    @property
    def payload(self) -> bytes:
        """Return the encoded message."""
        ...

    @property
    def attachment(self) -> bytes:
        """Return the encoded attachment, empty if there was none."""
        ...


class Question(Arrival, Protocol):
    """A request from another process, to be answered once, now or later."""

    def reply(self, payload: bytes, attachment: bytes, reason: str = "") -> None:
        """Answer the request; the `reason` why it is refused, if it is, reaches clients of ours only."""
        ...

    def fail(self, error: str) -> None:
        """Report that there will be no answer, and why."""
        ...


@dataclass(frozen=True, slots=True)
class TransportReply:
    """The outcome of a request: a payload, perhaps with the reason of a refusal, or an error."""

    payload: bytes = b""
    error: str = ""
    reason: str = ""


OnReply: TypeAlias = Callable[[TransportReply], None]


class RemotePublisher(Closable, Protocol):
    """Sends to the subscribers in other processes."""

    @property
    def has_match(self) -> bool:
        """Return whether anybody would receive it, now or (if latched) later."""
        ...

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Send one message."""
        ...


class Transport(Protocol):
    """Carries messages between processes. All but `wake` and `bring` is called only by whoever runs the scheduler."""

    session: str  # identifies this process among all

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        """Let the scheduler run `callback` for `owner`; any thread may call this."""
        ...

    def bring(self, owner: str, callback: Callable[[], None]) -> None:
        """Do the same, at once and in the calling thread if the scheduler rests; any thread may call this."""
        ...

    def publisher(self, key: str, qos: Qos) -> RemotePublisher:
        """Declare a publisher; a latched one keeps its last message for late subscribers."""
        ...

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> Closable:
        """Receive what other processes publish; if latched, also what they published last."""
        ...

    def serve(self, key: str, asked: Callable[[Question], None]) -> Closable:
        """Receive the requests of other processes."""
        ...

    def ask(
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
    ) -> Closable:
        """Send a request. It ends with an answer, or with an error when the server is gone; closing forgets it.

        The nearest server receives it, or `of_all` all of them. After `within` [s] of real time it is `EXPIRED`.
        """
        ...

    def announce(self, token: str) -> Closable:
        """Show a token until it is closed or this process ends."""
        ...

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> Closable:
        """Report matching tokens: those that exist now or appear (True), and those that go (False)."""
        ...

    def close(self) -> None:
        """Withdraw everything and leave."""
        ...


class NoTransport:
    """The transport of a lone process: it reaches no other, and no other reaches it."""

    session = "0"
    has_match = False

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        """Refuse: without other processes nothing arrives."""
        raise RuntimeError(f"something arrived for '{owner}' from nowhere")

    bring = wake

    def publisher(self, key: str, qos: Qos) -> NoTransport:
        """Declare a publisher without subscribers."""
        return self

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> NoTransport:
        """Receive nothing."""
        return self

    def serve(self, key: str, asked: Callable[[Question], None]) -> NoTransport:
        """Receive no requests."""
        return self

    def ask(
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
    ) -> NoTransport:
        """Refuse: no token of a server was ever seen."""
        raise RuntimeError(f"no server of {key} can be reached")

    def announce(self, token: str) -> NoTransport:
        """Show a token to no process."""
        return self

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> NoTransport:
        """See no tokens."""
        return self

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Send to no process."""

    def close(self) -> None:
        """Withdraw nothing."""
