"""The router of a robot: a small process by which the others find each other.

No data passes through it but what goes to other hosts of the robot, whose routers it is linked with.
"""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path
from threading import Thread
from types import FrameType
from typing import TypeVar

from rbxcompose.bus.access_control import AllowedHost, access_control
from rbxcompose.bus.names import topic_pattern
from rbxcompose.bus.probe import probe_key
from rbxcompose.bus.transport import Closable
from rbxcompose.bus.zenoh_session import NO_LINK, RouterLink, open_router, tls_settings
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.clock import MonotonicClock
from rbxcompose.endpoints import LOOPBACK, accepts, tcp_endpoint, unix_endpoint
from rbxcompose.levels import Level
from rbxcompose.plan.dump import load
from rbxcompose.plan.model import Exchange, Plan, Share
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.clock_offset import Echo
from rbxcompose.runtime.deaf_links import DeafLinks
from rbxcompose.runtime.host_report import HostReport
from rbxcompose.runtime.process_group.driver import RealTimeDriver
from rbxcompose.runtime.process_group.host_line import HostLine
from rbxcompose.runtime.process_group.inbox import CallbackInbox
from rbxcompose.runtime.process_group.lifeline import answer
from rbxcompose.runtime.process_group.roll_caller import RollCaller
from rbxcompose.runtime.process_group.turns import Turns
from rbxcompose.runtime.process_group.watchdog import Watchdog
from rbxcompose.runtime.records import Record, WriteRecord
from rbxcompose.scheduler import Scheduler

V = TypeVar("V")
KNOCK = 0.25  # [s] for another host to accept a connection
TRIES = 1000  # ports from `bus.port` on; each robot of a machine needs one


class Router:
    """Listens on the robot's port or the next free one, or on a Unix socket, and answers probes.

    It ends when the supervisor says so or has gone.
    """

    def __init__(
        self, plan: Plan, sockets: Path, clock: MonotonicClock, channel: say.Channel, log: WriteRecord
    ) -> None:
        self.is_over = False
        self._plan, self._sockets, self._clock, self._channel = plan, sockets, clock, channel
        self._log = log
        self._endpoint: str | None = None
        self._inbox = CallbackInbox()
        self._watchdog = Watchdog()
        self._transport: ZenohTransport | None = None
        self._hosts: HostLine | None = None
        self._roll: RollCaller | None = None
        self._exchange: Closable | None = None
        self._scheduler = Scheduler()
        self._link = _link(plan, plan.share) if plan.share else NO_LINK
        self._host = plan.share.host if plan.share else ""
        self._deaf_links = DeafLinks(self._host, clock.now())
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

    def handle(self, message: say.ChannelMessage) -> None:
        """Open the router, or end."""
        match message:
            case say.Configure(endpoint):
                self._open(endpoint)
            case say.ToHosts(report) if self._hosts is not None:
                self._hosts.tell(report)
                self._deaf_links.tell(self._clock.now())
            case say.ToHosts():
                pass  # it is not open yet; the next report comes soon
            case say.Adopt(plan):
                self._adopt(load(plan))
            case say.Shutdown():
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
        if self._hosts is not None and self._deaf_links.must_seek(self._clock.now()):
            Thread(target=self._seek, daemon=True).start()  # a host that is not there lets whoever dials it wait
        if self._must_reopen:
            self._reopen()
        self._channel.flush()
        if not self._channel.is_behind:
            self._channel.send(say.Alive(self._clock.now()))

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
            self._roll = RollCaller(self._transport, self._plan.robot, self._host, "router")
            if self._plan.share is not None:
                told = self._heard, self._fail, self._clock.stamp, self._judge
                self._hosts = HostLine(self._plan.robot, self._plan.share, self._transport, *told)
            problem = self._share(self._plan.exchange, self._transport) if self._plan.exchange else ""
            self._channel.send(say.Failed("", problem) if problem else say.Configured(wanted))
            return
        if endpoint is not None:
            raise OSError(reason)  # another try may find it free again
        self._fail(reason)

    def _fail(self, reason: str) -> None:
        self._channel.send(say.Failed("", reason))

    def _share(self, exchange: Exchange, transport: ZenohTransport) -> str:
        """Carry topics between this robot and others; return why this cannot be, or nothing."""
        from rbxcompose.runtime.process_group.exchange import RobotExchange  # which few robots need

        loop = self._scheduler, self._clock, self._inbox
        try:
            self._exchange = RobotExchange(exchange, self._plan.bus, transport, loop, self._warn)
        except OSError as error:
            return f"what is shared cannot be offered: {error.strerror}"
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

    def _judge(self, host: str, sent: int, heard: Mapping[str, Echo]) -> None:
        """Have the links opened again if another host and this one do not hear each other though there is a way."""
        deaf = self._deaf_links.hear(host, sent, heard, self._clock.now())
        if deaf is not None:
            self._warn("robot", f"host '{deaf}' is there, but does not answer; the links are opened again")
            self._must_reopen = True

    def _seek(self) -> None:
        if any(accepts(one, KNOCK) for one in self._link.connect):
            self._inbox.put("", self._find)

    def _find(self) -> None:
        if self._deaf_links.find(self._clock.now()):
            self._warn("robot", "another host is there, but none answers; the links are opened again")
            self._must_reopen = True

    def _heard(self, report: HostReport) -> None:
        self._channel.send(say.FromHost(report))

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
    allowed = [AllowedHost(one.certificate, one.gives, one.takes, one.both) for one in share.access]
    access = access_control(plan.robot, plan.bus.domain, allowed) if allowed else {}
    ways = (_by_key(plan, share.downsample), _by_key(plan, share.priorities), _by_key(plan, share.largest))
    return RouterLink(share.listen, share.connect, tls, access, *ways, lease=share.lease)


def _by_key(plan: Plan, by_topic: Mapping[str, V]) -> dict[str, V]:
    return {topic_pattern(plan.bus.domain, topic): value for topic, value in by_topic.items()}


def _end(number: int, frame: FrameType | None) -> None:
    os._exit(0)
