"""Turns lent to the threads that bring messages: while the scheduler's own thread rests, they handle what they bring.

To wake another thread costs more than most callbacks. So a message is handled where it arrives, if that keeps every
promise of the scheduler: one callback at a time, in order, on time. The lock of the turn is only ever tried by those
who bring messages: a thread of the bus that waited for us while we wait for the bus would be a deadlock.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial

from rbxcompose.clock import Clock
from rbxcompose.runtime.process_group.inbox import CallbackInbox
from rbxcompose.scheduler import Scheduler

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
        except Exception as error:  # the failure of the component alone, as if it had done it itself
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
            self._slow = {one: until for one, until in self._slow.items() if until > ended}
        return ended


def _raise(error: BaseException) -> None:
    raise error
