"""Which of several sources of commands is let through: the live, unlocked one of the largest priority.

The mux forwards, it never repeats: whoever listens keeps a deadline of its own, and a repeated command would add a
second one to it. All times are robot time [s] at which something reached the mux; stamps inside messages do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

M = TypeVar("M")


@dataclass(frozen=True, slots=True)
class Source:
    """Something that is heard of again and again: silent for more than `timeout` [s] it counts as gone."""

    priority: int
    timeout: float


class MuxCore(Generic[M]):
    """Lets one input through, with the latched lock `stop` above all of them.

    `inputs` carry messages. `locks` carry heartbeats: one that is silent locks every input of a priority below its own.
    `zero` is the message for standing still. `stopped=True` is for a mux that was stopped when its process died.
    """

    def __init__(
        self,
        inputs: Mapping[str, Source],
        *,
        zero: M,
        is_zero: Callable[[M], bool],
        locks: Mapping[str, Source] | None = None,
        stopped: bool = False,
    ) -> None:
        self._inputs = dict(inputs)
        self._locks = dict(locks or {})
        self._zero = zero
        self._is_zero = is_zero
        self._stopped = stopped
        self._closed = False
        # Last moment at which a source is live. Who was talking before a restart is unknown, so then all count as live.
        self._input_until = dict.fromkeys(self._inputs, math.inf if stopped else -math.inf)
        self._lock_until = dict.fromkeys(self._locks, -math.inf)
        self._neutral: set[str] = set()  # inputs whose last message was zero
        self._waiting: set[str] = set()  # inputs that must come to rest once before they count again
        self._active: str | None = None
        self._owes_zero = False  # something was let through, and no zero of our own has followed
        self._now = -math.inf

    @property
    def active(self) -> str | None:
        """The input that is let through, as of the last call; None if there is none."""
        return self._active

    @property
    def stopped(self) -> bool:
        """Tell whether the lock `stop` is latched."""
        return self._stopped

    def receive(self, name: str, message: M, now: float) -> M | None:
        """Take a message of input `name`; return it if it is to be forwarded, else None."""
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
        """Take a sign of life of `lock`: it holds nothing back until it has been silent for its timeout."""
        self._lock_until[lock] = now + self._locks[lock].timeout
        self._settle(now)

    def tick(self, now: float) -> M | None:
        """Return a zero, once, when what was let through has ended and nothing else lives."""
        self._settle(now)
        if self._active is not None or not self._owes_zero:
            return None
        self._owes_zero = False
        return self._zero

    def next_deadline(self) -> float | None:
        """Return when `tick` must be called if nothing is heard before [s]; None if never.

        It is the first moment after the timeout: exactly at its timeout a source still counts as live.
        """
        if self._active is None:
            return self._now if self._owes_zero else None
        priority = self._inputs[self._active].priority
        ends = [self._lock_until[name] for name, lock in self._locks.items() if lock.priority > priority]
        return math.nextafter(min([self._input_until[self._active], *ends]), math.inf)

    def stop(self, now: float) -> M:
        """Latch the lock `stop`; return the zero that is to be sent at once."""
        self._stopped = True
        self._settle(now)
        self._owes_zero = False
        return self._zero

    def release(self, now: float) -> None:
        """Open the lock `stop`. It moves nothing: an input that still wants to move must come to rest once.

        That is to have sent zero as its last message, or to be silent for its timeout.
        """
        if self._stopped:
            self._stopped = False
            for name, source in self._inputs.items():
                if self._input_until[name] >= now and name not in self._neutral:
                    self._waiting.add(name)
                    self._input_until[name] = min(self._input_until[name], now + source.timeout)
        self._settle(now)

    def close(self, now: float) -> M:
        """Go down: return one last zero, after which neither `receive` nor `tick` lets anything out."""
        self._closed = True
        self._settle(now)
        self._owes_zero = False
        return self._zero

    def why(self, now: float) -> str:
        """Say in one sentence for people what holds the output at `now`."""
        if self._closed:
            return "closed: the robot is going down"
        if self._stopped:
            return "stopped"
        winner = self._winner(now)
        if winner is not None:
            return f"{winner} holds until {self._input_until[winner]:.2f} s"
        live = [name for name in self._inputs if self._is_live(name, now)]
        locked = [name for name in live if name not in self._waiting]
        if locked:
            return f"{' and '.join(self._silent_locks(now))} locked: no heartbeat"
        if live:
            return f"{' and '.join(live)} must come to rest once after the stop"
        return "no input"

    def _settle(self, now: float) -> None:
        self._now = now
        self._active = self._winner(now)

    def _winner(self, now: float) -> str | None:
        if self._stopped or self._closed:
            return None
        floor = max((self._locks[name].priority for name in self._silent_locks(now)), default=-math.inf)
        candidates = [
            name
            for name, source in self._inputs.items()
            if source.priority >= floor and name not in self._waiting and self._is_live(name, now)
        ]
        return max(candidates, key=lambda name: self._inputs[name].priority, default=None)

    def _is_live(self, name: str, now: float) -> bool:
        return now <= self._input_until[name]

    def _silent_locks(self, now: float) -> list[str]:
        return [name for name, until in self._lock_until.items() if now > until]
