"""The transport over Zenoh. Its callbacks run in Zenoh's own threads, where a slow one would hold up all others."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import zenoh
from zenoh import ext
from zenoh.handlers import Callback, RingChannel

from rbxcompose.bus.local import Post
from rbxcompose.bus.transport import EXPIRED, Arrival, Closable, OnReply, Question, RemotePublisher, TransportReply
from rbxcompose.bus.wire import SERVICE_SENDING, Sending, sending
from rbxcompose.sdk.ports import Qos

_attach = ctypes.pythonapi.PyGILState_Ensure


class _Attached(threading.local):
    is_kept = False


_attached = _Attached()


def keep_attached() -> None:
    """Keep Python's state for the calling thread, which Python did not create."""
    if not _attached.is_kept:
        _attached.is_kept = True  # part of that state, and lost with it
        _attach()  # never released, so that the state's reference count does not reach zero


HEARTBEAT = 0.5  # [s] after a latched message until its sequence number is repeated
ZENOH_EXPIRED = "Timeout"  # Zenoh's answer in place of a server's
GONE = "the server is gone"
REFUSED = "refused: "  # before the reason in the encoding of a reply, which others may use as they like

OnOwn = Callable[[Callable[[], None]], None]


class LendsTurns(Protocol):
    """Lets threads that bring messages run components while the scheduler's own thread rests."""

    def bring(self, owner: str, callback: Callable[[], None], /) -> None:
        """Run `callback` for `owner`, in the calling thread if it gets the turn."""
        ...

    def on_own(self, callback: Callable[[], None], /) -> None:
        """Run `callback` at once or, within a lent turn, in the scheduler's own thread afterwards."""
        ...


class ZenohTransport:
    """Everything that one process declares on its session.

    In Zenoh's threads, nothing may be declared or withdrawn, and nothing sent that waits for a congested link: two
    processes whose receiving threads wait for each other would wait for ever. Within a lent turn, that is left to the
    scheduler's own thread.
    """

    def __init__(self, session: zenoh.Session, wake: Post, turns: LendsTurns | None = None) -> None:
        """Without `turns`, none are lent."""
        self.session = str(session.zid())
        self._session, self._wake = session, wake
        self._bring = wake if turns is None else turns.bring
        self._on_own = _at_once if turns is None else turns.on_own
        self._declared: dict[_Declared, None] = {}  # an ordered set

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        """Let the scheduler run `callback` for `owner`."""
        self._wake(owner, callback)

    def bring(self, owner: str, callback: Callable[[], None]) -> None:
        """Do the same, at once and in the calling thread if the scheduler rests."""
        self._bring(owner, callback)

    def publisher(self, key: str, qos: Qos) -> RemotePublisher:
        """Declare a publisher; a latched one keeps its last message for late subscribers."""
        options = _options(sending(qos))
        if qos is not Qos.LATCHED:
            declare = partial(self._session.declare_publisher, key, **options)
            return _Publisher(self._declared, declare, self._on_own, blocks=sending(qos).blocks)
        declare_latched = partial(
            ext.declare_advanced_publisher,
            self._session,
            key,
            cache=ext.CacheConfig(1),
            publisher_detection=True,
            sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=HEARTBEAT),
            **options,
        )
        return _LatchedPublisher(self._declared, declare_latched, self._on_own)

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> Closable:
        """Receive what other processes publish; if latched, also what they published last."""
        handler = direct(lambda sample: arrived(_Arrival(sample)))
        if qos is not Qos.LATCHED:
            return self._keep(self._session.declare_subscriber, key, handler, allowed_origin=zenoh.Locality.REMOTE)
        return self._keep(
            ext.declare_advanced_subscriber,
            self._session,
            key,
            handler,
            allowed_origin=zenoh.Locality.REMOTE,
            history=ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
            recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )

    def serve(self, key: str, asked: Callable[[Question], None]) -> Closable:
        """Receive the requests of other processes."""
        handler = direct(lambda query: asked(_Question(key, query, self._on_own)))
        remote = zenoh.Locality.REMOTE
        return self._keep(self._session.declare_queryable, key, handler, complete=True, allowed_origin=remote)

    def ask(
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
    ) -> Closable:
        """Send a request. It ends with an answer, or with an error when the server is gone; closing forgets it."""
        token = zenoh.CancellationToken()
        # The query ends with `drop`: after an answer, that means nothing; without one, the server is gone.
        handler = direct(lambda reply: answered(_answer(reply)), lambda: answered(TransportReply(error=GONE)))
        get: Callable[[], Any] = partial(
            self._session.get,
            key,
            handler,
            payload=payload,
            attachment=attachment,
            target=zenoh.QueryTarget.ALL_COMPLETE if of_all else zenoh.QueryTarget.BEST_MATCHING,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=within,  # Zenoh keeps some 800 B of each query until then, even if it was answered
            cancellation_token=token,
            **_options(SERVICE_SENDING, "reliability"),
        )
        self._on_own(get)
        return _Asked(token, self._on_own)

    def announce(self, token: str) -> Closable:
        """Show a token until it is closed or this process ends."""
        return self._keep(self._session.liveliness().declare_token, token)

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> Closable:
        """Report matching tokens: those that exist now or appear (True), and those that go (False)."""
        handler = direct(lambda sample: changed(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT))
        return self._keep(self._session.liveliness().declare_subscriber, pattern, handler, history=True)

    def close(self) -> None:
        """Withdraw everything and close the session, which would hang if a latched subscription were left."""
        for declared in reversed(list(self._declared)):
            declared.close()
        self._session.close()  # type: ignore[no-untyped-call]

    def _keep(self, declare: Callable[..., _Entity], *words: Any, **options: Any) -> Closable:
        return _Declared(self._declared, partial(declare, *words, **options), self._on_own)


class _Entity(Protocol):
    def undeclare(self) -> Any: ...


class _Declared:
    """Something that lives on the session until it is closed."""

    def __init__(self, declared: dict[_Declared, None], declare: Callable[[], Any], on_own: OnOwn) -> None:
        self._declared, self._on_own = declared, on_own
        self._entity: Any = None  # until the scheduler's own thread has declared it
        declared[self] = None
        on_own(partial(self._declare, declare))

    def close(self) -> None:
        if self in self._declared:
            del self._declared[self]
            self._on_own(self._withdraw)

    def _declare(self, declare: Callable[[], _Entity]) -> None:
        if self in self._declared:
            self._entity = declare()

    def _withdraw(self) -> None:
        if self._entity is not None:
            self._entity.undeclare()


class _Sender(_Declared):
    def _put(self, payload: bytes, attachment: bytes) -> None:
        if self in self._declared:
            self._entity.put(payload, attachment=attachment)


class _Publisher(_Sender):
    def __init__(
        self, declared: dict[_Declared, None], declare: Callable[[], Any], on_own: OnOwn, *, blocks: bool
    ) -> None:
        self._matches = False
        self._statuses: Any = None
        self._blocks = blocks
        super().__init__(declared, declare, on_own)

    @property
    def has_match(self) -> bool:
        statuses = self._statuses
        if statuses is not None and (status := statuses.try_recv()) is not None:
            self._matches = status.matching
        return self._matches

    def put(self, payload: bytes, attachment: bytes) -> None:
        if self._blocks or self._entity is None:
            self._on_own(partial(self._put, payload, attachment))
        else:
            self._entity.put(payload, attachment=attachment)

    def _declare(self, declare: Callable[[], Any]) -> None:
        super()._declare(declare)
        if (publisher := self._entity) is None:
            return
        # A listener, since querying the status costs as much as sending; without a callback, since Zenoh runs one where
        # it ends tasks, which may be awaited by who holds Python's lock. It reports only changes; and contrary to its
        # type stub, the status is an object, which is always true.
        self._statuses = publisher.declare_matching_listener(RingChannel(1))
        status: Any = publisher.matching_status
        self._matches = status.matching

    def _withdraw(self) -> None:
        self._statuses, self._matches = None, False
        super()._withdraw()


class _LatchedPublisher(_Sender):
    has_match = True  # if nobody now, then somebody later

    def put(self, payload: bytes, attachment: bytes) -> None:
        self._on_own(partial(self._put, payload, attachment))


class _Arrival:
    """A sample; its bytes are copied only on access."""

    __slots__ = ("_sample",)

    def __init__(self, sample: zenoh.Sample | zenoh.Query) -> None:
        self._sample = sample

    @property
    def payload(self) -> bytes:
        payload = self._sample.payload
        return payload.to_bytes() if payload is not None else b""

    @property
    def attachment(self) -> bytes:
        attachment = self._sample.attachment
        return attachment.to_bytes() if attachment is not None else b""


class _Question(_Arrival):
    __slots__ = ("_key", "_on_own", "_query")

    def __init__(self, key: str, query: zenoh.Query, on_own: OnOwn) -> None:
        super().__init__(query)
        self._key, self._query, self._on_own = key, query, on_own

    def reply(self, payload: bytes, attachment: bytes, reason: str = "") -> None:
        # The type of ROS has no room for the reason of a refusal, and clients of ROS ignore the encoding.
        encoding = zenoh.Encoding.ZENOH_BYTES.with_schema(_cut(REFUSED + reason)) if reason else None
        self._on_own(
            lambda: self._end(lambda query: query.reply(self._key, payload, encoding=encoding, attachment=attachment))
        )

    def fail(self, error: str) -> None:
        self._on_own(lambda: self._end(lambda query: query.reply_err(error)))

    def _end(self, how: Callable[[zenoh.Query], None]) -> None:
        with self._query as query:  # leaving the block ends the query for the client
            how(query)


class _Asked:
    def __init__(self, token: zenoh.CancellationToken, on_own: OnOwn) -> None:
        self._token, self._on_own = token, on_own

    def close(self) -> None:
        self._on_own(self._token.cancel)


def _answer(reply: zenoh.Reply) -> TransportReply:
    if reply.ok is not None:
        return TransportReply(reply.ok.payload.to_bytes(), reason=str(reply.ok.encoding).partition(f";{REFUSED}")[2])
    error = reply.err.payload.to_string() if reply.err is not None else GONE
    return TransportReply(error=EXPIRED if error == ZENOH_EXPIRED else error)


def _cut(reason: str) -> str:
    """Return what fits into an encoding of Zenoh, whose schema has at most 255 bytes."""
    return reason.encode()[:250].decode(errors="ignore")


def _at_once(callback: Callable[[], None]) -> None:
    callback()


def direct(callback: Callable[[Any], None], drop: Callable[[], None] | None = None) -> Callback[Any]:
    """Return what calls `callback` in Zenoh's thread, and `drop` at the end; no channel between could be full."""

    def called(value: Any) -> None:
        keep_attached()
        callback(value)

    return Callback(called, drop, indirect=False)


def _options(how: Sending, *without: str) -> dict[str, Any]:
    options = {
        "priority": getattr(zenoh.Priority, how.priority),
        "express": how.is_express,
        "congestion_control": zenoh.CongestionControl.BLOCK if how.blocks else zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if how.is_reliable else zenoh.Reliability.BEST_EFFORT,
        "allowed_destination": zenoh.Locality.REMOTE,
    }
    return {name: value for name, value in options.items() if name not in without}
