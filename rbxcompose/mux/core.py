"""Selects which of several command sources is let through: the live, unlocked one with the highest priority.

The mux forwards, it never repeats: each subscriber keeps a deadline of its own, and a repeated command would add a
second one to it. All times are robot time [s] at which something reached the mux; stamps inside messages do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Generic, TypeVar

from rbxcompose.dataclass import dataclass

M = TypeVar("M")


@dataclass(frozen=True, slots=True)
class MuxSource:
    """A source that is expected to send repeatedly: after more than `timeout` [s] of silence it counts as gone."""

    priority: int
    timeout: float


class MuxCore(Generic[M]):
    """Lets one input through, with the latched lock `stop` above all of them.

    `inputs` carry messages. `locks` carry heartbeats: a silent one locks every input with a priority below its own.
    `zero` is the message that commands rest. `stopped=True` is for a mux that was stopped when its process died.
    """

    def __init__(
        self,
        inputs: Mapping[str, MuxSource],
        *,
        zero: M,
        is_zero: Callable[[M], bool],
        locks: Mapping[str, MuxSource] | None = None,
        stopped: bool = False,
    ) -> None:
        self._inputs = dict(inputs)
        self._locks = dict(locks or {})
        self._zero = zero
        self._is_zero = is_zero
        self._stopped = stopped
        self._closed = False
        self._held = False
        # Last moment at which a source is live. Who was sending before a restart is unknown, so all count as live then.
        self._input_until = dict.fromkeys(self._inputs, math.inf if stopped else -math.inf)
        self._lock_until = dict.fromkeys(self._locks, -math.inf)
        self._neutral: set[str] = set()  # inputs whose last message was zero
        self._waiting: set[str] = set()  # inputs that must come to rest once before they count again
        self._active: str | None = None
        self._owes_zero = False  # something was let through, and has not been followed by a zero of our own
        self._now = -math.inf

    def take_over(self, old: MuxCore[M]) -> None:
        """Copy when inputs and locks of the same names were last received, and which must come to rest once."""
        self._input_until |= {name: until for name, until in old._input_until.items() if name in self._inputs}
        self._lock_until |= {name: until for name, until in old._lock_until.items() if name in self._locks}
        self._neutral = old._neutral & self._inputs.keys()
        self._waiting = old._waiting & self._inputs.keys()

    @property
    def active(self) -> str | None:
        """The input let through as of the last call; None if there is none."""
        return self._active

    @property
    def stopped(self) -> bool:
        """Return whether the lock `stop` is latched."""
        return self._stopped

    def receive(self, name: str, message: M, now: float) -> M | None:
        """Receive a message of input `name`; return it if it must be forwarded, else None."""
        was_silent = now > self._input_until[name]
        self._neutral.discard(name)
        if self._is_zero(message):
            self._neutral.add(name)
        if was_silent or name in self._neutral:
            self._waiting.discard(name)
        self._input_until[name] = now + self._inputs[name].timeout
        self._settle(now)
        if self._active != name:
            return None
        self._owes_zero = True
        return message

    def heartbeat(self, lock: str, now: float) -> None:
        """Receive a heartbeat of `lock`: it blocks nothing until it has been silent for its timeout."""
        self._lock_until[lock] = now + self._locks[lock].timeout
        self._settle(now)

    def tick(self, now: float) -> M | None:
        """Return a zero, once, when the input that was let through has ended and no other is live."""
        self._settle(now)
        if self._active is not None or not self._owes_zero:
            return None
        self._owes_zero = False
        return self._zero

    def next_deadline(self) -> float | None:
        """Return when `tick` must be called if nothing is received before [s]; None if never.

        It is the first moment after a timeout: exactly at its timeout a source still counts as live.
        """
        if self._active is None and self._owes_zero:
            return self._now
        if self._is_shut:
            return None
        ends = (*self._input_until.values(), *self._lock_until.values())
        return min((math.nextafter(end, math.inf) for end in ends if self._now <= end < math.inf), default=None)

    def stop(self, now: float) -> M:
        """Latch the lock `stop`; return the zero to send immediately."""
        self._stopped = True
        self._settle(now)
        self._owes_zero = False
        return self._zero

    def release(self, now: float) -> None:
        """Open the lock `stop`. This moves nothing: an input that still commands motion must come to rest once.

        To do that, its last message must be zero, or it must be silent for its timeout.
        """
        if self._stopped:
            self._stopped = False
            for name, source in self._inputs.items():
                if self._input_until[name] >= now and name not in self._neutral:
                    self._waiting.add(name)
                    self._input_until[name] = min(self._input_until[name], now + source.timeout)
        self._settle(now)

    def hold(self, now: float) -> M:
        """Let nothing through until `resume`; return the zero to send immediately."""
        self._held = True
        self._settle(now)
        self._owes_zero = False
        return self._zero

    def resume(self, now: float) -> None:
        """Let new messages through again: inputs and locks received before count as silent.

        An input that had to come to rest once still has to.
        """
        self._held = False
        self._input_until.update((name, -math.inf) for name in self._inputs if name not in self._waiting)
        self._lock_until = dict.fromkeys(self._locks, -math.inf)
        self._settle(now)

    def close(self, now: float) -> M:
        """Shut down: return one last zero, after which neither `receive` nor `tick` returns a message."""
        self._closed = True
        self._settle(now)
        self._owes_zero = False
        return self._zero

    def locked_out(self, now: float) -> list[str]:
        """Return the inputs locked for lack of a heartbeat; none while the mux is stopped or held.

        Shutting down does not cure a lock, so a closed mux still reports them.
        """
        if self._stopped or self._held:
            return []
        floor = self._floor(now)
        return [name for name, one in self._inputs.items() if one.priority < floor]

    def refused(self, now: float) -> list[str]:
        """Return the inputs that are locked but still sending."""
        locked = [] if self._closed else self.locked_out(now)
        return [name for name in locked if self._is_live(name, now) and name not in self._waiting]

    def why(self, now: float) -> str:
        """Return a sentence for people on what controls the output at `now`.

        It has no times: each message of a source would make them wrong, and no status is worth sending that often.
        """
        if self._closed:
            return "closed: the robot is going down"
        if self._stopped:
            return "stopped"
        if self._held:
            return "held: robot time stands still"
        told = [self._who_holds(now), *([self._who_locks(now)] if self.locked_out(now) else [])]
        return "; ".join(filter(None, told)) or "no input"

    def _who_holds(self, now: float) -> str:
        winner = self._winner(now)
        if winner is not None:
            return f"{winner} holds"
        resting = [name for name in self._inputs if self._is_live(name, now) and name in self._waiting]
        return f"{' and '.join(resting)} must come to rest once after the stop" if resting else ""

    def _who_locks(self, now: float) -> str:
        silent, out = self._silent_locks(now), self.locked_out(now)
        locks = f"{' and '.join(silent)} give{'s' if len(silent) == 1 else ''} no heartbeat"
        return f"{locks}: {' and '.join(out)} {'is' if len(out) == 1 else 'are'} locked out"

    def _settle(self, now: float) -> None:
        self._now = now
        self._active = self._winner(now)

    def _winner(self, now: float) -> str | None:
        if self._is_shut:
            return None
        floor = self._floor(now)
        candidates = [
            name
            for name, source in self._inputs.items()
            if source.priority >= floor and name not in self._waiting and self._is_live(name, now)
        ]
        return max(candidates, key=lambda name: self._inputs[name].priority, default=None)

    @property
    def _is_shut(self) -> bool:
        return self._stopped or self._closed or self._held

    def _floor(self, now: float) -> float:
        """Return the lowest priority that passes."""
        if not self._locks:
            return -math.inf
        return max((self._locks[name].priority for name in self._silent_locks(now)), default=-math.inf)

    def _is_live(self, name: str, now: float) -> bool:
        return now <= self._input_until[name]

    def _silent_locks(self, now: float) -> list[str]:
        return [name for name, until in self._lock_until.items() if now > until]
