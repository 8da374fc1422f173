"""The pre-fork parent: a process with everything imported and nothing running, which forks the process groups.

It is forked from the supervisor while that has one thread, opens no bus and starts no thread. The kernel ends it with
the supervisor and signals the groups to stop when it ends, so that no process outlives a supervisor that was killed.

All processes of a robot share the memory that the supervisor has filled before that fork, until they write to it. So
the supervisor imports what the groups need, though it uses none of it.
"""

import array
import gc
import os
import selectors
import signal
import socket
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import setproctitle

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.garbage_collection import collect_as_usual
from rbxcompose.base.processes import end_with
from rbxcompose.base.requests import Family
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs import registry
from rbxcompose.msgs.action_msgs import CancelGoal, GoalStatusArray
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.msgs.rcl_interfaces import Log
from rbxcompose.msgs.types import Action
from rbxcompose.runtime.channel import Channel
from rbxcompose.runtime.folder import RobotFolder, RunOptions, title
from rbxcompose.runtime.log import LogFile
from rbxcompose.runtime.processes import Process, close_all, give_back_large_memory, in_child
from rbxcompose.runtime.supervision.judge import FiledRules
from rbxcompose.sdk.registry import component_type

ROUTER = "router"  # the process that no plan contains
_MOST = 4096  # [B] of one message
_HELD_BACK = [signal.SIGTERM]  # until a child has installed its handlers


@dataclass(frozen=True, slots=True)
class Launch:
    """What every process of a run shares: plan, options, log, folder for output, start [s, monotonic], rules."""

    plan: Plan
    options: RunOptions
    log: LogFile
    folder: RobotFolder
    clock: MonotonicClock
    rules: FiledRules | None = None

    def title(self, process: str) -> str:
        """Return the title of a process in the system's `ps`."""
        return title(self.plan.robot, process)

    def output(self, process: str) -> Path:
        """Return the file that takes what a process prints."""
        return self.folder.path / f"{process}.out"


@dataclass(frozen=True, slots=True)
class Fork:
    """The order to fork a process group."""

    group: str
    is_restart: bool
    is_stopped: bool


@dataclass(frozen=True, slots=True)
class Forked:
    """A process group has been forked; `descriptor` is its pidfd, which is sent along with the message."""

    group: str
    process: Process
    descriptor: int = -1


@dataclass(frozen=True, slots=True)
class Exited:
    """A process group has ended with this wait status."""

    pid: int
    status: int


_ORDERS: Family[Fork] = Family((Fork,))
_EVENTS: Family[Forked | Exited] = Family((Forked, Exited))


class Parent:
    """The supervisor's side: orders forks and receives the events of the children."""

    def __init__(self, launch: Launch) -> None:
        """Fork the parent. Call it from the main thread, before any other thread exists."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        supervisor = os.getpid()
        give_back_large_memory()
        _import_what_is_common(launch.plan)
        # A collection writes to every object that it inspects, which would copy all pages. There is none before either:
        # what it frees are holes in pages that all processes share, and each would fill them for itself.
        gc.freeze()
        collect_as_usual()  # not before: it would begin with a collection of everything
        signal.pthread_sigmask(signal.SIG_BLOCK, _HELD_BACK)
        pid = os.fork()
        if pid == 0:
            in_child(lambda: _run_parent(launch, theirs, supervisor))
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _HELD_BACK)
        theirs.close()
        self.process = Process.of(pid)
        self._connection = ours
        self._connection.setblocking(False)

    def fileno(self) -> int:
        """Return the descriptor to wait for."""
        return self._connection.fileno()

    def fork(self, order: Fork) -> Channel:
        """Order a process group to be forked and return the channel to it; `Forked` follows.

        Raises:
            BrokenPipeError: if the parent has ended.
        """
        ours, theirs = socket.socketpair()
        with theirs:
            socket.send_fds(self._connection, [_ORDERS.to_line(order)], [theirs.fileno()])
        return Channel(ours)

    def receive(self) -> Forked | Exited | None:
        """Return the next event, or None if there is none now.

        Raises:
            EOFError: if the parent has ended.
        """
        try:
            text, descriptors, _, _ = socket.recv_fds(self._connection, _MOST, 1)
        except BlockingIOError:
            return None
        except ConnectionResetError:
            text, descriptors = b"", []
        if not text:
            raise EOFError("the pre-fork parent has ended")
        event = _EVENTS.from_line(text)
        return replace(event, descriptor=descriptors[0]) if isinstance(event, Forked) else event

    def end(self) -> None:
        """End the parent, which has nothing left to do, and wait for it."""
        self._connection.close()
        self.process.send_signal(signal.SIGKILL)
        os.waitpid(self.process.pid, 0)


def _run_parent(launch: Launch, connection: socket.socket, supervisor: int) -> None:
    end_with(supervisor, signal.SIGKILL)
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the supervisor decides what they mean
    close_all(keep=[connection.fileno(), launch.log.fileno()])
    os.setpgid(0, 0)
    setproctitle.setproctitle(launch.title("parent"))
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _HELD_BACK)
    _Forking(launch, connection).run()


class _Forking:
    """The parent's own side: one thread that forks, waits for exits and reports them."""

    def __init__(self, launch: Launch, connection: socket.socket) -> None:
        self._launch, self._connection = launch, connection
        self._selector = selectors.DefaultSelector()
        self._selector.register(connection, selectors.EVENT_READ)

    def run(self) -> None:
        """Serve until the supervisor ends."""
        while True:
            for key, _ in self._selector.select():
                if key.fileobj is self._connection:
                    self._serve()
                else:
                    self._reap(key.fd, key.data)

    def _serve(self) -> None:
        text, descriptors, _, _ = socket.recv_fds(self._connection, _MOST, 1)
        if not text:
            os._exit(0)
        order = _ORDERS.from_line(text)
        pid = self._fork(order, descriptors[0])
        os.close(descriptors[0])
        process, descriptor = Process.of(pid), os.pidfd_open(pid)  # not reaped yet: the id is still its own
        self._selector.register(descriptor, selectors.EVENT_READ, pid)
        self._send(Forked(order.group, process), [descriptor])

    def _fork(self, order: Fork, channel: int) -> int:
        parent = os.getpid()
        signal.pthread_sigmask(signal.SIG_BLOCK, _HELD_BACK)
        pid = os.fork()
        if pid == 0:
            in_child(lambda: self._run_group(order, channel, parent))
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _HELD_BACK)
        return pid

    def _run_group(self, order: Fork, channel: int, parent: int) -> None:
        end_with(parent, signal.SIGTERM)
        close_all(keep=[channel, self._launch.log.fileno()])
        os.setpgid(0, 0)
        setproctitle.setproctitle(self._launch.title(order.group))
        _redirect_output(self._launch.output(order.group))
        run_process(self._launch, order, Channel(socket.socket(fileno=channel)))

    def _reap(self, descriptor: int, pid: int) -> None:
        self._selector.unregister(descriptor)
        os.close(descriptor)
        self._send(Exited(pid, os.waitpid(pid, 0)[1]), [])

    def _send(self, event: Forked | Exited, descriptors: Sequence[int]) -> None:
        rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))] if descriptors else []
        try:
            self._connection.sendmsg([_EVENTS.to_line(event)], rights)
        except (BrokenPipeError, ConnectionResetError):
            os._exit(0)


def run_process(launch: Launch, order: Fork, channel: Channel) -> None:
    """Run the main of a process group, or of the router, until it ends."""
    if order.group == ROUTER:
        from rbxcompose.runtime.process_group.router import Router

        Router(launch.plan, launch.folder.sockets, launch.clock, channel, launch.log.write).run()
        return
    from rbxcompose.runtime.process_group.group import ProcessGroup

    ProcessGroup(
        launch.plan,
        order.group,
        launch.options,
        launch.log,
        channel,
        start=launch.clock.start,
        is_restart=order.is_restart,
        is_stopped=order.is_stopped,
        rules=launch.rules,
    ).run()


def _import_what_is_common(plan: Plan) -> None:
    registry.choose(plan.messages)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads would not survive the fork
    import numpy  # noqa: F401 - messages with arrays need it, and importing it later would hold up what runs

    import rbxcompose.runtime.process_group.group
    import rbxcompose.runtime.process_group.router  # noqa: F401

    for name in {instance.type for instance in plan.instances}:
        component_type(name)
    _make_messages({wire.type for instance in plan.instances for wire in instance.wires if wire.type})


def _make_messages(names: Collection[str]) -> None:
    """Make classes of messages and their hashes once, which most processes use, and which take long to make."""
    from rbxcompose.runtime.process_group.parameters import INTERFACES

    of_kind = {"msg": registry.message, "srv": registry.service, "action": registry.action}
    used: list[Any] = [of_kind[name.split("/")[1]](name) for name in sorted(names)]
    for interface in (*INTERFACES, Log, DiagnosticArray, CancelGoal, GoalStatusArray, *used):
        if issubclass(interface, Action):
            _ = interface.SendGoal.HASH, interface.GetResult.HASH, interface.FeedbackMessage.HASH
        else:
            _ = interface.HASH


def _redirect_output(path: Path) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | os.O_NOFOLLOW, 0o600)
    os.dup2(descriptor, 1)
    os.dup2(descriptor, 2)
    os.close(descriptor)
