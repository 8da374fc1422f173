"""The thread of a component that may block: its calls, its ports and its context."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from queue import SimpleQueue
from typing import Any

from rbxcompose.base.clock import Clock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Query
from rbxcompose.sdk.bound import Window
from rbxcompose.sdk.component import BusAddress, Context, RobotEvent
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, ServesAction
from rbxcompose.sdk.updater import DiagnosticTask

LONG = 1.0  # [s] in one call, after which diagnostics report it
LONGEST = 30.0  # [s] in one call, after which the component has failed and its thread is left behind
CONFIGURE, ACTIVATE = "configure", "activate"  # the calls that may take as long as the component says

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
        failed: Callable[[BaseException], None],
        configures_within: float = LONGEST,
    ) -> None:
        """Take `post`, with which any thread can run a callback in the scheduler's thread for `owner`.

        The calls `configure` and `activate` may take `configures_within` [s], all others take at most `LONGEST`.
        """
        self._configures_within = configures_within
        self._owner, self._clock, self._failed = owner, clock, failed
        self.post = post
        self._waiting: list[_Waiting] = []
        self._label = ""  # of the call that runs
        self._since = 0.0  # [s] of robot time
        self.is_closed = False
        self._last: Call | None = None
        self._calls: SimpleQueue[Call | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name=owner, daemon=True)
        self._thread.start()

    @property
    def is_busy(self) -> bool:
        """Return whether the component belongs to the thread now."""
        return bool(self._label)

    def submit(self, label: str, call: Call, depth: int | None = None) -> None:
        """Queue `call`; if `depth` calls with this label are waiting already, drop the oldest of them."""
        if self.is_closed:
            return
        same = [one for one in self._waiting if one.label == label]
        if depth is not None and len(same) >= depth:
            self._waiting.remove(same[0])
        self._waiting.append(_Waiting(label, call))
        self._hand_over()

    def send(self, call: Call) -> None:
        """Run `call` in the scheduler's thread, unless the component is gone by then. Any thread may call this."""
        self.post(self._owner, lambda: None if self.is_closed else call())

    def busy_for(self) -> tuple[str, float]:
        """Return the label of the current call, and how long it has been running [s]."""
        return (self._label, self._clock.now() - self._since) if self.is_busy else ("", 0.0)

    def has_to(self, label: str) -> bool:
        """Return whether a call with this label runs or waits for its turn."""
        return self._label == label or any(one.label == label for one in self._waiting)

    def look(self) -> str:
        """Return in words which call takes long, empty if none does; a call that takes too long is a failure."""
        label, seconds = self.busy_for()
        most = self._configures_within if label in (CONFIGURE, ACTIVATE) else LONGEST
        if seconds > most and not self.is_closed:
            error = HungError(f"{label} has not returned for {most:g} s")
            error.add_note(self._stack())
            self._failed(error)
        return f"has been in {label} for {seconds:.0f} s" if seconds > LONG else ""

    def close(self, patience: float, last: Call | None = None) -> bool:
        """Drop the waiting calls, run `last` and end the thread; return whether it has ended within `patience` [s]."""
        self.is_closed = True
        self._waiting.clear()
        self._last = last
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
            error: BaseException | None = None
            try:
                call()
            except BaseException as raised:  # whatever a component raises is its own failure, and reported as such
                error = raised
            self.post(self._owner, lambda error=error: self._returned(error))  # type: ignore[misc]
        if self._last is not None:
            self._last()

    def _returned(self, error: BaseException | None) -> None:
        self._label = ""
        if self.is_closed:
            return
        if error is not None:
            self._failed(error)
        self._hand_over()

    def _stack(self) -> str:
        frame = sys._current_frames().get(self._thread.ident or 0)
        return "".join(traceback.format_stack(frame)) if frame is not None else ""


def handed_over(end: Any, port: Port[Any], worker: Worker) -> Any:
    """Return an end of the bus for use in the worker's thread."""
    match port:
        case Port(is_elsewhere=True):
            return end
        case Out():
            return _Sender(end, worker)
        case Calls():
            return _Caller(end, worker)
        case CallsAction():
            return _ActionCaller(end, worker)
        case ServesAction():
            return _ActionServer(end, worker)
        case _:
            return end  # it is read only


def _answering(worker: Worker, label: str, then: Callable[[Any], None]) -> Callable[[Any], None]:
    return lambda reply: worker.submit(label, partial(then, reply))


class _Sender:
    """A publisher."""

    def __init__(self, end: Any, worker: Worker) -> None:
        self._end, self._worker = end, worker

    @property
    def is_wanted(self) -> bool:
        return bool(self._end.is_wanted)

    def __call__(self, message: Any, /) -> None:
        self._worker.send(partial(self._end, message))


class _Caller:
    """A client of a service."""

    def __init__(self, end: Any, worker: Worker) -> None:
        self._end, self._worker = end, worker

    @property
    def is_available(self) -> bool:
        return bool(self._end.is_available)

    def __call__(self, request: Any, then: Callable[[Any], None], /, *, timeout: float = 5.0) -> None:
        answered = _answering(self._worker, "a reply", then)
        self._worker.send(lambda: self._end(request, answered, timeout=timeout))


class _ActionCaller(_Caller):
    """A client of an action."""

    def __call__(  # type: ignore[override]
        self, goal: Any, then: Callable[[Any], None], feedback: Callable[[Any], None] | None = None, /
    ) -> _SentGoal:
        ended = _answering(self._worker, "the end of a goal", then)
        last = _answering(self._worker, "feedback", feedback) if feedback is not None else None
        sent = _SentGoal(self._worker)
        self._worker.send(lambda: sent.follow(self._end(goal, ended, last)))
        return sent


class _SentGoal:
    """A goal that is sent as soon as the scheduler gets to it."""

    def __init__(self, worker: Worker) -> None:
        self._worker = worker
        self._goal: Any = None

    def follow(self, goal: Any) -> None:
        """Attach the goal that was sent; called in the scheduler's thread."""
        self._goal = goal

    def cancel(self) -> None:
        """Request the server to end the goal."""
        self._worker.send(lambda: self._goal.cancel())


class _ActionServer:
    """The current goal of a server."""

    def __init__(self, end: Any, worker: Worker) -> None:
        self._end, self._worker = end, worker
        self._current: _ServedGoal | None = None

    @property
    def current(self) -> _ServedGoal | None:
        goal = self._end.current
        if goal is None:
            return None
        if self._current is None or self._current.goal is not goal:
            self._current = _ServedGoal(goal, self._worker)
        return None if self._current.has_ended else self._current


class _ServedGoal:
    """A goal; its end is known here before the scheduler has processed it."""

    def __init__(self, goal: Any, worker: Worker) -> None:
        self.goal, self._worker = goal, worker
        self.has_ended = False

    @property
    def request(self) -> Any:
        return self.goal.request

    @property
    def cancel_requested(self) -> bool:
        return bool(self.goal.cancel_requested)

    @property
    def is_paused(self) -> bool:
        return bool(self.goal.is_paused)

    def feedback(self, message: Any, /) -> None:
        self._worker.send(lambda: self.goal.feedback(message))

    def succeeded(self, result: Any = None, /) -> None:
        self._end(lambda: self.goal.succeeded(result))

    def aborted(self, reason: str = "", result: Any = None, /) -> None:
        self._end(lambda: self.goal.aborted(reason, result))

    def canceled(self, result: Any = None, /) -> None:
        self._end(lambda: self.goal.canceled(result))

    def _end(self, how: Callable[[], None]) -> None:
        self.has_ended = True
        self._worker.send(how)


class HandedOver:
    """The context of the component: what the runtime provides besides its ports."""

    def __init__(self, context: Context, worker: Worker) -> None:
        self.clock: Clock = context.clock
        self._context, self._worker = context, worker

    @property
    def is_stopped(self) -> bool:
        """Return whether the robot is held by a stop."""
        return self._context.is_stopped

    @property
    def starts_mission(self) -> bool:
        """Return whether the mission of `start` is to start."""
        return self._context.starts_mission

    @property
    def is_again(self) -> bool:
        """Return whether the component was already started since the robot came up."""
        return self._context.is_again

    @property
    def is_over(self) -> bool:
        """Return whether nobody waits any more for the call that runs."""
        return self._worker.is_closed

    @property
    def address(self) -> BusAddress:
        """Return where the robot is on the bus."""
        return self._context.address

    def log(self, level: Level, text: str) -> None:
        """Write one event of the robot's story."""
        self._worker.send(lambda: self._context.log(level, text))

    def status(self, level: Level, message: str, values: Mapping[str, object]) -> None:
        """Report the component's state to diagnostics."""
        self._worker.send(lambda: self._context.status(level, message, values))

    def watch(self, name: str, task: DiagnosticTask) -> None:
        """Report how `task` stands to diagnostics, once a second."""
        self._worker.send(lambda: self._context.watch(name, task))

    def wake_at(self, time: float) -> None:
        """Call the component's `wake` at robot time `time` [s]."""
        self._worker.send(lambda: self._context.wake_at(time))

    def notify(self, event: RobotEvent) -> None:
        """Report something that concerns the whole robot to the supervisor."""
        self._worker.send(lambda: self._context.notify(event))

    def repeat(self, requests: Sequence[Command]) -> None:
        """Send these to the component again after it was restarted."""
        self._worker.send(lambda: self._context.repeat(requests))

    def window(self, path: str, question: Query[Any]) -> Window:
        """Open a window for tools outside at `path`."""
        return _Window(self._context, self._worker, path, question)

    def listen(self, port: In[Any]) -> None:
        """Subscribe to the topic of an input."""
        self._worker.send(lambda: self._context.listen(port))

    def mute(self, name: str) -> None:
        """End the subscription of an input."""
        self._worker.send(lambda: self._context.mute(name))


class _Window:
    """A window that the scheduler's thread opens as soon as it gets to it."""

    def __init__(self, context: Context, worker: Worker, path: str, question: Query[Any]) -> None:
        self._worker = worker
        self._window: Window | None = None
        worker.send(lambda: self._open(context, path, question))

    @property
    def is_watched(self) -> bool:
        return self._window is not None and self._window.is_watched

    def put(self, value: object, /) -> None:
        self._worker.send(lambda: self._put(value))

    def _open(self, context: Context, path: str, question: Query[Any]) -> None:
        self._window = context.window(path, question)

    def _put(self, value: object) -> None:
        if self._window is not None:
            self._window.put(value)
