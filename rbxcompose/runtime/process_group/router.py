"""The router of a robot, and the line to the routers of its other hosts."""

import json
import os
import signal
import socket
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Thread
from types import FrameType
from typing import TypeVar

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import kind
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import UnreadableError, from_data, to_data
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.access_control import AllowedHost, access_control
from rbxcompose.bus.endpoints import LOOPBACK, accepts, tcp_endpoint, unix_endpoint
from rbxcompose.bus.names import admin_key, denied_key, topic_pattern
from rbxcompose.bus.transport import Arrival, Closable, Transport
from rbxcompose.bus.zenoh_session import NO_LINK, RouterLink, open_router, tls_settings
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.plan.dump import load
from rbxcompose.compiler.plan.model import Exchange, Plan, Share
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.folder import Echo, OffsetFilter
from rbxcompose.runtime.log import Record, WriteRecord
from rbxcompose.runtime.process_group.connection import (
    CallbackInbox,
    PeerChecker,
    RealTimeDriver,
    Turns,
    Watchdog,
    answer,
    probe_key,
)
from rbxcompose.sdk.ports import Qos

FRESH = 1.0  # [s] since a report, after which it counts as missed; hosts report four times a second
PATIENCE, LONGEST = 2.0, 64.0  # [s] of evidence until links are opened again: the first time, and at most


@dataclass
class _Doubt:
    since: float
    latest: float  # both [s]


class OneWayLinks:
    """Judges the links of one host."""

    def __init__(self, host: str, now: float) -> None:
        self._host, self._begun = host, now
        self._sent_at, self._opened, self._sought = now, -LONGEST, now
        self._patience = PATIENCE
        self._reports: dict[str, float] = {}  # host -> when the last one arrived [s]
        self._doubts: dict[str, _Doubt] = {}

    def sent(self, now: float) -> None:
        """Take that this host reported."""
        self._sent_at = now

    def receive(self, sender: str, sent: int, echoes: Mapping[str, Echo], now: float) -> str | None:
        """Take a report, with what its host had received until it was sent [ns, its clock].

        Returns the host to which the link must be opened again, if there is evidence for long enough.
        """
        self._reports[sender] = now
        if now - self._sent_at > FRESH:
            self._doubts.clear()  # nobody can hear this host
            return None
        receiving = {host for host, echo in echoes.items() if (sent - echo.arrived) * 1e-9 < FRESH}
        if self._host in receiving:
            self._doubts.pop(sender, None)
        missing = {host for host in receiving - {self._host} if now - self._reports.get(host, self._begun) > FRESH}
        for host in missing if self._host in receiving else {sender, *missing}:
            if self._is_proven(host, now):
                return self._give_up(host, now)
        return None

    def must_seek(self, now: float) -> bool:
        """Return whether to seek a way to another host now, since none reports any more."""
        if not self._is_alone(now) or now - self._sought < FRESH / 2:
            return False
        self._sought = now
        return True

    def find(self, now: float) -> bool:
        """Take that there is a way to another host; return whether all links must be opened again."""
        is_proven = self._is_alone(now) and self._is_proven("", now)
        if is_proven:
            self._give_up("", now)
        return is_proven

    def _is_alone(self, now: float) -> bool:
        return bool(self._reports) and now - max(self._reports.values()) > FRESH

    def _is_proven(self, host: str, now: float) -> bool:
        doubt = self._doubts.setdefault(host, _Doubt(now, now))
        if now - doubt.latest > FRESH:
            doubt.since = now  # what came before is of an earlier link
        doubt.latest = now
        return now - doubt.since > self._patience

    def _give_up(self, host: str, now: float) -> str:
        """Return the host, and wait longer for the next time unless all was well for a while."""
        is_again = now - self._opened < self._patience + LONGEST
        self._patience = min(2 * self._patience, LONGEST) if is_again else 2 * PATIENCE
        self._opened = now
        self._doubts.clear()
        return host


LETS_THROUGH = kind("RBX6142")


def host_key(robot: str, host: str) -> str:
    """Return the Zenoh key of the reports of a host."""
    return admin_key(robot, f"hosts/{host}")


@dataclass(frozen=True, slots=True)
class _Sent:
    """A report on its way: when it was sent, and when the last ones of the other hosts were sent and arrived [ns]."""

    report: messages.HostReport
    sent: int
    heard: dict[str, Echo]


class HostLine:
    """Sends the reports of this host; `receive` is called with those of the others, in the scheduler's thread.

    `passed` is called with the reason if a message of another host came through that is denied. `stamp` is wall-clock
    time [ns]; reports both ways tell how far the clocks of two hosts are apart. `judge` takes of each report its host,
    when it was sent, and what that host had received.
    """

    def __init__(
        self,
        robot: str,
        share: Share,
        transport: Transport,
        receive: Callable[[messages.HostReport], None],
        passed: Callable[[str], None],
        stamp: Callable[[], int],
        judge: Callable[[str, int, Mapping[str, Echo]], None],
    ) -> None:
        self._receive, self._passed, self._transport, self._judge = receive, passed, transport, judge
        self._stamp, self._host = stamp, share.host
        self._echoes: dict[str, Echo] = {}
        self._filters: dict[str, OffsetFilter] = {}
        self._denied = transport.publisher(denied_key(robot, share.host), Qos.STATE) if share.access else None
        for other in share.others if share.access else ():  # before the reports, so that whoever knows these knows both
            transport.subscribe(denied_key(robot, other.name), Qos.STATE, partial(self._came_through, other.name))
        self._publisher = transport.publisher(host_key(robot, share.host), Qos.STATE)
        for other in share.others:
            transport.subscribe(host_key(robot, other.name), Qos.STATE, self._arrived)

    def send(self, report: messages.HostReport) -> None:
        """Send a report; nobody waits for it."""
        if self._denied is not None:
            self._denied.put(b"", b"")
        sent = _Sent(report, self._stamp(), self._echoes)
        self._publisher.put(json.dumps(to_data(sent)).encode(), b"")

    def _came_through(self, host: str, arrival: Arrival) -> None:
        text = f"{LETS_THROUGH.code}: access control lets through what it denies to host '{host}'"
        self._transport.wake("", lambda: self._passed(text))

    def _arrived(self, arrival: Arrival) -> None:
        data, arrived = arrival.payload, self._stamp()
        self._transport.wake("", lambda: self._read(data, arrived))

    def _read(self, data: bytes, arrived: int) -> None:
        try:
            message: _Sent = from_data(_Sent, json.loads(data))
        except (UnreadableError, ValueError, RecursionError):
            return  # another version, or a stranger: the host counts as silent, which is reported
        host = message.report.host
        self._echoes[host] = answer = Echo(message.sent, arrived)
        own = message.heard.get(self._host)
        clock = self._filters.setdefault(host, OffsetFilter()).feed(own, answer) if own else None
        self._receive(replace(message.report, clock=clock))
        self._judge(host, message.sent, message.heard)


V = TypeVar("V")
KNOCK = 0.25  # [s] for another host to accept a connection
TRIES = 1000  # ports from `bus.port` on; each robot of a machine needs one


class Router:
    """Listens on the robot's port or the next free one, or on a Unix socket, and answers probes.

    It ends when the supervisor says so or has gone.
    """

    def __init__(
        self, plan: Plan, sockets: Path, clock: MonotonicClock, channel: messages.Channel, log: WriteRecord
    ) -> None:
        self.is_over = False
        self._plan, self._sockets, self._clock, self._channel = plan, sockets, clock, channel
        self._log = log
        self._endpoint: str | None = None
        self._inbox = CallbackInbox()
        self._watchdog = Watchdog()
        self._transport: ZenohTransport | None = None
        self._hosts: HostLine | None = None
        self._roll: PeerChecker | None = None
        self._exchange: Closable | None = None
        self._scheduler = Scheduler()
        self._link = _link(plan, plan.share) if plan.share else NO_LINK
        self._host = plan.share.host if plan.share else ""
        self._one_way_links = OneWayLinks(self._host, clock.now())
        self._must_reopen = False

    def run(self) -> None:
        """Run until it is over."""
        signal.signal(signal.SIGTERM, _end)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
        scheduler = self._scheduler
        turns = Turns(scheduler, self._clock, self._inbox)
        RealTimeDriver(scheduler, self._clock, self._inbox, turns, self._channel, self).run()
        self._close()

    def _close(self) -> None:
        if self._exchange is not None:
            self._exchange.close()
        if self._transport is not None:
            self._transport.close()
        self._exchange = self._transport = self._hosts = self._roll = None

    def handle(self, message: messages.ChannelMessage) -> None:
        """Open the router, or end."""
        match message:
            case messages.Configure(endpoint):
                self._open(endpoint)
            case messages.ToHosts(report) if self._hosts is not None:
                self._hosts.send(report)
                self._one_way_links.sent(self._clock.now())
            case messages.ToHosts():
                pass  # it is not open yet; the next report comes soon
            case messages.Adopt(plan):
                self._adopt(load(plan))
            case messages.Shutdown():
                self.is_over = True
            case _:
                raise RuntimeError(f"not a message for a router: {message}")

    def orphaned(self) -> None:
        """End: the supervisor is gone."""
        self.is_over = True

    def beat(self) -> None:
        """Report to the supervisor and the watchdog that the loop runs."""
        self._watchdog.feed()
        if self._roll is not None:
            self._roll.beat()  # a process that the router does not reach finds out by itself
        if self._hosts is not None and self._one_way_links.must_seek(self._clock.now()):
            Thread(target=self._seek, daemon=True).start()  # a host that is not there lets whoever dials it wait
        if self._must_reopen:
            self._reopen()
        if not self._channel.is_behind:
            self._channel.send(messages.Alive(self._clock.now()))

    def settle(self) -> None:
        """Do nothing: a router has nothing to bring to rest."""

    def _open(self, endpoint: str | None) -> None:
        """Open a session, at `endpoint` if the others already know one."""
        reason = f"the router cannot listen: the {TRIES} ports from {self._plan.bus.port} on are taken"
        for wanted in [endpoint] if endpoint else self._endpoints():
            try:
                session = open_router(wanted, self._link)
            except OSError as error:  # taken: perhaps by another robot
                reason = f"the router cannot listen: {error.strerror}"
                continue
            self._endpoint = wanted
            self._transport = ZenohTransport(session, self._inbox.put)
            self._transport.serve(probe_key(self._plan.robot), answer)
            self._roll = PeerChecker(self._transport, self._plan.robot, self._host, "router")
            if self._plan.share is not None:
                callbacks = self._receive_report, self._fail, self._clock.stamp, self._judge
                self._hosts = HostLine(self._plan.robot, self._plan.share, self._transport, *callbacks)
            problem = self._share(self._plan.exchange, self._transport) if self._plan.exchange else ""
            self._channel.send(messages.Failed("", problem) if problem else messages.Configured(wanted))
            return
        if endpoint is not None:
            raise OSError(reason)  # another try may find it free again
        self._fail(reason)

    def _fail(self, reason: str) -> None:
        self._channel.send(messages.Failed("", reason))

    def _share(self, exchange: Exchange, transport: ZenohTransport) -> str:
        """Carry topics between this robot and others; return why this cannot be, or nothing."""
        from rbxcompose.runtime.process_group.exchange import RobotExchange  # which few robots need

        loop = self._scheduler, self._clock, self._inbox
        try:
            self._exchange = RobotExchange(exchange, self._plan.bus, transport, loop, self._warn)
        except OSError as error:
            why = f"{error.strerror}; 'share_port' in the system chooses another port"
            return f"what is shared cannot be offered: {why}"
        return ""

    def _warn(self, owner: str, text: str) -> None:
        self._log(Record(self._clock.now(), Level.WARN, owner, text))

    def _adopt(self, plan: Plan) -> None:
        """Follow another plan: open the session again, with its links, at the endpoint that all others know."""
        self._plan, self._link = plan, _link(plan, plan.share) if plan.share else NO_LINK
        if self._transport is not None:
            self._reopen()

    def _reopen(self) -> None:
        self._must_reopen = False
        self._close()
        self._open(self._endpoint)

    def _judge(self, host: str, sent: int, echoes: Mapping[str, Echo]) -> None:
        """Have the links opened again if another host and this one do not hear each other though there is a way."""
        silent = self._one_way_links.receive(host, sent, echoes, self._clock.now())
        if silent is not None:
            self._warn("robot", f"host '{silent}' is there, but does not answer; the links are opened again")
            self._must_reopen = True

    def _seek(self) -> None:
        if any(accepts(text, KNOCK) for text in self._link.connect):
            self._inbox.put("", self._find)

    def _find(self) -> None:
        if self._one_way_links.find(self._clock.now()):
            self._warn("robot", "another host is there, but none answers; the links are opened again")
            self._must_reopen = True

    def _receive_report(self, report: messages.HostReport) -> None:
        self._channel.send(messages.FromHost(report))

    def _endpoints(self) -> Iterator[str]:
        bus = self._plan.bus
        if bus.access == "user":
            yield unix_endpoint(self._sockets, "router")
        else:
            yield from map(tcp_endpoint, free_ports(bus.port))


def free_ports(first: int) -> Iterator[int]:
    """Yield the ports from `first` on at which nothing listens now; to open a router in vain costs more."""
    return filter(_is_free, range(first, min(first + TRIES, 65536)))


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as routers do: links that have ended take nothing
        try:
            probe.bind((LOOPBACK, port))
        except OSError:
            return False
    return True


def _link(plan: Plan, share: Share) -> RouterLink:
    own = share.tls
    tls = tls_settings(own.authority, own.certificate, own.key, mutual=own.mutual) if own else {}
    allowed = [
        AllowedHost(host_access.certificate, host_access.gives, host_access.takes, host_access.both)
        for host_access in share.access
    ]
    access = access_control(plan.robot, plan.bus.domain, allowed) if allowed else {}
    ways = (_by_key(plan, share.downsample), _by_key(plan, share.priorities), _by_key(plan, share.largest))
    return RouterLink(share.listen, share.connect, tls, access, *ways, lease=share.lease)


def _by_key(plan: Plan, by_topic: Mapping[str, V]) -> dict[str, V]:
    return {topic_pattern(plan.bus.domain, topic): value for topic, value in by_topic.items()}


def _end(number: int, frame: FrameType | None) -> None:
    os._exit(0)
