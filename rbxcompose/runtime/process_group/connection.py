"""Opens the bus of a process, proves that its session carries data, and reopens it when it does not."""

from __future__ import annotations

import faulthandler
import math
import os
import selectors
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from threading import Thread
from typing import TYPE_CHECKING, Protocol

import zenoh

from rbxcompose.base.clock import Clock, ExternalClock, MonotonicClock, SteppedClock, Turn
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus import shared_memory
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.endpoints import accepts
from rbxcompose.bus.renewal import RenewableTransport
from rbxcompose.bus.transport import Closable, Question, Transport, TransportReply
from rbxcompose.bus.zenoh_session import open_lone, open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime.channel import Channel, ChannelMessage
from rbxcompose.runtime.processes import longest_wait, waits_of

if TYPE_CHECKING:
    from rbxcompose.runtime.recording.tape import Tape
import json
from collections.abc import Iterable
from enum import Enum, auto

from rbxcompose.bus.names import admin_key

MISSES = 3  # consecutive probes without an answer after which a session counts as stuck
MOST_MISSES = 96  # for a session that was reopened again and again without success


def probe_key(robot: str) -> str:
    """Return the key at which all processes of a robot probe and answer each other."""
    return admin_key(robot, "probe")


class ProbeResult(Enum):
    """The result of a probe by the time the next one is due."""

    ANSWER = auto()  # from anybody: the session carries data
    NOTHING = auto()  # there is a route to somebody, but nothing comes back
    NOBODY = auto()  # there is no route to anybody


class Probe:
    """Counts missed probes.

    Where the router must answer (`expects_router`), `NOBODY` is a miss as well, unless the router is down: then the
    router has to come back. A router from elsewhere need not know probes, and a process may be alone with it.
    """

    def __init__(self, *, expects_router: bool) -> None:
        self._expects_router = expects_router
        self._misses = 0
        self._bound = MISSES

    @property
    def is_in_doubt(self) -> bool:
        """Return whether the last probe was missed, so that the next goes to all; else it goes to the nearest."""
        return self._misses > 0

    def judge(self, received: ProbeResult, *, is_router_up: bool) -> bool:
        """Evaluate the result of a probe; return whether the session is stuck and must be reopened.

        After a renewal that did not help, it waits for twice as many misses.
        """
        if received is ProbeResult.ANSWER:
            self._misses, self._bound = 0, MISSES
        elif received is ProbeResult.NOTHING or (self._expects_router and is_router_up):
            self._misses += 1
        if self._misses < self._bound:
            return False
        self._misses, self._bound = 0, min(2 * self._bound, MOST_MISSES)
        return True


CALLS, MOST_CALLS = 3, 96  # that a process must miss until the session counts as broken: the first time, and at most


def roll_key(robot: str, host: str) -> str:
    """Return the key at which the processes of a host call the roll; no link to another host carries it."""
    return admin_key(robot, f"roll/{host or 'here'}")


class PeerCheck:
    """The roll as the process `name` calls it; `answer` is what it answers to others."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._missed: dict[str, int] = {}  # process that others hear -> calls in a row
        self._calls = CALLS
        self.answer = _answer(name, ())

    def judge(self, answers: Iterable[bytes]) -> list[str]:
        """Take all answers to a call; return the processes for whose sake the session must be opened again."""
        received_by = dict(filter(None, map(_parsed, answers)))
        received_by.pop(self._name, None)
        self.answer = _answer(self._name, received_by)
        known = {message for received in received_by.values() for message in received} - {self._name}
        self._missed = {one: self._missed.get(one, 0) + 1 for one in known - received_by.keys()}
        if not self._missed:
            self._calls = CALLS if known else self._calls
            return []
        # Of two that miss each other, one is enough, unless it does not help.
        patience = self._calls if self._name < min(self._missed) else 2 * self._calls
        lost = sorted(text for text, times in self._missed.items() if times >= patience)
        if lost:
            self._missed, self._calls = {}, min(2 * self._calls, MOST_CALLS)
        return lost


def _answer(name: str, received: Iterable[str]) -> bytes:
    return json.dumps([name, sorted(received)]).encode()


def _parsed(answer: bytes) -> tuple[str, list[str]] | None:
    """Return who answered and whom it has heard; None from another version."""
    try:
        data = json.loads(answer)
    except (ValueError, RecursionError):
        return None
    match data:
        case [str(name), [*received]]:
            return name, [message for message in received if isinstance(message, str)]
    return None


class CallbackInbox:
    """Takes callbacks from any thread or signal handler and wakes the thread that waits for its descriptor."""

    def __init__(self) -> None:
        self._descriptor = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._callbacks: deque[tuple[str, Callable[[], None]]] = deque()
        self._is_signalled = False

    def fileno(self) -> int:
        """Return the descriptor that is readable when something has arrived."""
        return self._descriptor

    @property
    def has_some(self) -> bool:
        """Return whether callbacks are waiting."""
        return bool(self._callbacks)

    def put(self, owner: str, callback: Callable[[], None]) -> None:
        """Run `callback` for `owner` on the scheduler's thread. May be called from any thread."""
        self._callbacks.append((owner, callback))
        self.wake()

    def wake(self) -> None:
        """Wake the thread that waits for the descriptor. May be called from any thread."""
        if not self._is_signalled:  # one system call per wake, not per sample
            self._is_signalled = True
            os.eventfd_write(self._descriptor, 1)

    def drain(self, scheduler: Scheduler) -> None:
        """Post everything that has arrived, in the order of arrival."""
        # Read regardless of the flag: if two threads signal at the same time, one may write after the other was served.
        try:
            os.eventfd_read(self._descriptor)
        except BlockingIOError:
            return  # nothing has arrived, or its write is still pending
        self._is_signalled = False  # before reading: anything that arrives from now on signals again
        while self._callbacks:
            scheduler.post(*self._callbacks.popleft())

    def close(self) -> None:
        """Close the descriptor; nothing must be put in afterwards."""
        os.close(self._descriptor)


HANG = 2.0  # [s] without an iteration of the loop after which the process ends itself
PERIOD = 0.25  # [s] between two wake-ups
MARK = "the loop did not run for "
"""Begins the first line of the dump of all threads; how long, and where that was, follows."""


class Watchdog:
    """Ends the process with exit code 1 unless it is fed in time. It cannot detect a hang that holds Python's lock."""

    def __init__(self, place: Callable[[], str] = str) -> None:
        """Take `place`, which returns in words what runs, such as `step of 'lidar'`, or nothing."""
        self._place = place
        self._seconds = self._left = HANG  # [s] that it was given, and of them until the end
        self._is_fed = True
        self._thread: threading.Thread | None = None

    def feed(self, seconds: float = HANG) -> None:
        """Let the process live for another `seconds` [s], less the part of a period that has already passed."""
        self._seconds = self._left = seconds
        self._is_fed = True
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)
            self._thread.start()

    def _watch(self) -> None:
        waits: dict[str, float] = {}
        while self._left >= PERIOD / 2:
            self._is_fed = False
            time.sleep(PERIOD)
            if self._is_fed:
                self._left -= PERIOD
                waits = {}
                continue
            before, waits = waits, waits_of(os.getpid())
            self._left -= PERIOD - min(PERIOD, longest_wait(before, waits) if before else 0.0)
        sys.stderr.flush()
        place = f" in {place}" if (place := self._place()) else ""
        os.write(2, f"{MARK}{self._seconds:g} s{place}\n".encode())
        faulthandler.dump_traceback(file=2)
        os._exit(1)


MOST = 16  # callbacks in one lent turn: more than a message usually causes
SLOW = 0.001  # [s] in one callback, after which its owner gets no turns for a while
REST = 100.0  # times as long as a slow callback took: so they hold up reception for a hundredth of the time at most


class Turns:
    """The right to run components: the scheduler's thread has it, and lends it out only between `rest` and `resume`."""

    def __init__(self, scheduler: Scheduler, clock: Clock, inbox: CallbackInbox) -> None:
        """Keep the turn: nothing is lent before `open`."""
        self._scheduler, self._clock, self._inbox = scheduler, clock, inbox
        self._lock = threading.Lock()
        self._lock.acquire()
        self._is_open = False
        self._is_wanted = True  # by the scheduler's thread, which must not be kept waiting by one turn after the other
        self._until = 0.0  # [s] of robot time, when that thread wakes by itself
        self._helper: int | None = None  # the thread that has been lent the turn
        self._owner = ""  # for whom it runs
        self._slow: dict[str, float] = {}  # owners of slow callbacks, and until when they get no turns [s]

    def open(self) -> None:
        """Begin to lend turns, from the next `rest` on."""
        self._is_open = True

    def close(self) -> None:
        """Lend no more turns."""
        self._is_open = False

    def rest(self, until: float) -> None:
        """Lend turns until `resume`; the scheduler's thread sleeps until robot time `until` [s] at most."""
        if self._is_open:
            self._until, self._is_wanted = until, False
            self._lock.release()

    def resume(self) -> None:
        """Take the turn back."""
        if not self._is_wanted:
            self._is_wanted = True
            self._lock.acquire()

    def bring(self, owner: str, callback: Callable[[], None]) -> None:
        """Run `callback` for `owner` in the calling thread if it gets the turn, else in the scheduler's thread."""
        if self._is_wanted or not self._lock.acquire(blocking=False):
            self._inbox.put(owner, callback)
            return
        self._helper = threading.get_ident()
        try:
            now, due = self._clock.now(), self._scheduler.next_due()
            if self._must_end() or (due is not None and due <= now) or self._slow.get(owner, now) > now:
                self._inbox.put(owner, callback)  # behind what came first
            else:
                self._take(owner, callback, now)
        finally:
            self._helper = None
            self._lock.release()

    def on_own(self, callback: Callable[[], None]) -> None:
        """Run `callback` at once or, within a lent turn, in the scheduler's thread afterwards."""
        if self._helper == threading.get_ident():
            # Not in the name of the owner: what it has begun must be done even if it is closed meanwhile.
            self._inbox.put("", partial(self._do_for, self._owner, callback))
        else:
            callback()

    def _do_for(self, owner: str, callback: Callable[[], None]) -> None:
        try:
            callback()
        except (Exception, SystemExit) as error:  # the failure of the component alone, as if it had done it itself
            self._scheduler.on_error(owner, error)

    def _take(self, owner: str, callback: Callable[[], None], now: float) -> None:
        self._scheduler.begin(now)
        now = self._run(owner, callback, now)
        for _ in range(MOST - 1):
            due = self._scheduler.next_due()
            if due is None or due >= self._until or self._must_end():
                return
            following = self._scheduler.take_light(self._slow)
            if following is None:
                break
            now = self._run(*following, now)
        self._inbox.wake()  # something is due before the scheduler's thread would wake by itself

    def _must_end(self) -> bool:
        """Return whether the scheduler's thread is about to run."""
        return self._is_wanted or self._inbox.has_some

    def _run(self, owner: str, callback: Callable[[], None], began: float) -> float:
        """Run a callback that begins at `began` [s] and return when it has ended [s]."""
        self._owner = owner
        try:
            self._scheduler.observe(owner, callback)
        except BaseException as error:  # to be handled, or to end the process, where all others are
            self._inbox.put(owner, partial(_raise, error))
        ended = self._clock.now()
        if ended - began > SLOW:
            self._slow[owner] = ended + REST * (ended - began)
        elif self._slow:
            self._slow = {text: until for text, until in self._slow.items() if until > ended}
        return ended


def _raise(error: BaseException) -> None:
    raise error


BEAT = 0.25  # [s] of real time between signs of life
EARLY = 0.02  # [s] by which a sign of life may be early: a process that is awake need not wake up again for it
LOOK = 0.1  # [s] of real time between checks whether outside time still runs
SLICE = 0.05  # [s] of real time for catching up with outside time, before messages are received again


class Driven(Protocol):
    """What a driver drives: it handles messages, and says after each round whether it continues."""

    def handle(self, message: ChannelMessage) -> None:
        """Carry out a message from the supervisor."""
        ...

    def orphaned(self) -> None:
        """Handle the loss of the supervisor."""
        ...

    def beat(self) -> None:
        """Give a sign of life, every `BEAT` seconds of real time."""
        ...

    def settle(self) -> None:
        """Check the state, after everything that was due has run."""
        ...

    @property
    def is_over(self) -> bool:
        """Return whether the process is to end."""
        ...


class Driver:
    """Waits for channel and inbox, and passes their messages on; subclasses define how time advances."""

    _clock: Clock

    def __init__(self, scheduler: Scheduler, inbox: CallbackInbox, channel: Channel, driven: Driven) -> None:
        self._scheduler, self._inbox, self._channel, self._driven = scheduler, inbox, channel, driven
        self._selector = selectors.SelectSelector()  # its timeouts have microseconds; epoll rounds up to milliseconds
        self._selector.register(inbox, selectors.EVENT_READ)
        self._selector.register(channel, selectors.EVENT_READ)
        self._is_sending = False
        self._next_beat = 0.0  # [s] on the monotonic clock
        self._beats_from = 0.0  # [s] on that clock; on this grid, beats need no waking of their own

    def run(self) -> None:
        """Run until the driven process is over."""
        with self._selector:
            while not self._driven.is_over:
                self._listen(self._pause())
                self._advance()
                self._driven.settle()

    def _pause(self) -> float:
        """Return how long to wait for the next event [s], if nothing arrives."""
        raise NotImplementedError

    def _advance(self) -> None:
        """Advance time, unless it does so by itself, and run what is due."""
        self._run_present()

    def _run_present(self) -> None:
        """Run what is due at the present instant."""
        self._scheduler.advance(self._clock.now())

    def _listen(self, pause: float) -> None:
        until_beat = self._next_beat - time.monotonic()
        if until_beat <= EARLY:
            self._driven.beat()
            self._next_beat = self._beats_from + BEAT * (
                math.floor((time.monotonic() + EARLY - self._beats_from) / BEAT) + 1
            )
            until_beat = BEAT
        self._watch_channel()
        ready = self._wait(max(0.0, min(pause, until_beat)))
        self._inbox.drain(self._scheduler)
        if any(key.fileobj is self._channel for key, _ in ready):
            self._channel.flush()
            self._receive(self._channel.receive())

    def _watch_channel(self) -> None:
        """Wait for messages, and until the supervisor can take the rest of one too long for one send."""
        if self._channel.is_open and self._is_sending != self._channel.is_behind:
            self._is_sending = not self._is_sending
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._is_sending else 0)
            self._selector.modify(self._channel, events)

    def _wait(self, longest: float) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait for channel and inbox, `longest` [s] at most, and return which of them are ready."""
        return self._selector.select(longest)

    def _receive(self, messages: Sequence[ChannelMessage]) -> None:
        for message in messages:
            self._driven.handle(message)
            self._run_present()  # one message after the other, however they were bundled in transit
        if not self._channel.is_open:
            self._selector.unregister(self._channel)
            self._driven.orphaned()


class RealTimeDriver(Driver):
    """Robot time is the monotonic clock; deadlines are absolute, so that lateness does not add up."""

    def __init__(
        self,
        scheduler: Scheduler,
        clock: MonotonicClock,
        inbox: CallbackInbox,
        turns: Turns,
        channel: Channel,
        driven: Driven,
    ) -> None:
        super().__init__(scheduler, inbox, channel, driven)
        self._clock, self._turns, self._beats_from = clock, turns, clock.start

    def _wait(self, longest: float) -> list[tuple[selectors.SelectorKey, int]]:
        self._turns.rest(self._clock.now() + longest)
        try:
            return super()._wait(longest)
        finally:
            self._turns.resume()

    def _pause(self) -> float:
        due = self._scheduler.next_due()
        return BEAT if due is None else due - self._clock.now()


class SteppedDriver(Driver):
    """Robot time stands still until `go`, then jumps from event to event, and stands still again after `halt`.

    `rate` is robot seconds per real second; None is as fast as possible. Input from outside is handled between two
    instants; without any, the order of events is the same in every run.
    """

    _clock: SteppedClock

    def __init__(
        self,
        scheduler: Scheduler,
        clock: SteppedClock,
        inbox: CallbackInbox,
        channel: Channel,
        driven: Driven,
        *,
        rate: float | None,
    ) -> None:
        super().__init__(scheduler, inbox, channel, driven)
        self._clock, self._rate = clock, rate
        self._is_running = False
        self._deadline: float | None = None  # [s] of robot time, where it ends
        self._origin = (0.0, 0.0)  # [s] robot time and the corresponding real time

    def go(self, deadline: float | None = None) -> None:
        """Let time run, at most until `deadline` [s] of robot time."""
        self._is_running, self._deadline = True, deadline
        self._origin = (self._clock.now(), time.monotonic())

    def hurry(self) -> None:
        """Stop pacing time."""
        self._rate = None

    def halt(self) -> None:
        """Stop time for good."""
        self._is_running = False

    def _next(self) -> float | None:
        """Return the next instant [s], or None while time stands still."""
        if not self._is_running:
            return None
        times = [value for value in (self._scheduler.next_due(), self._deadline) if value is not None]
        return min(times, default=None)

    def _pause(self) -> float:
        following = self._next()
        if following is None:
            return BEAT
        if self._rate is None:
            return 0.0
        robot, real = self._origin
        return real + (following - robot) / self._rate - time.monotonic()

    def _advance(self) -> None:
        if self._pause() <= 0 and (following := self._next()) is not None:
            self._clock.advance_to(max(following, self._clock.now()))
        self._run_present()


class ExternalDriver(Driver):
    """Robot time follows `receive`, event by event, so that a step runs for each instant at which it was due.

    `turned` is called when outside time stops, runs again or has jumped.
    """

    _clock: ExternalClock

    def __init__(
        self,
        scheduler: Scheduler,
        clock: ExternalClock,
        inbox: CallbackInbox,
        channel: Channel,
        driven: Driven,
        turned: Callable[[Turn], None],
    ) -> None:
        super().__init__(scheduler, inbox, channel, driven)
        self._clock, self._turned = clock, turned
        self._real: Clock | None = None  # counts from `follow` on

    def follow(self, real: Clock) -> None:
        """Begin to follow: from now on `receive` is called, or time stands still. `real` counts from now."""
        self._real = real

    def receive(self, outside: int) -> None:
        """Receive outside time [ns]."""
        if self._real is not None:
            self._follow_turn(self._clock.receive(outside, real=self._real.now()))

    def _follow_turn(self, turn: Turn | None) -> None:
        if turn is not None:
            self._turned(turn)

    def _pause(self) -> float:
        return 0.0 if self._clock.now() < self._clock.limit else LOOK

    def _advance(self) -> None:
        self._run_present()
        if self._real is not None:
            self._follow_turn(self._clock.look(real=self._real.now()))
        until = time.monotonic() + SLICE
        while self._clock.now() < self._clock.limit and time.monotonic() < until:
            due = self._scheduler.next_due()
            following = self._clock.limit if due is None else min(due, self._clock.limit)
            self._clock.advance_to(max(following, self._clock.now()))
            self._run_present()
        self._run_present()


BEATS = 6  # of the process between two calls
LONGEST_CALL = 2 * BEATS * BEAT  # [s] for an answer; a call is over by then


class PeerChecker:
    """The part of one process: calls are answered in Zenoh's threads, since they test the session."""

    def __init__(self, transport: Transport, robot: str, host: str, name: str) -> None:
        self._transport, self._key = transport, roll_key(robot, host)
        self._roll = PeerCheck(name)
        self._beats = 0
        self._call: Closable | None = None
        self._answers: list[bytes] = []
        transport.serve(self._key, self._answer)

    def beat(self) -> list[str]:
        """Count a beat of the process; when due, judge the last call, and call again.

        Returns the processes that others reach and this session does not, if it must be opened again.
        """
        self._beats += 1
        if self._beats % BEATS:
            return []
        lost: list[str] = []
        if self._call is not None:
            self._call.close()
            lost = self._roll.judge(list(self._answers))
        answers = self._answers = []

        def answered(given: TransportReply) -> None:
            if not given.error:
                answers.append(given.payload)

        self._call = self._transport.ask(self._key, b"", b"", answered, of_all=True, within=LONGEST_CALL)
        return lost

    def _answer(self, question: Question) -> None:
        question.reply(self._roll.answer, b"")


LIFELINE_BEATS = 3  # of the process between two probes: three misses and the new session take less than 4 s
LONGEST_PROBE = 4.0  # [s] for an answer; a probe is over by then
LONGEST_CLOSE = 1.0  # [s] for closing a session; Zenoh may hang in it
FIRST_PAUSE, LONGEST_PAUSE = 2, 120  # beats until the next try, if no session can be opened
KNOCK = 0.05  # [s] to wait for a connection on the loopback interface

Post = Callable[[str, Callable[[], None]], None]


def answer(question: Question) -> None:
    """Answer a probe."""
    question.reply(b"", b"")


class Lifeline:
    """Sends a probe every `BEATS` beats of its process, and answers those of others.

    Closing and opening a session may block and have a thread of their own; all else runs in the scheduler's thread.
    """

    def __init__(
        self,
        robot: str,
        transport: RenewableTransport,
        reopen: Callable[[], Transport],
        router: str,
        *,
        roll: PeerChecker | None,
        owns_router: bool,
        post: Post,
        log: Callable[[str], None],
    ) -> None:
        """Take the endpoint of the router, and whether it is the robot's own, which answers probes.

        `roll` is called over `transport`, where processes have links with each other that may be lost.
        `reopen` returns the transport over a new session, `post` runs a callback in the scheduler's thread.
        """
        self._key, self._transport, self._reopen, self._router = probe_key(robot), transport, reopen, router
        self._post, self._log = post, log
        self._probe = Probe(expects_router=owns_router)
        self._beats = 0
        self._sent: _Sent | None = None
        self._is_changing = False
        self._pause, self._retry = FIRST_PAUSE, 0  # beats
        self._has_hung = False  # the old session, while closing
        transport.serve(self._key, answer)
        self._roll = roll

    def beat(self) -> None:
        """Count a beat of the process; when due, evaluate the last probe and send the next one."""
        self._beats += 1
        if self._is_changing:
            if self._retry:
                self._retry -= 1
                if not self._retry:
                    Thread(target=self._open, name="renewal", daemon=True).start()
            return
        if self._roll is not None and (lost := self._roll.beat()):
            self._renew(f"does not reach {' and '.join(lost)} any more, as others do")
            return
        if self._beats % LIFELINE_BEATS:
            return
        if self._sent is not None:
            result = self._sent.close()
            is_router_up = result is ProbeResult.NOBODY and accepts(self._router, KNOCK)
            if self._probe.judge(result, is_router_up=is_router_up):
                self._renew("no longer carries anything")
                return
        self._sent = _Sent(self._transport, self._key, of_all=self._probe.is_in_doubt)

    @property
    def result(self) -> ProbeResult:
        """Return the result of the current probe so far."""
        return self._sent.result if self._sent is not None else ProbeResult.NOTHING

    def _renew(self, why: str) -> None:
        self._log(f"the session on the bus {why}; opening it again")
        self._is_changing, self._sent = True, None
        old = self._transport.detach()
        Thread(target=self._replace, args=(old,), name="renewal", daemon=True).start()

    def _replace(self, old: Transport) -> None:
        closing = Thread(target=_close, args=(old,), name="closing", daemon=True)
        closing.start()
        closing.join(LONGEST_CLOSE)
        self._has_hung = closing.is_alive()
        self._open()

    def _open(self) -> None:
        try:
            new = self._reopen()
        except Exception as error:  # whatever it is: without another try the process would stay alone
            words = f"{type(error).__name__}: {error}"
            self._post("", lambda: self._put_off(words))
        else:
            self._post("", lambda: self._attach(new))

    def _put_off(self, words: str) -> None:
        self._log(f"no session on the bus can be opened ({words}); trying again in {self._pause * BEAT:g} s")
        self._retry, self._pause = self._pause, min(2 * self._pause, LONGEST_PAUSE)

    def _attach(self, new: Transport) -> None:
        self._is_changing, self._pause = False, FIRST_PAUSE
        self._transport.attach(new)
        self._log(f"the session on the bus is new{', the old one hangs while closing' if self._has_hung else ''}")


def _close(old: Transport) -> None:
    with suppress(zenoh.ZError):  # it is stuck, and abandoned
        old.close()


class _Sent:
    """A probe that was sent."""

    def __init__(self, transport: Transport, key: str, *, of_all: bool) -> None:
        self.result = ProbeResult.NOTHING
        self._asked = transport.ask(key, b"", b"", self._answered, of_all=of_all, within=LONGEST_PROBE)

    def close(self) -> ProbeResult:
        """Stop waiting and return the result."""
        result = self.result
        self._asked.close()
        return result

    def _answered(self, given: TransportReply) -> None:
        # In a thread of the transport, so that a loop which is busy for a while does not miss it.
        if not given.error:
            self.result = ProbeResult.ANSWER
        elif self.result is not ProbeResult.ANSWER:  # each query ends with an error, even after its answers
            self.result = ProbeResult.NOBODY


_STARVED = 1.0  # [s] of waiting for a processor, after which a router that does not answer may be late as well


def open_bus(
    plan: Plan,
    name: str,
    router: str,
    scheduler: Scheduler,
    clock: Clock,
    inbox: CallbackInbox,
    turns: Turns,
    log: Callable[[str, str], None],
    tape: Tape | None = None,
) -> tuple[Bus, Lifeline, Transport]:
    """Open the Zenoh session of process `name`, which finds the robot's others at `router`, and the bus over it.

    Returns the bus, the watch over its session, and the transport between them.
    """

    is_lone = plan.bus.links == "router"

    def opened() -> ZenohTransport:
        session = _open_lone(router) if is_lone else open_peer(router)
        return ZenohTransport(session, inbox.put, turns)

    if reason := shared_memory.problem():
        log("robot", f"large messages are sent without shared memory: {reason}")
    transport = RenewableTransport(opened())
    bus = Bus(
        scheduler,
        clock,
        domain=plan.bus.domain,
        namespace=plan.bus.namespace,
        wire=plan.bus.wire,
        transport=tape.around(transport) if tape else transport,
        witness=tape.witness if tape else None,
        log=log,
    )
    lifeline = Lifeline(
        plan.robot,
        transport,
        opened,
        router,
        roll=None if is_lone else PeerChecker(transport, plan.robot, plan.share.host if plan.share else "", name),
        owns_router=plan.bus.router is None,
        post=inbox.put,
        log=lambda text: log("robot", text),
    )
    return bus, lifeline, transport


def _open_lone(router: str) -> zenoh.Session:
    """Open a session at `router`; as often as it takes, while this machine has too much to do.

    Raises:
        OSError: if the router does not answer.
    """
    while True:
        before = waits_of(os.getpid())
        try:
            return open_lone(router)
        except OSError:
            if longest_wait(before, waits_of(os.getpid())) < _STARVED:
                raise
