"""Processes that plan motions of an arm while its own process plans others. Run as a module, it is such a process.

They are started anew rather than forked, since threads run where the arm is. Each ends with the thread that started it,
or once nobody is at the other end of its socket.
"""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from rbxcompose.base.clock import Clock
from rbxcompose.base.processes import end_with
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks
from rbxcompose.domains.arms.motion.hand_task import PlanJob, Planned
from rbxcompose.domains.arms.motion.numba_cache import is_empty, is_installed

LONGEST = struct.pack("ll", 5, 0)  # [s] and [us] that the other end may take to go on with a message
SPARE = 10.0  # [s] beside the time of two motions, after which one that has not answered hangs
ABANDON = None  # instead of a job


class PlanningProcess:
    """Another process that plans for an arm. Each job has one answer, that of an abandoned one may be None."""

    def __init__(self, config: ArmConfig, warn: Callable[[str], None], now: Callable[[], float]) -> None:
        """Start it; `now` is the time [s] that it plans by, and `warn` logs why it is gone."""
        self._job: PlanJob | None = None
        self._answer: Planned | None = None
        self._sent: Any = None  # the scene that it knows
        self._is_due = True  # an answer, the first one when it is ready
        self._warn, self._name = warn, config.name
        self.patience, self._since = 2 * config.planner.time + SPARE, 0.0  # [s]; when it was asked last
        ours, theirs = socket.socketpair()
        with theirs:
            words = [sys.executable, "-m", __name__, str(theirs.fileno()), str(os.getpid())]
            self._process = subprocess.Popen(words, stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()])
        self._connection: Connection[Any, Any] = Connection(os.dup(ours.fileno()))
        self._send((config, now))  # which may take as long as it needs to begin to read
        with ours:
            for option in (socket.SO_SNDTIMEO, socket.SO_RCVTIMEO):
                ours.setsockopt(socket.SOL_SOCKET, option, LONGEST)

    @property
    def pid(self) -> int:
        """Return its process id."""
        return self._process.pid

    @property
    def is_idle(self) -> bool:
        """Return whether it can begin a job."""
        self._receive()
        return not self._is_due and self._job is None and not self._connection.closed

    def wait(self) -> None:
        """Wait until it can begin its first job, or is gone."""
        while self._is_due and not self._connection.closed:
            self._connection.poll(None)
            self._receive()

    def begin(self, job: PlanJob) -> None:
        """Plan a motion."""
        scene = (job.objects, dict(job.paddings))
        is_known, self._sent = scene == self._sent, scene
        self._job, self._answer, self._is_due, self._since = job, None, True, time.monotonic()
        self._send((job.request, job.others, None if is_known else scene))

    def answer(self, job: PlanJob) -> Planned | None:
        """Return what was planned; None if that is not known yet, or never will be."""
        self._receive()
        if job is not self._job or self._is_due:
            return None
        self._job = None
        return self._answer

    def abandon(self) -> None:
        """Let go of the job."""
        self._job = None
        if self._is_due:
            self._send(ABANDON)

    def close(self) -> None:
        """End it."""
        self._connection.close()
        self._process.kill()
        self._process.wait()

    def _send(self, message: object) -> None:
        if not self._connection.closed:
            try:
                self._connection.send(message)
            except OSError:
                self._lose()

    def _receive(self) -> None:
        try:
            while self._is_due and not self._connection.closed and self._connection.poll():
                self._answer, self._is_due = self._connection.recv(), False
        except (EOFError, OSError):
            self._lose()
        if self._is_due and self._sent is not None and time.monotonic() - self._since > self.patience:
            self._lose("does not answer")

    def _lose(self, how: str = "is gone") -> None:
        if not self._connection.closed:
            self.close()
            self._warn(f"a process that plans for '{self._name}' {how}: there is one less until the arm starts again")


def compile_elsewhere(config: ArmConfig, clock: Clock, info: Callable[[str], None]) -> None:
    """Fill empty caches of compiled code by another process: the memory of compiling, 100 MB, is given back with it."""
    if clock.is_real and is_installed() and is_empty():
        info("compiles what plans for arms, which takes up to a minute the first time on a machine")
        process = PlanningProcess(config, lambda text: None, time.monotonic)
        process.wait()
        process.close()


def planning_processes(config: ArmConfig, clock: Clock, warn: Callable[[str], None]) -> tuple[PlanningProcess, ...]:
    """Start those that an arm wants beside its own, none on a clock that does not run by itself: there all is one."""
    wanted, there = config.planner.processes, len(os.sched_getaffinity(0))
    if config.hand is None or not clock.is_real:
        return ()
    if wanted > there:
        warn(f"'processes' of its planner is {wanted}, and this machine has {there} processors: {there} plan")
    return tuple(PlanningProcess(config, warn, time.monotonic) for _ in range(min(wanted, there) - 1))


def _run(connection: Connection[Any, Any]) -> None:
    """Plan what is asked for until nobody asks any more."""
    config, now = connection.recv()
    works = ArmWorks(config, now)
    connection.send(None)
    while True:
        if (asked := connection.recv()) is ABANDON:
            continue  # it has been answered
        request, others, scene = asked
        if scene is not None:
            works.place_objects(*scene)
        works.kinematics.place(others)
        planning, planned = works.planner.plan(request), None
        while planned is None and not connection.poll():
            try:
                next(planning)
            except StopIteration as ended:
                planned = ended.value
        planning.close()
        connection.send(planned)


if __name__ == "__main__":
    end_with(int(sys.argv[2]), signal.SIGKILL)
    with suppress(EOFError, ConnectionError):
        _run(Connection(int(sys.argv[1])))
