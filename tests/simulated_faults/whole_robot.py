"""A whole robot in virtual time: the real conductor, a host with its bus for each process, a network between them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command, Refused, as_data, to_data
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.channel import HostReport
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.log import Record
from rbxcompose.runtime.process_group.connection import BEAT
from rbxcompose.runtime.process_group.host import Host, Notice
from rbxcompose.runtime.recording.tape import Tape
from rbxcompose.runtime.recording.topics import Recorded
from rbxcompose.runtime.supervision.conductor import Conductor
from rbxcompose.runtime.supervision.members import Phase
from rbxcompose.sdk.component import MissionWaits
from tests.simulated_faults.network import Network, Weather
from tests.simulated_faults.safety import ROBOT, ObservedEvent, Ordered, events_of, laws_of

FORK = 0.01  # [s] until a process listens
ROUTER = "tcp/127.0.0.1:7447"  # of elsewhere: in a simulated network nobody has to be found


class Turned:
    """A loop: what is due runs at the next `turn`, unless it hangs until `stalled_until` [s]."""

    def __init__(self, robot: WholeRobot, name: str) -> None:
        self.robot, self.name = robot, name
        robot.births += 1
        self.session = f"{name}{robot.births}"
        self.stalled_until = 0.0
        self.scheduler = Scheduler()
        self.scheduler.now = robot.clock.now()
        self._woken: deque[tuple[str, Callable[[], None]]] = deque()

    def post(self, owner: str, callback: Callable[[], None]) -> None:
        """Have something run at the next turn."""
        self._woken.append((owner, callback))

    def next_due(self) -> float | None:
        """Return when it has something to do [s]."""
        due = self.robot.clock.now() if self._woken else self.scheduler.next_due()
        return None if due is None else max(due, self.stalled_until)

    def turn(self) -> None:
        """Run what is due, unless it hangs."""
        now = self.robot.clock.now()
        if now < self.stalled_until:
            return
        while self._woken:
            self.scheduler.advance(now)
            self.scheduler.post(*self._woken.popleft())
        self.scheduler.advance(now)

    def open_bus(self) -> Bus:
        """Return a bus over the network; what is published there becomes part of the story."""
        robot = self.robot
        tape = Tape(robot.clock, lambda topic: None, robot.told.append)
        transport = tape.around(robot.network.join(self.session, self.post))
        space = robot.plan.bus.namespace
        return Bus(self.scheduler, robot.clock, namespace=space, transport=transport, log=robot.complain)


class Guest(Turned):
    """Somebody else on the network, who publishes and asks."""

    def __init__(self, robot: WholeRobot) -> None:
        super().__init__(robot, "guest")
        self.bus = self.open_bus()
        robot.guests.append(self)


class SimulatedProcess(Turned):
    """A process of the robot: what `Group` is to a real one, without a driver."""

    def __init__(self, robot: WholeRobot, name: str, *, is_restart: bool, is_stopped: bool) -> None:
        super().__init__(robot, name)
        self.host: Host | None = None
        self.stalled_until = robot.clock.now() + FORK
        self._is_restart, self._is_stopped = is_restart, is_stopped
        self._is_braking = self._is_at_rest = False

    def turn(self) -> None:
        """Run what is due, and tell when it has come to rest."""
        super().turn()
        if self._is_braking and not self._is_at_rest and self.host is not None and self.host.is_at_rest:
            self._is_at_rest = True
            self._say(say.AtRest())

    def handle(self, order: say.ChannelOrder) -> None:
        """Carry out what the conductor wants."""
        host = self.host
        match order:
            case say.Configure():
                self._configure()
            case _ if host is None:
                raise RuntimeError(f"{self.name} has not been configured: {order}")
            case say.Activate(names):
                host.activate(names)
                self._say(say.States(host.states()))
            case say.Start():
                host.start()
            case say.Stop():
                host.stop()
            case say.Release():
                host.release()
            case say.Brake():
                self._is_braking = True
                host.brake()
            case say.Lost(names, cause):
                host.lost(names, cause)
            case say.Blocked(causes):
                host.statuses.block(causes)
            case say.Ask(number, instance, request):
                try:
                    self._say(say.Answered(number, to_data(host.ask(instance, host.request(instance, request)))))
                except Refused as refusal:
                    self._say(say.Refusal(number, str(refusal)))
            case say.Shutdown():
                self._say(say.Summary(self.robot.clock.now(), host.summary()))
                host.shutdown()
                self.robot.end_process(self.name, "ended with status 0")
            case _:
                raise RuntimeError(f"not an order for a simulated process: {order}")

    def _configure(self) -> None:
        robot, plan = self.robot, self.robot.plan
        self.host = Host(
            plan,
            plan.of_group(self.name),
            self.scheduler,
            robot.clock,
            self.open_bus(),
            self._record,
            self._notify,
            is_stopped=self._is_stopped,
            is_restart=self._is_restart,
            on_order=self._told,
        )
        self._told("begin")
        self.host.configure()
        self._say(say.Configured())
        self.scheduler.every(BEAT, "beat", lambda dt: self._say(say.Alive(self.robot.clock.now())))

    def _notify(self, notice: Notice) -> None:
        if not isinstance(notice, MissionWaits):  # it is not told to the supervisor
            self._say(notice)

    def _told(self, verb: str, *words: object) -> None:
        self.robot.told.append(Ordered(self.robot.clock.now(), self.name, verb))

    def _record(self, record: Record) -> None:
        self.robot.records.append(record)
        if record.text == "restarted":  # a component restarted, which has forgotten what it knew
            self._told("restart")

    def _say(self, word: say.ChannelWord) -> None:
        self.robot.hear(self.name, self.session, word)


class WholeRobot:
    """Carries out what the conductor decides, and keeps what the run tells."""

    def __init__(self, plan: Plan, weather: Weather) -> None:
        self.plan = replace(plan, bus=replace(plan.bus, router=ROUTER))
        self.clock, self.scheduler = SteppedClock(), Scheduler()
        self.network = Network(self.scheduler, weather)
        self.processes: dict[str, SimulatedProcess] = {}
        self.guests: list[Guest] = []
        self.births = 0
        self.run_id = "this run"
        self.told: list[Recorded | Ordered] = []
        self.records: list[Record] = []
        self.answers: list[tuple[object, bool]] = []
        self.conductor = Conductor(self.plan, RunOptions(is_detached=True), self.scheduler, self, router=None)
        self.conductor.begin()

    def advance(self, seconds: float) -> None:
        """Let robot time pass, or less if the robot goes down before."""
        end = self.clock.now() + seconds
        while self.conductor.phase is not Phase.ENDED:
            due = [one.next_due() for one in self._loops]
            following = min(value for value in (*due, self.scheduler.next_due(), end) if value is not None)
            self.clock.advance_to(max(following, self.clock.now()))
            self.scheduler.advance(self.clock.now())
            for loop in self._loops:
                loop.turn()
            if following >= end:
                return

    @property
    def _loops(self) -> list[Turned]:
        return [*self.processes.values(), *self.guests]

    @property
    def story(self) -> list[ObservedEvent]:
        """Return what the run has told."""
        return list(events_of(laws_of(self.plan), self.told))

    @property
    def texts(self) -> list[str]:
        """Return the log."""
        return [f"{record.time:.3f} {record.source}: {record.text}" for record in self.records]

    def command(self, instance: str, command: Command) -> None:
        """Pass a person's command on to a component."""
        process = next(candidate.process for candidate in self.plan.instances if candidate.name == instance)
        self.send(process, say.Ask(0, instance, as_data(command)))

    def to_hosts(self, report: HostReport) -> None:
        """Tell nobody: there is one host."""

    def set_stopped(self, is_stopped: bool) -> None:
        """Stop the robot, or release it."""
        self.told.append(Ordered(self.clock.now(), ROBOT, "stop" if is_stopped else "release"))
        if is_stopped:
            self.conductor.stop("a person")
        else:
            self.conductor.release()

    # What the weather does

    def kill_process(self, name: str) -> None:
        """End a process from one instant to the next."""
        self.end_process(name, "was killed by SIGKILL")

    def stall(self, name: str, seconds: float) -> None:
        """Let a process not turn for a while."""
        if name in self.processes:
            self.processes[name].stalled_until = self.clock.now() + seconds

    def end_process(self, name: str, how: str) -> None:
        """Take a process away; the conductor hears of it."""
        process = self.processes.pop(name, None)
        if process is not None:
            self.network.leave(process.session)
            self.post(lambda: self.conductor.exited(name, how))

    def post(self, callback: Callable[[], None]) -> None:
        """Have something run by the supervisor, at this instant."""
        self.scheduler.at(self.clock.now(), "supervisor", callback)

    def hear(self, name: str, session: str, word: say.ChannelWord) -> None:
        """Bring a word of a process to the conductor."""

        def heard() -> None:
            if (process := self.processes.get(name)) is None or process.session == session:
                self.conductor.receive(name, word)

        self.post(heard)

    def complain(self, owner: str, text: str) -> None:
        """Keep what the bus of a process says."""
        self.records.append(Record(self.clock.now(), Level.WARN, owner, text))

    # Effects of the conductor

    def fork(self, process: str, *, is_restart: bool, is_stopped: bool) -> None:
        self.processes[process] = SimulatedProcess(self, process, is_restart=is_restart, is_stopped=is_stopped)

    def send(self, process: str, message: say.ChannelOrder) -> None:
        if (found := self.processes.get(process)) is not None:
            found.post("", lambda: found.handle(message))

    def end(self, process: str) -> None:
        self.end_process(process, "was killed by SIGTERM")

    def kill(self, process: str) -> None:
        self.kill_process(process)

    def is_suspended(self, process: str) -> bool:
        return False

    def waits(self, process: str | None) -> dict[str, float]:
        return {}

    def log(self, level: Level, text: str, detail: str = "") -> None:
        self.records.append(Record(self.clock.now(), level, "robot", text, detail))

    def is_up(self) -> None:
        self.log(Level.OK, "up")

    def states_changed(self) -> None:
        """There is no state file."""

    def answer(self, number: int, answer: object) -> None:
        self.answers.append((answer, False))

    def refuse(self, number: int, reason: str) -> None:
        self.answers.append((reason, True))
