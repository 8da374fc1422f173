"""Selects which of several command sources is let through, below latches and locks that no source can pass.

The mux forwards, it never repeats: each subscriber keeps a deadline of its own, and a repeated command would add a
second one to it. All times are robot time [s] at which something reached the mux; stamps inside messages do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Generic, TypeVar

from rbxcompose.mux.arbiters import Arbiter, ByPriority
from rbxcompose.mux.locks import MuxLocks
from rbxcompose.mux.sources import LockSource, MuxEndings, MuxSource, Ramp

M = TypeVar("M")


def _never(message: object) -> bool:
    return False


class MuxCore(Generic[M]):
    """Lets one input through, with the latched lock `stop` above all of them.

    `zero` makes the message that commands rest from the last one that came out, or from None. It is None itself for
    messages that have no rest: then the mux sends none of its own. `stopped` is for a mux that was stopped when its
    process died.
    """

    def __init__(
        self,
        inputs: Mapping[str, MuxSource],
        *,
        zero: Callable[[M | None], M] | None,
        is_zero: Callable[[M], bool] = _never,
        arbiter: Arbiter | None = None,
        locks: Mapping[str, LockSource] | None = None,
        endings: MuxEndings | None = None,
        handover: Ramp[M] | None = None,
        stopped: bool = False,
    ) -> None:
        self.inputs: dict[str, MuxSource] = {}
        self.locks = MuxLocks(locks or {})
        self.arbiter = arbiter or ByPriority()
        self.is_stopped, self.is_closed, self.is_held = stopped, False, False
        self.waiting: set[str] = set()  # inputs that must come to rest once before they count again
        self.sending_until: dict[str, float] = {}  # when an input is sure to be quiet
        self._zero, self._is_zero, self._endings, self._handover = zero, is_zero, endings or MuxEndings(), handover
        self._shape: M | None = None  # the last message that came out
        self._live_until: dict[str, float] = {}  # last moment at which an input is live
        self._neutral: set[str] = set()  # inputs whose last message was zero
        self._active: str | None = None
        self._last: tuple[str, M] | None = None  # whose message came out last; None after a zero of our own
        self._stop_at: float | None = None  # when the stop follows the end of the last source
        self._now = -math.inf
        for name, source in inputs.items():
            self.inputs[name] = source
            self._forget(name)
        if stopped:  # who was sending before a restart is unknown, so all count as sending
            self.sending_until = dict.fromkeys(self.inputs, math.inf)

    def take_over(self, old: MuxCore[M]) -> None:
        """Copy when inputs and locks of the same names were last received, what was chosen, and who must rest once."""
        for mine, theirs in ((self._live_until, old._live_until), (self.sending_until, old.sending_until)):
            mine |= {name: until for name, until in theirs.items() if name in self.inputs}
        self.locks.take_over(old.locks, self.inputs)
        self.arbiter.take_over(old.arbiter, list(self.inputs))
        self._neutral = old._neutral & self.inputs.keys()
        self.waiting = old.waiting & self.inputs.keys()

    @property
    def active(self) -> str | None:
        """The input let through as of the last call; None if there is none."""
        return self._active

    # What arrives

    def receive(self, name: str, message: M, now: float) -> M | None:
        """Receive a message of input `name`; return what must be forwarded, None for nothing.

        Raises:
            KeyError: if there is no such input.
        """
        source = self.inputs[name]
        self._settle(now)
        is_zero, was_quiet = self._is_zero(message), now > self.sending_until[name]
        self._neutral.discard(name)
        if is_zero:
            self._neutral.add(name)
        if was_quiet or is_zero:
            self.waiting.discard(name)
        self.sending_until[name] = now + source.quiet
        if is_zero and source.zero_releases:
            return self._let_go(name, message, now)
        self._live_until[name] = now + source.timeout
        self.arbiter.heard(name, self._free(now), self.inputs)
        self._settle(now)
        return self._passed(name, message, now) if self._active == name else None

    def _let_go(self, name: str, message: M, now: float) -> M | None:
        """Return the zero of an input that lets go, if it held the output: it stops by itself what it has begun."""
        held = self._active == name
        self._live_until[name] = -math.inf
        if held:
            self._rests()
        self._settle(now)
        return message if held else None

    def _passed(self, name: str, message: M, now: float) -> M:
        if self._handover is not None:
            if self._last is not None and self._last[0] != name:
                self._handover.begin(self._last[1], now)
            message = self._handover.through(message, now)
        self._last, self._shape = (name, message), message
        return message

    def bound(self, linear: float, angular: float) -> None:
        """Bound hand-overs, also one that goes on, by other limits."""
        if self._handover is not None:
            self._handover.limit(linear, angular)

    def heartbeat(self, lock: str, now: float) -> None:
        """Receive a heartbeat of `lock`: it blocks nothing until it has been silent for its timeout."""
        self.locks.heard(lock, now, is_on=False)
        self._settle(now)

    def flag(self, lock: str, is_on: bool, now: float) -> None:
        """Receive a flag of `lock`: it blocks while it is true."""
        self.locks.heard(lock, now, is_on=is_on)
        self._settle(now)

    # Time

    def tick(self, now: float) -> M | None:
        """Return a zero, once, when the source that was let through has ended, nobody follows it, and it is due."""
        self._settle(now)
        if self._stop_at is None or now < self._stop_at:
            return None
        return self._rests()

    def next_deadline(self) -> float | None:
        """Return when `tick` must be called if nothing is received before [s]; None if never.

        It is the first moment after a timeout: exactly at its timeout a source still counts as live.
        """
        ends: list[float] = list(self.locks.ends()) if not self.is_closed else []
        if not self._is_shut:
            waits = (self.sending_until[name] for name in self.waiting)
            ends += [math.nextafter(end, math.inf) for end in (*self._live_until.values(), *waits) if end < math.inf]
        due = [end for end in ends if self._now < end]
        return min([*due, self._stop_at] if self._stop_at is not None else due, default=None)

    # What people order

    def stop(self, now: float) -> M | None:
        """Latch the lock `stop`; return the zero to send immediately."""
        self.is_stopped = True
        return self._shut(now)

    def release(self, now: float) -> None:
        """Open the lock `stop`. This moves nothing: an input that still commands motion must come to rest once.

        To do that, its last message must be zero, or it must be silent for its timeout.
        """
        if self.is_stopped:
            self.is_stopped = False
            self._must_rest(self.inputs, now)
        self._settle(now)

    def hold(self, now: float) -> M | None:
        """Let nothing through until `resume`; return the zero to send immediately."""
        self.is_held = True
        return self._shut(now)

    def resume(self, now: float) -> None:
        """Let new messages through again: inputs and heartbeats received before count as silent.

        An input that had to come to rest once still has to.
        """
        self.is_held = False
        for name in self.inputs.keys() - self.waiting:
            self._forget(name)
        self.locks.forget()
        self._settle(now)

    def close(self, now: float) -> M | None:
        """Shut down: return one last zero, after which neither `receive` nor `tick` returns a message."""
        self.is_closed = True
        return self._shut(now)

    def select(self, name: str | None, now: float) -> None:
        """Let this input through, or none, in a mux whose inputs are selected."""
        self.arbiter.selected = name
        self._settle(now)

    def lock(self, names: Iterable[str], until: float, now: float) -> None:
        """Hold these inputs back by hand until a time [s], which may be `NEVER`."""
        self.locks.by_hand |= dict.fromkeys(names, until)
        self._settle(now)

    def unlock(self, names: Iterable[str], now: float) -> None:
        """End what was locked by hand: an input goes on at once, as with other locks."""
        for name in names:
            self.locks.by_hand.pop(name, None)
        self._settle(now)

    def add(self, name: str, source: MuxSource, now: float) -> None:
        """Add an input."""
        self.inputs[name] = source
        self._forget(name)
        self._settle(now)

    def delete(self, name: str, now: float) -> None:
        """Remove an input; if it held the output, this is its end."""
        del self.inputs[name], self._live_until[name], self.sending_until[name]
        self.locks.by_hand.pop(name, None)
        self.waiting.discard(name)
        self._settle(now)

    # What is known

    def live_until(self, name: str) -> float:
        """Return the last moment at which an input is live [s], unless it sends again."""
        return self._live_until[name]

    def is_live(self, name: str, now: float) -> bool:
        """Return whether an input counts, or would if it were let."""
        return now <= self._live_until[name]

    def locked_out(self, now: float) -> list[str]:
        """Return the inputs that are locked; none while the mux is stopped or held.

        Shutting down does not cure a lock, so a closed mux still reports them.
        """
        return [] if self.is_stopped or self.is_held else self._locked(now)

    def refused(self, now: float) -> list[str]:
        """Return the inputs that are locked but still sending."""
        locked = [] if self.is_closed else self.locked_out(now)
        return [name for name in locked if self._would_count(name, now)]

    # How it decides

    def _settle(self, now: float) -> None:
        self._now = now
        self._must_rest(self.locks.expire(now), now)
        self._active = None if self._is_shut else self.arbiter.holder(self._free(now), self.inputs)
        if self._last is None or self._is_followed(self._last[0], now):
            self._stop_at = None
        elif self._stop_at is None:
            self._ended(now)

    def _is_followed(self, last: str, now: float) -> bool:
        """Return whether somebody commands still: who sent last, or a holder that sends, too."""
        return self._active is not None and (self._active == last or now <= self.sending_until[self._active])

    def _ended(self, now: float) -> None:
        """Note when the stop is due, now that the last source has ended."""
        is_locked = any(self._would_count(name, now) for name in self._locked(now))
        wait = self._endings.on_lock if is_locked else self._endings.on_idle
        if self._zero is None or wait == math.inf:
            self._rests()
        else:
            self._stop_at = now + wait

    def _rests(self) -> M | None:
        """Note that nothing is left in force of what came out; return the message of rest."""
        self._last = self._stop_at = None
        if self._handover is not None:
            self._handover.end()
        return self._zero(self._shape) if self._zero is not None else None

    def _shut(self, now: float) -> M | None:
        rest = self._rests()
        self._settle(now)
        return rest

    def _must_rest(self, names: Iterable[str], now: float) -> None:
        """Have inputs that still command motion come to rest once before they count again."""
        for name in names:
            if self.sending_until[name] >= now and name not in self._neutral:
                self.waiting.add(name)
                self.sending_until[name] = min(self.sending_until[name], now + self.inputs[name].quiet)

    def _forget(self, name: str) -> None:
        self._live_until[name] = math.inf if self.inputs[name].starts_live else -math.inf
        self.sending_until[name] = -math.inf

    def _free(self, now: float) -> list[str]:
        if self._is_shut:
            return []
        locked = self._locked(now)
        return [name for name in self.inputs if name not in locked and self._would_count(name, now)]

    def _would_count(self, name: str, now: float) -> bool:
        return name not in self.waiting and now <= self._live_until[name]

    def _locked(self, now: float) -> list[str]:
        return self.locks.locked(self.inputs, now)

    @property
    def _is_shut(self) -> bool:
        return self.is_stopped or self.is_closed or self.is_held
