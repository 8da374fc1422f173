"""The thread of a component that may block, and the calls that wait for it.

A component is used by one thread at a time, so that neither it nor its ports need a lock: the scheduler's thread hands
one call over and does not touch the component until the call has returned. What the component sends meanwhile goes
through the inbox of the process, and the scheduler's thread sends it.
"""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable
from queue import SimpleQueue

from rbxcompose.clock import Clock
from rbxcompose.dataclass import dataclass

LONG = 1.0  # [s] in one call, after which diagnostics report it
LONGEST = 30.0  # [s] in one call, after which the component has failed and its thread is left behind
CONFIGURE = "configure"  # the call that may take as long as the component says

Call = Callable[[], None]
Post = Callable[[str, Call], None]


class HungError(Exception):
    """Raised for a component that does not return from a call."""


@dataclass(frozen=True, slots=True)
class _Waiting:
    label: str
    call: Call


class Worker:
    """Runs calls one after the other in a thread of its own; all methods are called from the scheduler's thread."""

    def __init__(
        self,
        owner: str,
        clock: Clock,
        post: Post,
        failed: Callable[[Exception], None],
        configures_within: float = LONGEST,
    ) -> None:
        """Take `post`, with which any thread can run a callback in the scheduler's thread for `owner`.

        The call `configure` may take `configures_within` [s], all others take at most `LONGEST`.
        """
        self._configures_within = configures_within
        self.skipped = 0  # calls dropped in favour of newer ones
        self._owner, self._clock, self._failed = owner, clock, failed
        self._post = post
        self._waiting: list[_Waiting] = []
        self._label = ""  # of the call that runs
        self._since = 0.0  # [s] of robot time
        self._is_closed = False
        self._calls: SimpleQueue[Call | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=owner, daemon=True)
        self._thread.start()

    @property
    def is_busy(self) -> bool:
        """Return whether the component belongs to the thread now."""
        return bool(self._label)

    def submit(self, label: str, call: Call, depth: int | None = None) -> None:
        """Queue `call`; if `depth` calls with this label are waiting already, drop the oldest of them."""
        if self._is_closed:
            return
        same = [one for one in self._waiting if one.label == label]
        if depth is not None and len(same) >= depth:
            self._waiting.remove(same[0])
            self.skipped += 1
        self._waiting.append(_Waiting(label, call))
        self._hand_over()

    def send(self, call: Call) -> None:
        """Run `call` in the scheduler's thread, unless the component is gone by then. Any thread may call this."""
        self._post(self._owner, lambda: None if self._is_closed else call())

    def busy_for(self) -> tuple[str, float]:
        """Return the label of the current call, and how long it has been running [s]."""
        return (self._label, self._clock.now() - self._since) if self.is_busy else ("", 0.0)

    def look(self) -> str:
        """Return in words which call takes long, empty if none does; a call that takes too long is a failure."""
        label, seconds = self.busy_for()
        most = self._configures_within if label == CONFIGURE else LONGEST
        if seconds > most and not self._is_closed:
            error = HungError(f"{label} has not returned for {most:g} s")
            error.add_note(self._stack())
            self._failed(error)
        return f"has been in {label} for {seconds:.0f} s" if seconds > LONG else ""

    def close(self, patience: float) -> bool:
        """Drop the waiting calls and end the thread; return whether it has ended within `patience` [s]."""
        self._is_closed = True
        self._waiting.clear()
        self._calls.put(None)
        if self._thread is not threading.current_thread():
            self._thread.join(patience)
        return not self._thread.is_alive()

    def _hand_over(self) -> None:
        if self._waiting and not self.is_busy:
            following = self._waiting.pop(0)
            self._label, self._since = following.label, self._clock.now()
            self._calls.put(following.call)

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            error: Exception | None = None
            try:
                call()
            except Exception as raised:  # whatever a component raises is its own failure, and reported as such
                error = raised
            self._post(self._owner, lambda error=error: self._returned(error))  # type: ignore[misc]

    def _returned(self, error: Exception | None) -> None:
        self._label = ""
        if self._is_closed:
            return
        if error is not None:
            self._failed(error)
        self._hand_over()

    def _stack(self) -> str:
        frame = sys._current_frames().get(self._thread.ident or 0)
        return "".join(traceback.format_stack(frame)) if frame is not None else ""
