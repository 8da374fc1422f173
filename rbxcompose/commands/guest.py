"""A visitor on a bus: a session for the duration of one command, with a loop of its own; and what it lists there."""

from __future__ import annotations

import argparse
import json
import math
import selectors
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any, Self

import zenoh
from zenoh.handlers import Callback

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.graph import Graph, GraphEnd, GraphName, WireType, find
from rbxcompose.bus.local import Inbox
from rbxcompose.bus.names import Attachment, data_key, decode_attachment
from rbxcompose.bus.tokens import SPACE, EntityKind, NodeToken, parse_token
from rbxcompose.bus.transport import Arrival
from rbxcompose.bus.zenoh_session import open_client, open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport, direct
from rbxcompose.commands import options
from rbxcompose.commands.console import ENDINGS, NotDoneError, emit, handling, table
from rbxcompose.commands.lookup import BusPlace, add_bus_options, find_place
from rbxcompose.runtime.process_group.connection import CallbackInbox
from rbxcompose.sdk.ports import Qos

if TYPE_CHECKING:
    from rbxcompose.bus.bus import Bus

NAME = "_rbxcompose"  # node name; tools do not list names that begin with `_`
LONGEST_QUEUE = 1000  # messages waiting to be shown
PATIENCE = 2.0  # [s] to wait for an answer of the router
_EACH = zenoh.ConsolidationMode.NONE
_PAUSE = 0.01  # [s] between two looks for the router
NO_HASHES = "TypeHashNotSupported"  # ROS 2 Humble writes this in place of a hash
NO_ROUTER = kind("RBX9020")
NO_NAME = kind("RBX9022")
NOBODY = kind("RBX9025")
SAID_NO = kind("RBX9026")
SILENT = kind("RBX9053", Severity.WARNING)


@dataclass(frozen=True, slots=True)
class ReceivedMessage:
    """A message as it arrived: its time [s of the guest's clock], its type, and its bytes."""

    time: float
    kind: WireType
    arrival: Arrival

    @property
    def sender(self) -> bytes:
        """Return the GID of the sender, or nothing if the message has none."""
        return self._attachment.gid

    @property
    def stamp(self) -> int:
        """Return the time of sending by the sender's clock [ns], or 0 if the message has none."""
        return self._attachment.stamp

    @property
    def _attachment(self) -> Attachment:
        try:
            return decode_attachment(self.arrival.attachment)
        except ValueError:
            return Attachment(0, 0, b"")


class Guest:
    """Lists who is on the bus, listens, and provides a `Bus` for sending."""

    def __init__(self, place: BusPlace, *, stays: bool = False) -> None:
        """Join the bus: briefly through its router, or to stay, with direct links to all others.

        A guest that stays loses nothing when the router is restarted.

        Raises:
            NotDoneError: if no router answers.
        """
        self.clock = MonotonicClock()
        self._session = self._lasting(place.router) if stays else _short(place.router)
        self.domain, self.scheduler = place.domain, Scheduler()
        self.is_interrupted = False
        self._inbox = CallbackInbox()
        self.transport = ZenohTransport(self._session, self._inbox.put)
        self._bus: Bus | None = None
        self._queues: list[Inbox[ReceivedMessage]] = []
        self._selector = selectors.SelectSelector()  # unlike other selectors, it can wait for less than a millisecond
        self._selector.register(self._inbox, selectors.EVENT_READ, lambda: None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        (self._bus or self.transport).close()
        self._selector.close()
        self._inbox.close()

    def graph(self) -> Graph:
        """Return the graph of all participants at this moment."""
        return Graph.of(self.tokens(f"{SPACE}/{self.domain}/**"))

    def tokens(self, pattern: str) -> list[str]:
        """Return the liveliness tokens that a key expression matches."""
        get = partial(self._session.liveliness().get, timeout=PATIENCE)
        return [str(sample.key_expr) for sample in _gathered(lambda into: get(pattern, into), PATIENCE)]

    def ask(self, key: str, seconds: float) -> list[bytes]:
        """Return all answers to a query at a key within `seconds`."""
        get = partial(self._session.get, target=zenoh.QueryTarget.ALL, consolidation=_EACH, timeout=seconds)
        return [sample.payload.to_bytes() for sample in _gathered(lambda into: get(key, into), seconds)]

    def is_linked(self, session: str, seconds: float) -> bool | None:
        """Return whether a session is linked with those of all components; None if its admin space does not answer."""
        tokens = map(parse_token, self.tokens(f"{SPACE}/{self.domain}/*/*/*/{EntityKind.NODE}/**"))
        nodes = (token for token in tokens if isinstance(token, NodeToken) and not token.name.startswith("_"))
        peers = {node.session for node in nodes} - {session}
        for answer in self.ask(f"@/{session}/peer", seconds):
            linked = {link["peer"] for link in json.loads(answer)["sessions"]}
            return peers <= linked
        return None

    def bus(self, kind: WireType | None = None) -> Bus:
        """Return the bus for sending, in the wire profile of those who use this `kind`; the same one each time."""
        from rbxcompose.bus.bus import Bus  # this import takes as long as all else that a list needs

        if self._bus is None:
            wire = "humble" if kind is not None and kind.hash == NO_HASHES else "jazzy"
            self._bus = Bus(
                self.scheduler, self.clock, domain=self.domain, wire=wire, transport=self.transport, log=_complain
            )
        return self._bus

    def listen(self, topic: GraphName, receive: Callable[[ReceivedMessage], None]) -> None:
        """Pass each message of a topic to `receive`, undecoded; if latched, also messages sent before."""
        is_latched = any(end.qos is not None and end.qos.is_transient_local for end in topic.givers)
        queue: Inbox[ReceivedMessage] = Inbox(NAME, LONGEST_QUEUE, receive, self.scheduler.post)
        self._queues.append(queue)
        for wire_type in topic.kinds:
            if wire_type.type.count("/") == 2:
                key = data_key(self.domain, topic.name, wire_type.type, wire_type.hash)
                self.transport.subscribe(key, Qos.LATCHED if is_latched else Qos.EVENT, self._arrived(queue, wire_type))

    @property
    def dropped(self) -> int:
        """Return how many messages came too fast to be passed on."""
        return sum(queue.dropped for queue in self._queues)

    def watch(self, descriptor: int, ready: Callable[[], None]) -> None:
        """Call `ready` when there is something to read."""
        self._selector.register(descriptor, selectors.EVENT_READ, ready)

    def run(self, until: Callable[[], bool], timeout: float = math.inf) -> bool:
        """Run the loop until `until` holds or `timeout` [s] has passed; return whether it holds."""
        deadline = self.clock.now() + timeout
        while True:
            self.scheduler.advance(self.clock.now())
            if until():
                return True
            now, due = self.clock.now(), self.scheduler.next_due()
            if now >= deadline:
                return False
            pause = min(deadline, math.inf if due is None else due) - now
            for key, _ in self._selector.select(None if pause == math.inf else max(0.0, pause)):
                key.data()
            self._inbox.drain(self.scheduler)

    def fileno(self) -> int:
        """Return the descriptor that is readable when something has arrived, for a loop of somebody else."""
        return self._inbox.fileno()

    def pump(self) -> float | None:
        """Run what has arrived or is due, in such a loop; return when to do so again [s], None if nothing is due."""
        self._inbox.drain(self.scheduler)
        self.scheduler.advance(self.clock.now())
        return self.scheduler.next_due()

    @contextmanager
    def interruptible(self, interrupted: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Let an interrupt, or the end of the terminal, call `interrupted` in the loop instead of ending the process.

        A second one ends the process.
        """
        before = {number: signal.getsignal(number) for number in ENDINGS}

        def note(number: int, frame: FrameType | None) -> None:
            self.is_interrupted = True
            for each, handler in before.items():  # whichever of them the second one is
                signal.signal(each, handler)
            self._inbox.put(NAME, interrupted)

        with handling(note):
            yield

    def _lasting(self, router: str) -> zenoh.Session:
        try:
            session = open_peer(router)
        except zenoh.ZError as error:  # a router that is not there yet is no error
            raise NotDoneError(NO_ROUTER.at(None, f"'{router}' is not a router endpoint")) from error
        deadline = self.clock.now() + PATIENCE
        while not session.info.routers_zid():
            if self.clock.now() > deadline:
                session.close()  # type: ignore[no-untyped-call]
                raise NotDoneError(NO_ROUTER.at(None, f"no router answers at {router}"))
            time.sleep(_PAUSE)
        return session

    def _arrived(self, queue: Inbox[ReceivedMessage], kind: WireType) -> Callable[[Arrival], None]:
        # In a thread of the transport: a message is stamped when it arrives, not when it is shown.
        return lambda arrival: queue.put(ReceivedMessage(self.clock.now(), kind, arrival), self.transport.wake)


def _gathered(ask: Callable[[Callback[zenoh.Reply]], object], within: float) -> list[zenoh.Sample]:
    """Return the good replies to a query.

    They are not read from a channel: it may be full while the query is being sent, which Zenoh then never ends.
    """
    replies, ended = list[zenoh.Reply](), threading.Event()
    ask(direct(replies.append, ended.set))
    ended.wait(within + PATIENCE)  # Zenoh ends it when all have answered, or after its timeout
    return [reply.ok for reply in replies if reply.ok is not None]


def _short(router: str) -> zenoh.Session:
    try:
        return open_client(router)
    except OSError as error:
        raise NotDoneError(NO_ROUTER.at(None, error.strerror or str(error))) from error


def _complain(owner: str, text: str) -> None:
    sys.stderr.write(f"{text}\n")


def visit(arguments: argparse.Namespace, do: Callable[[Guest], int]) -> int:
    """Join the chosen bus, run `do` there, and return the exit code."""
    with Guest(find_place(arguments)) as guest:
        return do(guest)


def visit_for_action(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand on the chosen bus, and return the exit code."""
    return visit(arguments, lambda guest: options.run_action(arguments, guest))


def wanted(names: Sequence[GraphName], name: str, what: str) -> GraphName:
    """Return the topic, service or action of that name.

    Raises:
        NotDoneError: if there is none.
    """
    found = find(names, name)
    if found is None:
        words = f"there is no {what} '{name}'"
        raise NotDoneError(NO_NAME.misspelt(None, words, name, [graph_name.name for graph_name in names], f"{what}s"))
    return found


def silence(name: str) -> Finding:
    """Return the warning that no message of a topic, or of those of a pattern, has come though there is a publisher."""
    help_text = "of a publisher on another host, 'security: mtls' lets pass only what a component here subscribes to"
    return SILENT.at(None, f"'{plain(name, 60)}' has a publisher, but no message of it has come", help=help_text)


def write_names(names: Sequence[GraphName], ends: tuple[str, str], arguments: argparse.Namespace) -> int:
    """List names with their types and the counts of both `ends`; hidden names only with `--all`."""
    listed = [name for name in names if arguments.all or not name.is_hidden]
    if arguments.json:
        emit(json.dumps([_counted(name, ends) for name in listed]))
        return 0
    rows = [("name", "type", *ends, "")]
    for name in listed:
        clash = name.clash and f"! {name.clash}"
        rows.append((name.name, ", ".join(name.types), str(len(name.givers)), str(len(name.takers)), clash))
    emit(table(rows))
    return 0


def described(graph_name: GraphName, ends: tuple[str, str]) -> dict[str, Any]:
    """Return all that is known about a name, for JSON."""
    return {
        "name": graph_name.name,
        "types": graph_name.types,
        "clash": graph_name.clash,
        ends[0]: [_end(end) for end in graph_name.givers],
        ends[1]: [_end(end) for end in graph_name.takers],
    }


def add_server_verbs(
    parser: argparse.ArgumentParser, noun: str, verb: tuple[str, str], content: str, example: str
) -> None:
    """Declare the subcommands of services or actions: `ls`, and a `verb` with its help, which sends a `content`."""

    def list_all(guest: Guest, arguments: argparse.Namespace) -> int:
        return write_names(getattr(guest.graph(), f"{noun}s"), ("servers", "clients"), arguments)

    named = options.argument("name", metavar=noun.upper(), help=f"its name, such as {example}")
    words = "YAML; missing fields are zero"
    written = options.argument("content", metavar=content.upper(), nargs="?", default="", help=words)
    sent = (named, written, partial(options.add_timeout_option, default="5s"), options.add_json_option)
    actions = (
        options.Subcommand("ls", f"list the {noun}s with their types", list_all, (options.add_ls_options,)),
        options.Subcommand(*verb, options.deferred("rbxcompose.commands.messages", verb[0]), sent),
    )
    options.add_actions(parser, actions, add_bus_options, options.add_system_options)


def _counted(graph_name: GraphName, ends: tuple[str, str]) -> dict[str, Any]:
    counts = {ends[0]: len(graph_name.givers), ends[1]: len(graph_name.takers)}
    return {"name": graph_name.name, "types": graph_name.types, "clash": graph_name.clash, **counts}


def _end(end: GraphEnd) -> dict[str, Any]:
    qos = None if end.qos is None else asdict(end.qos)
    return {"node": end.node, "type": end.kind.type, "hash": end.kind.hash, "gid": end.gid.hex(), "qos": qos}
