"""The supervisor of a robot: the shell that carries out what the conductor decides."""

import os
import selectors
import signal
import socket
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from types import FrameType
from typing import Any

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.endpoints import is_private, socket_of
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.plan.teleoperation import teleoperated
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.control import ControlServer
from rbxcompose.runtime.folder import SILENT, SUSPENDED, ComponentState, Gauge, RobotFolder, RobotState
from rbxcompose.runtime.log import Record
from rbxcompose.runtime.process_group.connection import MARK
from rbxcompose.runtime.processes import Process, adopt_orphans, boot_id, describe_exit, signal_descriptor, waits_of
from rbxcompose.runtime.supervision.conductor import INTERRUPTED, ROBOT_FAILED, Conductor, rest_time
from rbxcompose.runtime.supervision.judge import Judge
from rbxcompose.runtime.supervision.members import DEAD, LOOK, SILENT_FOR, Phase
from rbxcompose.runtime.supervision.prefork import ROUTER, Exited, Fork, Forked, Launch, Parent
from rbxcompose.runtime.supervision.request_handler import RequestHandler
from rbxcompose.runtime.supervision.setting_changes import SettingChanges, WhenJudged
from rbxcompose.sdk.capabilities import Drains, RunsMissions
from rbxcompose.sdk.ports import Out
from rbxcompose.sdk.registry import component_type, declared

READY, ALIVE = b"READY=1", b"WATCHDOG=1"
SERVICE_MANAGER = "NOTIFY_SOCKET"
"""Names, in the environment, the socket of the service manager that has started this process."""


class ServiceManager:
    """Sends to the socket of the `SERVICE_MANAGER`; without one, nobody listens."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        name = environment.get(SERVICE_MANAGER, "")
        self._address = f"\0{name[1:]}" if name.startswith("@") else name
        self._is_watched = "WATCHDOG_USEC" in environment

    def notify(self, state: bytes) -> None:
        """Send a state; if it cannot be taken now, it is not needed any more."""
        if self._address and (state is not ALIVE or self._is_watched):
            with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
                sender.sendto(state, socket.MSG_DONTWAIT, self._address)


def gauges_of(plan: Plan) -> dict[str, Gauge]:
    """Return the gauges of the batteries, by component."""
    found = dict[str, Gauge]()
    for instance in plan.instances:
        for drains in declared(instance.type, instance.config, Drains):
            port = component_type(instance.type).ports(instance.config)[drains.level]
            if isinstance(port, Out) and port.interface is not None:
                found[instance.name] = Gauge(instance.topic(drains.level), port.interface.TYPE, port.unit)
    return found


_TAIL = 8000  # [B] of a process's printed output that go into the log
_LONGEST_WAIT = 60.0  # [s]
ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_OWNER = "supervisor"


def with_reason(how: str, printed: str) -> str:
    """Return how a process ended in words, with the reason that it printed: where it hung, or its error."""
    _, is_hang, where = printed.rpartition(MARK)
    if is_hang:
        return f"hung for {where.splitlines()[0]} and ended itself"
    has_error = how.startswith("ended with") and "Traceback (most recent call last):" in printed
    return f"{how}: {printed.splitlines()[-1]}" if has_error else how


@dataclass
class _Child:
    """A child process of the supervisor; its pidfd is known once it has been forked."""

    channel: messages.Channel
    process: Process | None = None
    descriptor: int | None = None
    wanted_end: signal.Signals | None = None  # to be sent as soon as it is forked


def _lasting(plan: Plan) -> dict[str, Any]:
    """Return what of the state does not change while a plan runs, as arguments of `RobotState`."""
    return {
        "batteries": gauges_of(plan),
        "executive": _executive(plan),
        "teleoperated": teleoperated(plan),
        "rest_time": rest_time(plan),
    }


class Supervisor:
    """Runs one robot to its end; `run` returns the exit code."""

    def __init__(self, launch: Launch, folder: RobotFolder, lock: int, on_up: Callable[[], None]) -> None:
        """`lock` is the descriptor that holds the lock of `folder`."""
        self._launch, self._folder, self._lock, self._on_up = launch, folder, lock, on_up
        self._clock: MonotonicClock = launch.clock
        self.run_id = f"{os.getpid()}, {launch.clock.start}"
        self._scheduler = Scheduler()
        self._selector = selectors.DefaultSelector()
        self._children: dict[str, _Child] = {}
        self._interrupts = 0
        self._manager = ServiceManager(os.environ)  # that of this process
        self._is_state_old = False  # the state file is out of date
        self._lasting: tuple[Plan, dict[str, Any]] | None = None  # it takes long to find out, and is written often
        self._complained = ""
        router = None if launch.plan.bus.router else ROUTER
        self.conductor = Conductor(launch.plan, launch.options, self._scheduler, self, router=router)
        self._judge = Judge(launch.rules, launch.title("rules"), self._selector, self._scheduler)
        self._settings = SettingChanges(self)
        self._requests = RequestHandler(self, self._settings, is_stepped=launch.options.is_stepped)
        self._wake, self._wakened = socket.socketpair()
        for end in (self._wake, self._wakened):
            end.setblocking(False)

    def run(self) -> int:
        """Run the robot from the first fork to the last exit and return the exit code."""
        for number in ENDINGS:
            signal.signal(number, self._on_signal)
        signal.set_wakeup_fd(self._wake.fileno(), warn_on_full_buffer=False)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDINGS)
        adopt_orphans()
        self._parent: Parent | None = Parent(self._launch)
        self._parent_process = self._parent.process
        self._parent_ran = self._parent_looked = self._clock.now()  # [s]
        self._scheduler.every(LOOK, _OWNER, lambda dt: self._look_around())
        self._selector.register(self._parent, selectors.EVENT_READ, self._receive_from_parent)
        self._selector.register(self._wakened, selectors.EVENT_READ, self._on_signals)
        self._control = ControlServer(self._folder, self._selector)
        self._control.handle = self._requests.handle
        self._write_messages()
        self._write_state()
        try:
            self.conductor.begin()
            while self.conductor.phase is not Phase.ENDED:
                self._turn()
        finally:
            self._close()
        return self.conductor.exit_code

    def _turn(self) -> None:
        due = self._scheduler.next_due()
        pause = _LONGEST_WAIT if due is None else max(0.0, due - self._clock.now())
        for key, _ in self._selector.select(pause):
            if self._selector.get_map().get(key.fd) is key:  # one callback may have closed another's descriptor
                key.data()
        self._scheduler.advance(self._clock.now())
        if self._is_state_old:
            self._write_state()

    def _close(self) -> None:
        self._control.close()
        self._judge.close()
        if self._parent is not None:
            self._parent.end()
        signal.set_wakeup_fd(-1)

    # Signals

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._interrupts += number == signal.SIGINT  # the wake-up descriptor does the rest

    def _on_signals(self) -> None:
        self._wakened.recv(4096)
        self.conductor.go_down(INTERRUPTED, "interrupted")
        if self._interrupts > 1:
            self.conductor.hurry()

    # Effects of the conductor

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        """Order a fork and listen to the process."""
        if self._parent is None:
            return
        try:
            channel = self._parent.fork(Fork(process, is_restart, is_stopped))
        except (BrokenPipeError, ConnectionResetError):
            return  # its end is about to be reported
        self._children[process] = _Child(channel)
        self._selector.register(channel, selectors.EVENT_READ, lambda: self._receive(process, channel))

    def send(self, process: str, message: messages.ChannelOrder) -> None:
        """Send a message to a process."""
        if process in self._children:
            channel = self._children[process].channel
            channel.send(message)
            self._watch(channel)

    def to_hosts(self, report: messages.HostReport) -> None:
        """Tell the other hosts of the robot how this one is; a router that is behind has newer reports to come."""
        child = self._children.get(ROUTER)
        if child is not None and not child.channel.is_behind:
            self.send(ROUTER, messages.ToHosts(report))

    def _watch(self, channel: messages.Channel) -> None:
        """Wait for messages of a process, and until it can take the rest of a message too long for one send."""
        if channel.is_open:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if channel.is_behind else 0)
            key = self._selector.get_key(channel)
            if key.events != events:
                self._selector.modify(channel, events, key.data)

    def end(self, process: str) -> None:
        """Signal a process to end."""
        self._signal(process, signal.SIGTERM)

    def kill(self, process: str) -> None:
        """End a process."""
        self._signal(process, signal.SIGKILL)

    def _signal(self, process: str, number: signal.Signals) -> None:
        child = self._children.get(process)
        if child is None:
            return
        child.wanted_end = number
        if child.descriptor is not None:
            signal_descriptor(child.descriptor, number)

    def is_suspended(self, process: str) -> bool:
        """Return whether a signal keeps a process from running."""
        child = self._children.get(process)
        return child is not None and child.process is not None and child.process.is_stopped

    def waits(self, process: str | None) -> dict[str, float]:
        """Return how long each thread of a process has waited for a processor [s]; None is this one."""
        if process is None:
            return waits_of(os.getpid())
        child = self._children.get(process)
        return waits_of(child.process.pid) if child is not None and child.process is not None else {}

    def log(self, level: Level, text: str, detail: str = "") -> None:
        """Write a record of the whole robot."""
        time = self._clock.now() if self.conductor.is_real_time else self.conductor.time
        self._launch.log.write(Record(time, level, "robot", text, detail))

    def is_up(self) -> None:
        """Notify those who wait that everything is active."""
        self._write_state()
        self._manager.notify(READY)
        self._on_up()

    def states_changed(self) -> None:
        """Schedule one write of the state file at the end of this turn."""
        self._is_state_old = True

    def answer(self, number: int, answer: object) -> None:
        """Answer a request, with data."""
        self._control.answer(number, answer)

    def refuse(self, number: int, reason: str) -> None:
        """Refuse a request."""
        self._control.refuse(number, reason)

    # Changes of settings

    def plan(self) -> Plan:
        """Return the plan in effect."""
        return self.conductor.plan

    def reached(self) -> Collection[str]:
        """Return the processes that take orders; none if the robot goes down."""
        return self.conductor.reached

    def judge(self, now: list[str], new: list[str], then: WhenJudged) -> None:
        """Ask whether components may have the configurations `new`, where others have those of `now`."""
        conductor = self.conductor
        file = os.path.realpath(conductor.plan.file)
        self._judge.ask(conductor.generation, file, conductor.layers, now, new, then)

    # What happens

    def _receive(self, name: str, channel: messages.Channel) -> None:
        received = channel.receive()
        channel.flush()
        if channel.is_open:
            self._watch(channel)
        else:
            self._selector.unregister(channel)
        for message in received:
            self.conductor.receive(name, message)  # type: ignore[arg-type]
            self._settings.receive(name, message)  # type: ignore[arg-type]
            self._requests.consultations.receive(name, message)  # type: ignore[arg-type]

    def _receive_from_parent(self) -> None:
        try:
            while self._parent is not None and (event := self._parent.receive()) is not None:
                if isinstance(event, Forked):
                    self._forked(event)
                else:
                    self._exited(event)
        except EOFError:
            self._lose_parent()

    def _forked(self, event: Forked) -> None:
        child = self._children[event.group]
        child.process, child.descriptor = event.process, event.descriptor
        if child.wanted_end is not None:
            signal_descriptor(event.descriptor, child.wanted_end)
        self._write_state()

    def _exited(self, event: Exited) -> None:
        name = next(name for name, child in self._children.items() if child.process and child.process.pid == event.pid)
        self._bury(name, describe_exit(event.status))

    def _bury(self, name: str, how: str) -> None:
        child = self._children.pop(name)
        if child.channel.is_open:
            self._receive(name, child.channel)  # its last words
        if child.channel.is_open:
            self._selector.unregister(child.channel)
        child.channel.close()
        if child.descriptor is not None:
            os.close(child.descriptor)
        printed = self._printed(name)
        how = with_reason(how, printed)
        if printed and self.conductor.is_going_down:
            self.log(Level.OK, f"process '{name}' {how}; what it had printed is in the log file", printed)
        self.conductor.exited(name, how, printed)
        self._settings.gone(name)
        self._requests.consultations.gone(name)

    def _printed(self, name: str) -> str:
        try:
            return self._launch.output(name).read_text(encoding="utf-8", errors="replace")[-_TAIL:]
        except OSError:  # it has printed nothing, or the disk is at fault: the robot does not depend on it
            return ""

    def _look_around(self) -> None:
        self._manager.notify(ALIVE)
        self._look_at_parent()
        if self._folder.has_lost(self._lock):
            self._restore_folder()

    def _restore_folder(self) -> None:
        """Restore files removed from the folder of this robot, so that `stop` and `down` find it."""
        try:
            self._folder.make()
            lock = self._lock if self._folder.has_lock(self._lock) else self._folder.lock()
            if lock is None:
                raise OSError("another supervisor holds the lock")
            if lock != self._lock:
                os.close(self._lock)
                self._lock = lock
            self._control.open_again()
            self._restore_router()
            self._write_messages()
            self._folder.write_state(self.state())
        except OSError as error:
            self._complain(f"files of the robot were removed and cannot be restored: {error}")
        else:
            self._complained = ""
            self.log(Level.WARN, "files of the running robot were removed; they are restored")

    def _restore_router(self) -> None:
        """Restart a router whose socket was removed, so that programs of this user find it again."""
        endpoint = self.conductor.endpoint
        if endpoint is not None and is_private(endpoint) and not socket_of(endpoint).exists():
            self.kill(ROUTER)

    def _complain(self, text: str) -> None:
        """Warn about something that is retried, once for each reason."""
        if text != self._complained:
            self._complained = text
            self.log(Level.WARN, text)

    def _look_at_parent(self) -> None:
        """End a pre-fork parent that a signal has suspended: it neither forks nor reports the end of a process."""
        now, looked = self._clock.now(), self._parent_looked
        self._parent_looked = now
        if self._parent is None or not self._parent.process.is_stopped or now - looked > SILENT_FOR:
            self._parent_ran = now  # or this process did not run itself, so it cannot know
        elif now - self._parent_ran > DEAD:
            self.log(Level.ERROR, "the pre-fork parent was suspended by a signal and is killed")
            self._parent.process.send_signal(signal.SIGKILL)

    def _lose_parent(self) -> None:
        """Continue without the pre-fork parent: its processes are ours now, and have been asked to stop."""
        if self._parent is None:
            return
        self._selector.unregister(self._parent)
        self._parent.end()
        self._parent = None
        for name, child in list(self._children.items()):
            if child.process is None or child.descriptor is None:
                self._bury(name, "was never started")
            else:
                pid, descriptor = child.process.pid, child.descriptor
                self._selector.register(descriptor, selectors.EVENT_READ, self._reaper(name, pid, descriptor))
        self.conductor.go_down(ROBOT_FAILED, "the pre-fork parent is gone", Level.ERROR)

    def _reaper(self, name: str, pid: int, descriptor: int) -> Callable[[], None]:
        def reap() -> None:
            self._selector.unregister(descriptor)
            try:
                how = describe_exit(os.waitpid(pid, 0)[1])
            except ChildProcessError:
                how = "ended"  # the parent had reaped it before it ended itself
            self._bury(name, how)

        return reap

    # What is known from outside

    def state(self) -> RobotState:
        """Return the state for the state file and `ps`."""
        running = {name: child.process for name, child in self._children.items() if child.process is not None}
        plan = self.conductor.plan
        if self._lasting is None or self._lasting[0] is not plan:
            self._lasting = plan, _lasting(plan)
        components = tuple(
            self._component(instance.name, instance.type, instance.process) for instance in plan.instances
        )
        return RobotState(
            robot=self._launch.plan.robot,
            file=os.path.realpath(plan.file),
            supervisor=Process.of(os.getpid()),
            processes={"parent": self._parent_process, **running},
            components=components,
            router=self.conductor.endpoint,
            boot=boot_id(),
            domain=self._launch.plan.bus.domain,
            layers=self.conductor.layers,
            stop=self.conductor.latch.state,
            clocks=self.conductor.hosts.clocks,
            **self._lasting[1],
        )

    def _component(self, name: str, type_name: str, process: str) -> ComponentState:
        state, restarts = self.conductor.state_of(name)
        waits_for = self.conductor.blocked.causes.get(name)
        child = self._children.get(process)
        pid = child.process.pid if child and child.process else None
        restarts += self.conductor.members[process].restarts
        if self.is_suspended(process):
            state = SUSPENDED
        elif child is not None and self.conductor.members[process].is_reported_lost:
            state = SILENT
        note = self.conductor.kept.notes.get(name, "")
        return ComponentState(name, type_name, state, process, pid, restarts, waits_for, note)

    def _write_messages(self) -> None:
        if texts := self._launch.plan.messages:
            try:
                self._folder.write_messages(texts)
            except OSError as error:  # the robot does not depend on it
                self._complain(f"the texts of its messages cannot be written: {error}")

    def _write_state(self) -> None:
        self._is_state_old = False
        try:
            self._folder.write_state(self.state())
        except OSError as error:  # the robot does not depend on it
            self._complain(f"the state file cannot be written: {error}")


def _executive(plan: Plan) -> str | None:
    found = [instance.name for instance in plan.instances if declared(instance.type, instance.config, RunsMissions)]
    return found[-1] if found else None  # the robot's own starts last
