"""A transport whose session can be replaced at run time; everything declared is then declared again."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from rbxcompose.bus.transport import Arrival, Closable, OnReply, Question, RemotePublisher, Transport, TransportReply
from rbxcompose.sdk.ports import Qos

RENEWED = "the session on the bus was opened again"

Declare = Callable[[Transport], Closable]
E = TypeVar("E", bound="_Entry")


class RenewableTransport:
    """Passes everything on to a transport and remembers what has been declared.

    `detach` removes the transport and `attach` sets another. In between, messages to other processes are dropped and
    requests fail. Tokens keep the name of the first session, since it names the process, not the connection.
    """

    def __init__(self, transport: Transport) -> None:
        self.session = transport.session
        self._first = transport  # wakes the scheduler, whichever session is in use
        self._transport: Transport | None = transport
        self._is_closed = False
        self._entries: Entries = {}

    def detach(self) -> Transport:
        """Remove the transport and return it for the caller to close; report all known participants as gone.

        Raises:
            RuntimeError: if there is none.
        """
        transport, self._transport = self._transport, None
        if transport is None:
            raise RuntimeError("there is no transport to detach")
        for entry in list(self._entries):
            entry.detach()
        return transport

    def attach(self, transport: Transport) -> None:
        """Declare everything on another transport, in the original order."""
        if self._is_closed:  # while there was no transport
            transport.close()
            return
        self._transport = transport
        for entry in list(self._entries):
            entry.attach(transport)

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        """Let the scheduler run `callback` for `owner`; any thread may call this."""
        self._first.wake(owner, callback)

    def bring(self, owner: str, callback: Callable[[], None]) -> None:
        """Do the same, at once and in the calling thread if the scheduler rests; any thread may call this."""
        self._first.bring(owner, callback)

    def publisher(self, key: str, qos: Qos) -> RemotePublisher:
        """Declare a publisher; a latched one keeps its last message for late subscribers."""
        return self._keep(_Publisher(self._entries, key, qos))

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> Closable:
        """Receive what other processes publish; if latched, also what they published last."""
        return self._keep(_Entry(self._entries, lambda transport: transport.subscribe(key, qos, arrived)))

    def serve(self, key: str, asked: Callable[[Question], None]) -> Closable:
        """Receive the requests of other processes."""
        return self._keep(_Entry(self._entries, lambda transport: transport.serve(key, asked)))

    def ask(
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
    ) -> Closable:
        """Send a request. It is never sent twice: if its session is replaced, it ends with an error."""

        def declare(transport: Transport) -> Closable:
            return transport.ask(key, payload, attachment, answered, of_all=of_all, within=within)

        request = _Request(self._entries, declare, answered)
        if self._transport is None:
            request.detach()
        return self._keep(request)

    def announce(self, token: str) -> Closable:
        """Show a token until it is closed or this process ends."""
        return self._keep(_Entry(self._entries, lambda transport: transport.announce(token)))

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> Closable:
        """Report which tokens match; when the session goes, all of them go until another session finds them again."""
        return self._keep(_Watch(self._entries, pattern, changed))

    def close(self) -> None:
        """Close the transport and everything declared on it."""
        self._is_closed = True
        self._entries.clear()
        transport, self._transport = self._transport, None
        if transport is not None:
            transport.close()

    def _keep(self, entry: E) -> E:
        if self._transport is not None:
            entry.attach(self._transport)
        return entry


class _Entry:
    """Something that was declared, and how to declare it again."""

    def __init__(self, entries: Entries, declare: Declare) -> None:
        self._entries, self._declare = entries, declare
        self._current: Closable | None = None
        entries[self] = None

    def attach(self, transport: Transport) -> None:
        self._current = self._declare(transport)

    def detach(self) -> None:
        self._current = None  # whoever took the transport closes it with all that is on it

    def close(self) -> None:
        self._entries.pop(self, None)
        current, self._current = self._current, None
        if current is not None:
            current.close()


Entries = dict[_Entry, None]  # an ordered set: a server is declared before the token that shows it


class _Publisher(_Entry):
    def __init__(self, entries: Entries, key: str, qos: Qos) -> None:
        super().__init__(entries, self._publish)
        self._key, self._qos = key, qos
        self._remote: RemotePublisher | None = None
        self._last: tuple[bytes, bytes] | None = None  # of a latched topic: payload and attachment

    @property
    def has_match(self) -> bool:
        return self._qos is Qos.LATCHED or (self._remote is not None and self._remote.has_match)

    def put(self, payload: bytes, attachment: bytes) -> None:
        if self._qos is Qos.LATCHED:
            self._last = payload, attachment
        if self._remote is not None:
            self._remote.put(payload, attachment)

    def detach(self) -> None:
        super().detach()
        self._remote = None

    def close(self) -> None:
        super().close()
        self._remote = None

    def _publish(self, transport: Transport) -> Closable:
        self._remote = transport.publisher(self._key, self._qos)
        if self._last is not None:
            self._remote.put(*self._last)
        return self._remote


class _Request(_Entry):
    def __init__(self, entries: Entries, declare: Declare, answered: OnReply) -> None:
        super().__init__(entries, declare)
        self._answered = answered

    def detach(self) -> None:
        super().detach()
        self._entries.pop(self, None)  # it may have been carried out: whether to repeat it is the caller's decision
        self._answered(TransportReply(error=RENEWED))


class _Watch(_Entry):
    def __init__(self, entries: Entries, pattern: str, changed: Callable[[str, bool], None]) -> None:
        super().__init__(entries, self._watch)
        self._pattern, self._changed = pattern, changed
        self._known: set[str] = set()  # tokens that this session knows to exist

    def detach(self) -> None:
        super().detach()
        gone, self._known = self._known, set()
        for token in sorted(gone):
            self._changed(token, False)

    def _watch(self, transport: Transport) -> Closable:
        known = self._known = set()

        def take(token: str, is_there: bool) -> None:  # in a thread of the transport
            if known is not self._known:
                return  # a late update of a session that was replaced
            if is_there:
                known.add(token)
            else:
                known.discard(token)
            self._changed(token, is_there)

        return transport.watch(self._pattern, take)
