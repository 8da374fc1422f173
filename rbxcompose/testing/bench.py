"""A bench for components and for whole robots: virtual time, an in-process bus, no waiting."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.config import PLACE, Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.topics import Publisher
from rbxcompose.compiler.model.robot import ends_of
from rbxcompose.compiler.plan.model import Instance, Plan, Wire
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.share import exchanges
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray, DiagnosticStatus
from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterValue
from rbxcompose.msgs.types import Message
from rbxcompose.runtime.log import Record
from rbxcompose.runtime.process_group.exchange import Way, carry
from rbxcompose.runtime.process_group.host import Host, Notice
from rbxcompose.runtime.process_group.parameters import Deciders
from rbxcompose.sdk.component import Component, MissionOver
from rbxcompose.sdk.parameters import RobotRules, changed, to_message
from rbxcompose.sdk.ports import Qos
from rbxcompose.sdk.registry import component_type

M = TypeVar("M", bound=Message)
OWNER = "bench"


def instance(
    name: str, type_name: str, config: Mapping[str, object] | None = None, places: Sequence[Place] = ()
) -> Instance:
    """Return an instance with its type's own topics; `config` is written as in a manifest (`{"runtime": "45 s"}`)."""
    cls = component_type(type_name)
    context = {PLACE: {place.name: place for place in places}}
    made = cls.config_type().model_validate(dict(config or {}), context=context)
    ends = ends_of(name, cls, made, "", {})
    wires = tuple(Wire(end.name, end.port.kind, end.topic, end.type_name) for end in ends)
    return Instance(name, type_name, made, cls.process, (), wires)


class _BenchPublisher(Publisher[M]):
    """Encodes each message, so that whoever publishes what cannot be sent fails as with a listener elsewhere."""

    def __call__(self, message: M) -> None:
        super().__call__(message)
        encode(message)


class _BenchBus(Bus):
    def publisher(self, owner: str, topic: str, message: type[M], qos: Qos) -> Publisher[M]:
        node = self._node(owner)
        return node.keep(_BenchPublisher(self._topics, node, topic, message, qos))


class Bench:
    """Instances, or a whole `plan`, in one process on a stepped clock, configured and active immediately.

    `records` holds what they logged, `events` what they reported to the supervisor; live settings keep `rules`. A
    component that publishes a value that its message cannot have, such as text as a number, fails.
    """

    def __init__(
        self,
        *instances: Instance,
        plan: Plan | None = None,
        start: bool = True,
        clock: SteppedClock | None = None,
        rules: RobotRules | None = None,
    ) -> None:
        self.clock = clock or SteppedClock()
        self.scheduler = Scheduler()
        self.records: list[Record] = []
        self.events: list[Notice] = []
        own = registry.chosen().texts
        self.plan = plan.in_one_process() if plan else Plan("bench", "bench.yaml", tuple(instances), messages=own)
        registry.choose(self.plan.messages)
        bus = self.plan.bus
        self.bus = _BenchBus(
            self.scheduler, self.clock, domain=bus.domain, namespace=bus.namespace, wire=bus.wire, log=self._note
        )
        self.host = Host(
            self.plan,
            self.plan.instances,
            self.scheduler,
            self.clock,
            self.bus,
            self.records.append,
            self.events.append,
            deciders=Deciders(rules=rules),
        )
        self.host.configure()
        self.host.activate([one.name for one in self.plan.instances])
        if start:
            self.host.start()
        self.advance(0.0)

    def advance(self, seconds: float) -> None:
        """Let `seconds` of robot time pass, event by event."""
        self.run_until(lambda: False, seconds)

    def run_until(self, reached: Callable[[], bool], most: float = 600.0) -> bool:
        """Advance time until `reached()` holds, by at most `most` [s] of robot time; return whether it does."""
        end = self.clock.now() + most
        registry.choose(self.plan.messages)
        self.scheduler.advance(self.clock.now())
        while not reached():
            due = self.scheduler.next_due()
            if due is None or due > end:
                self.clock.advance_to(end)
                self.scheduler.advance(end)
                return reached()
            self.clock.advance_to(max(due, self.clock.now()))
            self.scheduler.advance(self.clock.now())
        return True

    def component(self, name: str) -> Component[Any]:
        """Return the running component of an instance.

        Raises:
            LookupError: if it does not exist, for example because it failed.
        """
        found = self.host.hosted[name].component
        if found is None:
            raise LookupError(f"'{name}' does not run: {self.texts()}")
        return found

    def publish(self, topic: str, message: Message, qos: Qos = Qos.COMMAND) -> None:
        """Publish a message from outside the components and have it processed."""
        self.bus.publisher(OWNER, topic, type(message), qos)(message)
        self.advance(0.0)

    def collect(self, topic: str, message: type[M], qos: Qos = Qos.EVENT) -> list[M]:
        """Return a list that grows with each message on a topic."""
        found: list[M] = []
        self.bus.subscribe(OWNER, topic, message, qos, found.append)
        return found

    def statuses(self, name: str) -> list[DiagnosticStatus]:
        """Return a list that grows with each status that an instance reports to diagnostics."""
        found: list[DiagnosticStatus] = []

        def take(message: DiagnosticArray) -> None:
            found.extend(status for status in message.status if status.name == name)

        self.bus.subscribe(OWNER, "/diagnostics", DiagnosticArray, Qos.EVENT, take)
        return found

    def set_live(self, name: str, **settings: object) -> None:
        """Change `Live` settings of an instance to SI numbers or to text with a unit.

        Raises:
            UnsettableError: if it has no such setting, or the setting is not live or does not accept the value.
            Refused: if the component refuses it.
        """
        hosted = self.host.hosted[name]
        parameters = [Parameter(setting, to_message(value) or ParameterValue()) for setting, value in settings.items()]
        hosted.reconfigure(changed(hosted.config, parameters))

    def texts(self) -> list[str]:
        """Return the log as lines of `source: text`."""
        return [f"{record.source}: {record.text}" for record in self.records]

    def _note(self, owner: str, text: str) -> None:
        self.records.append(Record(self.clock.now(), Level.WARN, owner, text))


LONGEST = 3600.0  # [s] of robot time


@dataclass(frozen=True, slots=True)
class Ran:
    """A robot whose mission has ended, or whose time is up."""

    bench: Bench

    @property
    def outcome(self) -> str:
        """Return how the mission ended: `success`, `failure`, or `running` if it has not."""
        ends = [event.outcome for event in self.bench.events if isinstance(event, MissionOver)]
        return str(ends[0]) if ends else "running"

    @property
    def log(self) -> str:
        """Return the log, one record a line."""
        return "\n".join(record.to_json() for record in self.bench.records)


def run_robot(plan: Plan, *, most: float = LONGEST) -> Ran:
    """Run a robot until its mission has ended, at most `most` [s] of robot time."""
    bench = Bench(plan=plan)
    seen = 0

    def is_over() -> bool:
        nonlocal seen  # asked after each instant, so only new events are looked at
        if len(bench.events) == seen:
            return False
        news, seen = bench.events[seen:], len(bench.events)
        return any(isinstance(event, MissionOver) for event in news)

    bench.run_until(is_over, most)
    return Ran(bench)


class SystemBench:
    """Each robot of a system in a bench of its own, all on one stepped clock.

    What is due at one instant runs robot by robot, in the order of the system's file, so that two runs are alike.
    What robots share arrives at the same instant.
    """

    def __init__(self, system: System) -> None:
        """Take a system whose robots are all there.

        Raises:
            ValueError: if it has errors.
        """
        if system.report.has_errors:
            raise ValueError("; ".join(finding.message for finding in system.report))
        self.clock = SteppedClock()
        self.robots = {name: Bench(plan=robot.plan, clock=self.clock) for name, robot in system.robots.items()}
        shared = exchanges(system)
        givers = {wire.shared: (name, wire) for (name, _), each in shared.items() for wire in each.gives}
        for (name, _), each in shared.items():
            for wire in each.takes:
                giver, given = givers[wire.shared]
                registry.choose(self.robots[name].plan.messages)
                way = Way(self.robots[giver].bus, given.own, self.robots[name].bus, wire.own)
                carry(way, wire.type, wire.qos)
        self.advance(0.0)

    def advance(self, seconds: float) -> None:
        """Let `seconds` of robot time pass, event by event."""
        self.run_until(lambda: False, seconds)

    def run_until(self, reached: Callable[[], bool], most: float = 600.0) -> bool:
        """Advance time until `reached()` holds, by at most `most` [s] of robot time; return whether it does."""
        end = self.clock.now() + most
        self._settle()
        while not reached():
            due = min(self._due(), default=None)
            if due is None or due > end:
                self.clock.advance_to(end)
                self._settle()
                return reached()
            self.clock.advance_to(max(due, self.clock.now()))
            self._settle()
        return True

    def _due(self) -> list[float]:
        times = [robot.scheduler.next_due() for robot in self.robots.values()]
        return [time for time in times if time is not None]

    def _settle(self) -> None:
        """Run what is due now, and what that makes due."""
        now = self.clock.now()
        while True:
            for robot in self.robots.values():
                registry.choose(robot.plan.messages)
                robot.scheduler.advance(now)
            if min(self._due(), default=now + 1.0) > now:
                return
