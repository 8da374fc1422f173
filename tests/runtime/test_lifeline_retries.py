"""A session that cannot be opened again at once is retried, less and less often, until it can."""

from __future__ import annotations

import threading

from rbxcompose.bus.renewal import RenewableTransport
from rbxcompose.bus.transport import NoTransport, OnReply, Transport
from rbxcompose.runtime.process_group.connection import (
    BEAT,
    FIRST_PAUSE,
    LIFELINE_BEATS,
    LONGEST_PAUSE,
    MISSES,
    Lifeline,
)

OPENED_ANEW = "the session on the bus no longer carries anything; opening it again"


class Deaf(NoTransport):
    """A session on which no question is ever answered."""

    def ask(
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
    ) -> Deaf:
        return self


class Fragile:
    """A process whose session is stuck, and cannot be opened for so many tries; its threads are waited for."""

    def __init__(self, failures: int) -> None:
        self.failures, self.tries = failures, 0
        self.log: list[str] = []
        self.transport = RenewableTransport(Deaf())
        self.lifeline = Lifeline(
            "toys",
            self.transport,
            self._open,
            "tcp/127.0.0.1:1",
            roll=None,
            owns_router=False,
            post=lambda owner, callback: callback(),
            log=self.log.append,
        )

    def _open(self) -> Transport:
        self.tries += 1
        if self.tries <= self.failures:
            raise OSError("too many open files")
        return Deaf()

    def beat(self, times: int = 1) -> None:
        for _ in range(times):
            self.lifeline.beat()
            for thread in threading.enumerate():
                if thread.name in ("renewal", "closing"):
                    thread.join()


def test_it_is_tried_again_and_told_until_there_is_a_session() -> None:
    process = Fragile(failures=2)
    process.beat((MISSES + 1) * LIFELINE_BEATS)
    assert process.tries == 1
    process.beat(FIRST_PAUSE)
    assert process.tries == 2
    process.beat(2 * FIRST_PAUSE - 1)
    assert process.tries == 2
    process.beat()
    assert process.tries == 3
    failed = "no session on the bus can be opened (OSError: too many open files); trying again in"
    first = FIRST_PAUSE * BEAT
    assert process.log == [
        OPENED_ANEW,
        f"{failed} {first:g} s",
        f"{failed} {2 * first:g} s",
        "the session on the bus is new",
    ]


def test_the_pause_grows_to_its_bound_and_is_short_again_after_a_session() -> None:
    process = Fragile(failures=10)
    while "the session on the bus is new" not in process.log:
        process.beat()
    assert process.log[10].endswith(f"in {LONGEST_PAUSE * BEAT:g} s")
    process.failures = process.tries + 1
    while process.log.count(OPENED_ANEW) < 2:
        process.beat()
    assert process.log[-1].endswith(f"in {FIRST_PAUSE * BEAT:g} s")
