"""The main of a process group: its scheduler, clock, bus, host and driver, led by the supervisor's messages."""

from __future__ import annotations

import faulthandler
import gc
import os
import signal
from collections.abc import Sequence
from types import FrameType

from rbxcompose.bus.bus import Bus
from rbxcompose.clock import MonotonicClock, SteppedClock
from rbxcompose.diagnostics.levels import Level
from rbxcompose.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.connection import open_bus
from rbxcompose.runtime.driver import Driver, RealTimeDriver, SteppedDriver
from rbxcompose.runtime.host import Host
from rbxcompose.runtime.inbox import Inbox
from rbxcompose.runtime.log import LogFile
from rbxcompose.runtime.options import RunOptions
from rbxcompose.runtime.records import Record
from rbxcompose.scheduler import Scheduler
from rbxcompose.sdk.bound import Refused

HANG = 2.0  # [s] without a turn of the loop after which the process ends itself
LONGEST_CONFIGURE = 30.0  # [s]
LONGEST_CLOSE = 1.0  # [s] to deactivate, clean up and leave the bus
REST_BOUND = 1.0  # [s] of robot time to come to rest when the supervisor has gone
STEPPED_REST_BOUND = 2.0  # [s] of robot time to come to rest on a stepped clock


class Group:
    """One process group, from `Configure` to `Shutdown`. It stops by itself when the supervisor has gone."""

    def __init__(
        self,
        plan: Plan,
        name: str,
        options: RunOptions,
        log: LogFile,
        channel: say.Channel,
        *,
        start: float,
        is_restart: bool = False,
        is_stopped: bool = False,
    ) -> None:
        """Take `start`, the robot's start on the monotonic clock [s]."""
        self.is_over = False
        self._plan, self._name, self._options, self._log, self._channel = plan, name, options, log, channel
        self._is_restart, self._is_stopped = is_restart, is_stopped
        self._clock = SteppedClock() if options.is_stepped else MonotonicClock(start)
        self._scheduler = Scheduler()
        self._inbox = Inbox()
        self._bus: Bus | None = None
        self._host: Host | None = None
        self._driver = self._made_driver()
        self._has_begun = False  # something has been activated, and may move
        self._is_ending = False  # nothing is to come any more; brake at the end of this instant
        self._is_orphaned = False
        self._rest_deadline: float | None = None  # [s] of robot time; None: not braking
        self._is_settled = False  # at rest for good

    def run(self) -> None:
        """Run until the supervisor says so or has gone."""
        signal.signal(signal.SIGTERM, self._on_sigterm)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
        try:
            self._driver.run()
        finally:
            if self._bus is not None:
                self._bus.close()

    # What the driver asks

    def handle(self, message: say.Message) -> None:
        """Carry out a message from the supervisor."""
        if isinstance(message, say.Stop | say.Release | say.Command):
            self._mind_outside(message)
        match message:
            case say.Configure(str(router)):
                self._configure(router)
            case say.Activate(names):
                self._activate(names)
            case say.Start():
                self._start()
            case say.Stop():
                self._made_host().stop()
            case say.Release():
                self._made_host().release()
            case say.Brake():
                self._is_ending = True
            case say.Lost(names, cause):
                self._made_host().lost(names, cause)
            case say.Command(number, instance, verb):
                self._command(number, instance, verb)
            case say.Shutdown():
                self._shutdown()
            case _:
                raise RuntimeError(f"not a message for a process group: {message}")

    def orphaned(self) -> None:
        """Come to rest and end: the supervisor has gone."""
        self._is_orphaned = self._is_ending = True
        self._is_settled = self._is_settled or self._host is None

    def beat(self) -> None:
        """Tell the supervisor, and the watchdog, that the loop turns."""
        self._watch(HANG)
        self._channel.flush()
        if not self._channel.is_behind:
            self._channel.send(say.Alive(self._clock.now()))

    def settle(self) -> None:
        """Look whether the run is to end, whether it has come to rest, and whether nobody leads it any more."""
        if self._time_is_up():
            self._is_ending = True
            self._notify("time_is_up", {})
        if self._is_ending and self._rest_deadline is None and self._host is not None:
            self._brake(self._host)
        if self._rest_deadline is not None and not self._is_settled:
            self._look_for_rest(self._made_host(), self._rest_deadline)
        if self._is_orphaned and self._is_settled and not self.is_over:
            self._shutdown()

    # Messages

    def _configure(self, router: str) -> None:
        self._watch(LONGEST_CONFIGURE)
        instances = self._plan.of_group(self._name)
        self._bus = open_bus(self._plan, router, self._scheduler, self._clock, self._inbox, self._complain)
        self._host = Host(
            self._plan,
            instances,
            self._scheduler,
            self._clock,
            self._bus,
            self._log.write,
            self._notify,
            is_stopped=self._is_stopped,
            is_restart=self._is_restart,
        )
        self._host.configure()
        self._watch(HANG)
        self._channel.send(say.Configured())

    def _activate(self, names: Sequence[str]) -> None:
        self._has_begun = True
        self._made_host().activate(names)
        self._channel.send(say.States(self._made_host().states()))

    def _start(self) -> None:
        gc.collect()
        gc.freeze()  # what lives now lives until the end: later collections need not look at it
        self._made_host().start()
        if isinstance(self._driver, SteppedDriver):
            self._driver.go(self._options.duration)

    def _command(self, number: int, instance: str, verb: str) -> None:
        try:
            self._channel.send(say.Answer(number, self._made_host().command(instance, verb)))
        except Refused as refusal:
            self._channel.send(say.Answer(number, str(refusal), is_refused=True))

    def _shutdown(self) -> None:
        self._watch(LONGEST_CLOSE)  # nothing moves any more: what hangs now is cut off
        if self._host is not None:
            if self._rest_deadline is None:
                self._host.brake()  # the order to brake came together with this one
            self._channel.send(say.Summary(self._clock.now(), self._host.summary()))
            self._host.shutdown()
        self.is_over = True

    def _mind_outside(self, message: say.Stop | say.Release | say.Command) -> None:
        if self._options.is_stepped:
            words = f"{message.instance} {message.verb}" if isinstance(message, say.Command) else ""
            text = f"from outside: {words or type(message).__name__.lower()}; this run is not reproducible"
            self._log.write(Record(self._clock.now(), Level.WARN, "robot", text))

    # Coming to rest

    def _time_is_up(self) -> bool:
        # In real time the supervisor counts; on a stepped clock it could only be late.
        duration = self._options.duration
        is_counting = self._options.is_stepped and not self._is_ending and duration is not None
        return is_counting and duration is not None and self._clock.now() >= duration

    def _brake(self, host: Host) -> None:
        host.brake()
        bound = STEPPED_REST_BOUND if self._options.is_stepped else REST_BOUND
        self._rest_deadline = self._clock.now() + bound
        if isinstance(self._driver, SteppedDriver):
            self._driver.hurry()
            self._driver.go(self._rest_deadline)

    def _look_for_rest(self, host: Host, deadline: float) -> None:
        if not host.is_at_rest and self._clock.now() < deadline:
            return
        self._is_settled = True
        if isinstance(self._driver, SteppedDriver):
            self._driver.halt()
        self._channel.send(say.AtRest())

    # Parts

    def _made_driver(self) -> Driver:
        if isinstance(self._clock, SteppedClock):
            rate = self._options.rate
            return SteppedDriver(self._scheduler, self._clock, self._inbox, self._channel, self, rate=rate)
        return RealTimeDriver(self._scheduler, self._clock, self._inbox, self._channel, self)

    def _made_host(self) -> Host:
        if self._host is None:
            raise RuntimeError("the process group has not been configured")
        return self._host

    def _notify(self, event: str, data: dict[str, object]) -> None:
        self._channel.send(say.Notify(event, data))
        is_the_end = event == "mission_ended" and data["mission"] == self._plan.start
        if is_the_end and self._options.is_stepped and not self._options.is_detached:
            self._is_ending = True  # here and not by a message, which would come at another instant in each run

    def _complain(self, owner: str, text: str) -> None:
        self._log.write(Record(self._clock.now(), Level.WARN, owner, text))

    def _watch(self, seconds: float) -> None:
        if not self._options.is_stepped:
            faulthandler.dump_traceback_later(seconds, exit=True)

    def _on_sigterm(self, number: int, frame: FrameType | None) -> None:
        if not self._has_begun:
            os._exit(0)  # nothing can move yet, and configuring may take long
        self._inbox.put("", self.orphaned)
