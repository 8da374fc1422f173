"""Checks that the session of a process still carries data, and reopens it when it does not.

A session can be stuck for hours while Zenoh considers it healthy. So each process sends a probe over the bus to the
nearest of the others, after a miss to all of them and to the robot's router, and answers the probes of others. Probes
are answered in Zenoh's own thread, because they test the session; signs of life show whether a process's loop runs.
That each reaches all others is told by a roll call.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from threading import Thread

import zenoh

from rbxcompose.bus.probe import Probe, ProbeResult, probe_key
from rbxcompose.bus.renewal import RenewableTransport
from rbxcompose.bus.transport import Question, Transport, TransportReply
from rbxcompose.endpoints import accepts
from rbxcompose.runtime.process_group.driver import BEAT
from rbxcompose.runtime.process_group.roll_caller import RollCaller

BEATS = 3  # of the process between two probes: three misses and the new session take less than 4 s
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
        roll: RollCaller | None,
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
            self._look_whether_to_try()
            return
        if self._roll is not None and (lost := self._roll.beat()):
            self._renew(f"does not reach {' and '.join(lost)} any more, as others do")
            return
        if self._beats % BEATS:
            return
        if self._sent is not None:
            heard = self._sent.close()
            is_router_up = heard is ProbeResult.NOBODY and accepts(self._router, KNOCK)
            if self._probe.judge(heard, is_router_up=is_router_up):
                self._renew("no longer carries anything")
                return
        self._sent = _Sent(self._transport, self._key, of_all=self._probe.is_in_doubt)

    @property
    def heard(self) -> ProbeResult:
        """Return the result of the current probe so far."""
        return self._sent.heard if self._sent is not None else ProbeResult.NOTHING

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

    def _look_whether_to_try(self) -> None:
        if self._retry:
            self._retry -= 1
            if not self._retry:
                Thread(target=self._open, name="renewal", daemon=True).start()

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
        self.heard = ProbeResult.NOTHING
        self._asked = transport.ask(key, b"", b"", self._answered, of_all=of_all, within=LONGEST_PROBE)

    def close(self) -> ProbeResult:
        """Stop waiting and return the result."""
        heard = self.heard
        self._asked.close()
        return heard

    def _answered(self, given: TransportReply) -> None:
        # In a thread of the transport, so that a loop which is busy for a while does not miss it.
        if not given.error:
            self.heard = ProbeResult.ANSWER
        elif self.heard is not ProbeResult.ANSWER:  # each query ends with an error, even after its answers
            self.heard = ProbeResult.NOBODY
