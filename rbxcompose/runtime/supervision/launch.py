"""Starting a supervisor as a process of its own, and receiving its reports on the start and the end."""

import contextlib
import os
import select
import signal
from dataclasses import field
from types import FrameType
from typing import NoReturn, TextIO, get_args

import setproctitle

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.processes import end_with
from rbxcompose.base.requests import Family
from rbxcompose.bus import shared_memory
from rbxcompose.bus.endpoints import unix_endpoint
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime.faults import explain
from rbxcompose.runtime.folder import BrokenStateError, RobotFolder, RobotState, RunOptions, title
from rbxcompose.runtime.log import Record, start_new
from rbxcompose.runtime.processes import Process, boot_id
from rbxcompose.runtime.supervision.conductor import ROBOT_FAILED
from rbxcompose.runtime.supervision.judge import FiledRules
from rbxcompose.runtime.supervision.leftovers import end_leftovers
from rbxcompose.runtime.supervision.prefork import Launch
from rbxcompose.runtime.supervision.supervisor import ENDINGS, Supervisor

FINDINGS = 1  # exit code: nothing was started


@dataclass(frozen=True, slots=True)
class Begun:
    """The log of this run has begun."""


@dataclass(frozen=True, slots=True)
class Up:
    """All components are active but those `blocked`, `seconds` of real time after the start."""

    components: int
    processes: int
    seconds: float
    blocked: list[str] = field(default_factory=list)  # they start after others, which have failed


@dataclass(frozen=True, slots=True)
class AlreadyUp:
    """Another supervisor runs this robot."""

    pid: int | None


@dataclass(frozen=True, slots=True)
class Unsafe:
    """The robot's folder cannot be trusted or written to."""

    reason: str


@dataclass(frozen=True, slots=True)
class RunEnded:
    """The robot is down."""

    exit_code: int
    reason: str
    time: float  # [s] of robot time
    facts: dict[str, dict[str, str]] = field(default_factory=dict)


LaunchReport = Begun | Up | AlreadyUp | Unsafe | RunEnded
_REPORTS: Family[LaunchReport] = Family(get_args(LaunchReport))


class Started:
    """A supervisor started as a child of this process; signals that would end us are passed on to it."""

    def __init__(self, pid: int, reports: int) -> None:
        self.pid = pid
        self._reports = reports
        self._received = b""
        self._previous = {number: signal.signal(number, self._pass_on) for number in ENDINGS}

    def wait_for_report(self, seconds: float | None) -> LaunchReport | None:
        """Return its next report, or None if there is none within `seconds` [s].

        Raises:
            EOFError: if it has ended.
        """
        while b"\n" not in self._received:
            if not select.select([self._reports], [], [], seconds)[0]:
                return None
            chunk = os.read(self._reports, 65536)
            if not chunk:
                raise EOFError("the supervisor has ended")
            self._received += chunk
        line, _, self._received = self._received.partition(b"\n")
        return _REPORTS.from_line(line)

    def let_go(self) -> None:
        """Leave it running on its own."""
        os.close(self._reports)
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def wait(self) -> int:
        """Wait for it to end and return its exit code, negative if a signal has ended it."""
        self.let_go()  # before its pid can be reused
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])

    def _pass_on(self, number: int, frame: FrameType | None) -> None:
        os.kill(self.pid, number)  # it has not been reaped yet, so the pid is still its own


def start_supervisor(plan: Plan, options: RunOptions, rules: FiledRules | None = None) -> Started:
    """Fork the supervisor of a robot. Call it from the main thread, before any other thread exists.

    Live settings keep `rules`. If the run is not detached, the supervisor brings the robot to rest and ends when this
    process ends.
    """
    clock = MonotonicClock()
    ours, theirs = os.pipe2(os.O_CLOEXEC)
    caller = os.getpid()
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDINGS)  # an interrupt waits until its handler is installed
    pid = os.fork()
    if pid == 0:
        os.close(ours)
        _become_supervisor(plan, options, rules, clock, theirs, caller)
    os.close(theirs)
    started = Started(pid, ours)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDINGS)
    return started


def _become_supervisor(
    plan: Plan, options: RunOptions, rules: FiledRules | None, clock: MonotonicClock, pipe: int, caller: int
) -> NoReturn:
    exit_code = ROBOT_FAILED
    try:
        os.setsid()  # signals of the terminal reach the caller, who passes them on
        if not options.is_detached:
            end_with(caller, signal.SIGTERM)
        setproctitle.setproctitle(title(plan.robot, "supervisor"))
        _leave_the_terminal()
        with os.fdopen(pipe, "w", buffering=1) as reports:
            exit_code = _supervise(plan, options, rules, clock, reports)
    finally:
        os._exit(exit_code)


def _leave_the_terminal() -> None:
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(nothing, descriptor)
    os.close(nothing)


def _supervise(
    plan: Plan, options: RunOptions, rules: FiledRules | None, clock: MonotonicClock, reports: TextIO
) -> int:
    folder = RobotFolder.of(plan.robot)
    try:
        folder.make()
        if plan.bus.access == "user":
            unix_endpoint(folder.sockets, "")  # before anything runs, for its path may be too long
        lock = folder.lock()  # ours until this process ends
        if lock is None:
            state = _known_state(folder)
            _report(reports, AlreadyUp(state.supervisor.pid if state else None))
            return FINDINGS
        died = "the previous run was not shut down, its supervisor died: cleaning up"
        warnings = [*([died] if _known_state(folder) else ()), *end_leftovers(folder)]
        folder.sweep()
        log = start_new(folder.path)
        file, supervisor = os.path.realpath(plan.file), Process.of(os.getpid())
        folder.write_state(RobotState(plan.robot, file, supervisor, {}, (), boot=boot_id()))
    except OSError as error:  # it belongs to somebody else, or the disk is full
        _report(reports, Unsafe(str(error)))
        return FINDINGS
    _report(reports, Begun())
    for text in warnings:
        log.write(Record(0.0, Level.WARN, "robot", text))
    ended = _run(Launch(plan, options, log, folder, clock, rules), folder, lock, reports)
    shared_memory.remove_orphans(waits=True)
    folder.clear()
    _report(reports, ended)
    return ended.exit_code


def _known_state(folder: RobotFolder) -> RobotState | None:
    """Return the state of the robot, which its supervisor removes when it ends."""
    with contextlib.suppress(BrokenStateError):  # which is reported where leftovers are ended
        return folder.read_state()
    return None


def _run(launch: Launch, folder: RobotFolder, lock: int, reports: TextIO) -> RunEnded:
    plan, clock = launch.plan, launch.clock

    def report_up() -> None:
        _report(reports, Up(len(plan.instances), len(plan.groups), clock.now(), supervisor.conductor.blocked.unstarted))

    supervisor = Supervisor(launch, folder, lock, report_up)
    try:
        supervisor.run()
    except Exception as error:  # our own bug: nobody reads our stderr, so it is written where people look
        text, detail = explain(error)
        launch.log.write(Record(clock.now(), Level.ERROR, "robot", f"the supervisor failed: {text}", detail))
        end_leftovers(folder)
        return RunEnded(ROBOT_FAILED, f"the supervisor failed: {text}", clock.now())
    conductor = supervisor.conductor
    time = clock.now() if conductor.is_real_time else conductor.time
    return RunEnded(conductor.exit_code, conductor.reason, time, conductor.facts)


def _report(reports: TextIO, report: LaunchReport) -> None:
    with contextlib.suppress(BrokenPipeError):  # a detached robot outlives the process that started it
        reports.write(_REPORTS.to_line(report).decode())
