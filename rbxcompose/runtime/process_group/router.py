"""The router of a robot: a small process by which the others find each other.

No data passes through it but what goes to other hosts of the robot, whose routers it is linked with.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

from rbxcompose.bus.access_control import AllowedHost, access_control
from rbxcompose.bus.names import topic_pattern
from rbxcompose.bus.probe import probe_key
from rbxcompose.bus.zenoh_session import NO_LINK, RouterLink, open_router, tls_settings
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.clock import MonotonicClock
from rbxcompose.endpoints import tcp_endpoint, unix_endpoint
from rbxcompose.plan.model import Plan, Share
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.host_report import HostReport
from rbxcompose.runtime.process_group.driver import RealTimeDriver
from rbxcompose.runtime.process_group.host_line import HostLine
from rbxcompose.runtime.process_group.inbox import CallbackInbox
from rbxcompose.runtime.process_group.lifeline import answer
from rbxcompose.runtime.process_group.turns import Turns
from rbxcompose.runtime.process_group.watchdog import Watchdog
from rbxcompose.scheduler import Scheduler

TRIES = 20  # ports from `bus.port` on


class Router:
    """Listens on the robot's port or the next free one, or on a Unix socket, and answers probes.

    It ends when the supervisor says so or has gone.
    """

    def __init__(self, plan: Plan, sockets: Path, clock: MonotonicClock, channel: say.Channel) -> None:
        self.is_over = False
        self._plan, self._sockets, self._clock, self._channel = plan, sockets, clock, channel
        self._inbox = CallbackInbox()
        self._watchdog = Watchdog()
        self._transport: ZenohTransport | None = None
        self._hosts: HostLine | None = None
        self._link = _link(plan, plan.share) if plan.share else NO_LINK

    def run(self) -> None:
        """Run until it is over."""
        signal.signal(signal.SIGTERM, _end)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
        scheduler = Scheduler()
        turns = Turns(scheduler, self._clock, self._inbox)
        RealTimeDriver(scheduler, self._clock, self._inbox, turns, self._channel, self).run()
        if self._transport is not None:
            self._transport.close()

    def handle(self, message: say.ChannelMessage) -> None:
        """Open the router, or end."""
        match message:
            case say.Configure(endpoint):
                self._open(endpoint)
            case say.ToHosts(report) if self._hosts is not None:
                self._hosts.tell(report)
            case say.ToHosts():
                pass  # it is not open yet; the next report comes soon
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
        self._channel.flush()
        if not self._channel.is_behind:
            self._channel.send(say.Alive(self._clock.now()))

    def settle(self) -> None:
        """Do nothing: a router has nothing to bring to rest."""

    def _open(self, endpoint: str | None) -> None:
        """Open a session, at `endpoint` if the others already know one."""
        reason = ""
        for wanted in [endpoint] if endpoint else self._endpoints():
            try:
                session = open_router(wanted, self._link)
            except OSError as error:  # taken: perhaps by another robot
                reason = f"the router cannot listen: {error.strerror}"
                continue
            self._transport = ZenohTransport(session, self._inbox.put)
            self._transport.serve(probe_key(self._plan.robot), answer)
            if self._plan.share is not None:
                self._hosts = HostLine(self._plan.robot, self._plan.share, self._transport, self._heard)
            self._channel.send(say.Configured(wanted))
            return
        if endpoint is not None:
            raise OSError(reason)  # another try may find it free again
        self._channel.send(say.Failed("", reason))

    def _heard(self, report: HostReport) -> None:
        self._channel.send(say.FromHost(report))

    def _endpoints(self) -> Iterator[str]:
        bus = self._plan.bus
        if bus.access == "user":
            yield unix_endpoint(self._sockets, "router")
        else:
            yield from map(tcp_endpoint, range(bus.port, bus.port + TRIES))


def _link(plan: Plan, share: Share) -> RouterLink:
    own = share.tls
    tls = tls_settings(own.authority, own.certificate, own.key, mutual=own.mutual) if own else {}
    rates = {topic_pattern(plan.bus.domain, topic): rate for topic, rate in share.downsample.items()}
    allowed = [AllowedHost(one.certificate, one.gives, one.takes, one.both) for one in share.access]
    access = access_control(plan.robot, plan.bus.domain, allowed) if allowed else {}
    return RouterLink(share.listen, share.connect, tls, access, rates)


def _end(number: int, frame: FrameType | None) -> None:
    os._exit(0)
