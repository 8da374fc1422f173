"""Recording a stepped run from within its process. A file that cannot be written ends the recording, never the run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rbxcompose.clock import Clock, MonotonicClock
from rbxcompose.plan.dump import dump
from rbxcompose.plan.model import Plan
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.recorder import Recorder
from rbxcompose.recording.tape import PLAN, Tape
from rbxcompose.recording.topics import RecordedTopic


class Taping:
    """Writes a tape of a robot to a file, with its plan; secrets of the plan are left out."""

    def __init__(self, path: Path, plan: Plan, clock: Clock, log: Callable[[str], None]) -> None:
        """Take the robot's `clock`; `log` is called once with the reason if a recording ends too early."""
        self._path, self._log = path, log
        self._real = MonotonicClock()  # so that a killed recorder loses little
        self._recorder: Recorder | None = None
        self._try(lambda: self._begin(plan))
        self.tape = Tape(clock, self._declare, self._add)

    def keep(self) -> None:
        """Write what is due; must be called several times a second."""
        recorder = self._recorder
        if recorder is not None:
            self._try(lambda: recorder.keep(self._real.now()))

    def finish(self) -> None:
        """End the file, which then has its index and its name."""
        recorder = self._recorder
        if recorder is not None:
            self._try(recorder.finish)
        self._recorder = None

    def _begin(self, plan: Plan) -> None:
        self._recorder = Recorder(self._path, self._real.now())
        self._recorder.attach(PLAN, dump(plan, keeps_order=True).encode())

    def _declare(self, topic: RecordedTopic) -> None:
        recorder = self._recorder
        if recorder is not None:
            self._try(lambda: recorder.declare(topic))

    def _add(self, message: Recorded) -> None:
        recorder = self._recorder
        if recorder is not None:
            self._try(lambda: recorder.add(message))

    def _try(self, action: Callable[[], None]) -> None:
        try:
            action()
        except OSError as error:
            if self._recorder is not None:
                self._recorder.abandon()
            self._recorder = None
            self._log(f"the recording '{self._path}' ends here: {error.strerror or error}")
