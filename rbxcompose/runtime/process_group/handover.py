"""The ports and the context of a component that runs in a thread of its own.

The component reads directly. What it does to the bus is sent to the scheduler's thread, the only one that touches the
bus; replies are handed over like any other call.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from rbxcompose.clock import Clock
from rbxcompose.diagnostics.updater import DiagnosticTask
from rbxcompose.levels import Level
from rbxcompose.requests import Command, Query
from rbxcompose.robot_events import RobotEvent
from rbxcompose.runtime.process_group.worker import Worker
from rbxcompose.sdk.bound import Window
from rbxcompose.sdk.component import Context
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, ServesAction


def handed_over(end: Any, port: Port[Any], worker: Worker) -> Any:
    """Return an end of the bus for use in the worker's thread."""
    match port:
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
        told = _answering(self._worker, "feedback", feedback) if feedback is not None else None
        sent = _SentGoal(self._worker)
        self._worker.send(lambda: sent.follow(self._end(goal, ended, told)))
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
