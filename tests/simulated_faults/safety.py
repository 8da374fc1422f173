"""What *safe* means: laws that each run of a robot keeps, whatever fails, checked against its plan and story."""

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field

from rbxcompose.base.clock import NANOSECONDS
from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.actions import GoalState
from rbxcompose.bus.names import ActionNames
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.domains.muxes.config import MuxConfig
from rbxcompose.msgs import registry
from rbxcompose.msgs.action_msgs import GoalStatusArray
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.runtime.recording.topics import Recorded
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.sdk.ports import ServesAction
from rbxcompose.sdk.registry import component_type, declared

ROBOT = "robot itself"  # who receives a stop or a release first; each process receives it a little later
ROUNDING = 1e-6  # velocities up to this count as rest [m/s, rad/s]

PlanarVelocity = tuple[float, float]  # forwards [m/s], turning [rad/s]


@dataclass(frozen=True, slots=True)
class Base:
    """What a base follows, and how it brakes."""

    command: str  # topic
    motion: str  # topic of its odometry
    process: str
    timeout: float
    cycle: float
    deceleration: PlanarVelocity  # [m/s^2], [rad/s^2]


@dataclass(frozen=True, slots=True)
class SwitchInput:
    """An input of a mux: the highest priority wins, until it has been silent for its timeout."""

    priority: int
    timeout: float


@dataclass(frozen=True, slots=True)
class Switch:
    """A mux: its output, and its inputs by their topics."""

    output: str
    process: str
    inputs: Mapping[str, SwitchInput]


@dataclass(frozen=True, slots=True)
class ActionClaim:
    """The part of the robot that the goals of an action need exclusively, and the process of its server."""

    part: str
    process: str


@dataclass(frozen=True, slots=True)
class Laws:
    """The laws that a robot has to keep.

    `slack` is how late a sent message may be, because it was delayed or a process hung; `is_lossless` means that every
    message arrives.
    """

    bases: Sequence[Base] = ()
    switches: Sequence[Switch] = ()
    claims: Mapping[str, ActionClaim] = field(default_factory=dict)  # by the name of the action
    longest_goal: float = 60.0
    slack: float = 0.0
    is_lossless: bool = False


@dataclass(frozen=True, slots=True)
class SentVelocity:
    """A velocity on a topic: a command, or the motion reported by odometry."""

    time: float
    topic: str
    velocity: PlanarVelocity

    @property
    def is_finite(self) -> bool:
        """Return whether both parts are finite."""
        return math.isfinite(sum(self.velocity))

    @property
    def is_rest(self) -> bool:
        """Return whether nothing moves at this velocity."""
        return self.is_finite and max(map(abs, self.velocity)) <= ROUNDING


@dataclass(frozen=True, slots=True)
class Ordered:
    """An order to a process: `stop`, `release`, `brake` for good, `shutdown`; or `begin`, when it is forked."""

    time: float
    process: str
    verb: str


@dataclass(frozen=True, slots=True)
class ToldGoals:
    """The goals of an action by their ids, as its server reported them; empty when the server is gone."""

    time: float
    action: str
    goals: Mapping[bytes, GoalState]


ObservedEvent = SentVelocity | Ordered | ToldGoals
ObservedStory = Sequence[ObservedEvent]  # by time


@dataclass(frozen=True, slots=True)
class Violation:
    """A law that was broken."""

    time: float
    law: str
    text: str

    def __str__(self) -> str:
        return f"{self.time:.3f} s: {self.law}: {self.text}"


def violations(laws: Laws, story: ObservedStory) -> list[Violation]:
    """Return all violations, by time; the first one of each law says more than those that follow from it."""
    found: list[Violation] = []
    for base in laws.bases:
        found += unwarranted_motion(base, story, laws.slack)
    for switch in laws.switches:
        found += [
            *unheeded_stop(switch, story),
            *second_winner(switch, story, laws.slack, is_lossless=laws.is_lossless),
        ]
    found += [*shared_claim(laws.claims, story), *endless_goal(laws.claims, story, laws.longest_goal)]
    return sorted(found, key=lambda violation: violation.time)


def unwarranted_motion(base: Base, story: ObservedStory, slack: float) -> Iterator[Violation]:
    """Yield the times at which a base moved faster than it could have if it had braked in time."""
    force = base.timeout + 2 * base.cycle + slack  # how long it may follow a command
    deadline = commanded = -math.inf  # until when it may follow a command; when the last one was sent
    is_stopped, reported = False, math.inf  # when it last reported its motion
    fastest: PlanarVelocity = (0.0, 0.0)
    for event in story:
        match event:
            case Ordered(time, process, "stop" | "brake") if process == base.process:
                is_stopped, deadline = True, min(deadline, time + 2 * base.cycle)
            case Ordered(time, process, "release") if process == base.process:
                is_stopped = False
                if commanded >= time - slack:  # it may still be on its way
                    deadline = commanded + force
            case SentVelocity(time, topic, _) if topic == base.command and event.is_finite and not event.is_rest:
                commanded = time
                deadline = deadline if is_stopped else time + force
            case SentVelocity(time, topic, velocity) if topic == base.motion:
                if is_stopped:  # a simulated base whose process hung while braking stood still in time
                    deadline += min(slack, max(0.0, time - reported - 2 * base.cycle))
                reported = time
                fastest = (max(fastest[0], abs(velocity[0])), max(fastest[1], abs(velocity[1])))
                late = max(0.0, time - deadline)
                allowed = [max(0.0, most - rate * late) for most, rate in zip(fastest, base.deceleration, strict=True)]
                if any(abs(value) > most + ROUNDING for value, most in zip(velocity, allowed, strict=True)):
                    words = f"{velocity} at {base.motion}, {late:.3f} s after the last command had lost its force"
                    yield Violation(time, "unwarranted motion", words)


def unheeded_stop(switch: Switch, story: ObservedStory) -> Iterator[Violation]:
    """Yield what a mux let through while it was stopped, or after it had braked for good."""
    is_stopped = is_closed = is_wanted = False
    for event in story:
        match event:
            case Ordered(_, process, "stop" | "release" as verb) if process == ROBOT:
                is_wanted = verb == "stop"
            case Ordered(_, process, verb) if process == switch.process:
                is_stopped = is_wanted if verb == "begin" else verb == "stop" or (is_stopped and verb != "release")
                is_closed = verb == "brake" or (is_closed and verb != "begin")
            case SentVelocity(time, topic, velocity) if topic == switch.output and not event.is_rest:
                if is_stopped or is_closed:
                    yield Violation(time, "unheeded stop", f"{velocity} went through to {topic}")


def second_winner(switch: Switch, story: ObservedStory, slack: float, *, is_lossless: bool) -> Iterator[Violation]:
    """Yield what a mux made up, and what it let through beside an input of higher priority.

    Such an input was let through within its timeout; if no message can be lost, it may also have just sent one without
    having to come to rest first.
    """
    inputs = {topic: _Input(source) for topic, source in switch.inputs.items()}
    for event in story:
        match event:
            case Ordered(_, process, _) if process == switch.process:
                for input_ in inputs.values():
                    input_.forget()
            case SentVelocity(_, topic, _) if topic in inputs:
                inputs[topic].hear(event, slack)
            case SentVelocity(time, topic, velocity) if topic == switch.output and not event.is_rest:
                senders = [name for name, one in inputs.items() if one.has_sent(velocity, time - slack)]
                if not senders:
                    yield Violation(time, "second winner", f"no input has sent {velocity}, which is on {topic}")
                    continue
                winner = max(senders, key=lambda name: inputs[name].source.priority)
                inputs[winner].won = time
                for name, input_ in inputs.items():
                    since = max(input_.won, input_.spoke_before(time - slack) if is_lossless else -math.inf)
                    if input_.source.priority > inputs[winner].source.priority and time < since + input_.source.timeout:
                        yield Violation(time, "second winner", f"{winner} beside {name}, which lives since {since:.3f}")


class _Input:
    """What is known of an input of a mux since its last stop, release or restart."""

    def __init__(self, source: SwitchInput) -> None:
        self.source = source
        self.won = -math.inf  # when it was last let through
        self._recent: deque[SentVelocity] = deque(maxlen=200)
        self._counting: deque[float] = deque(maxlen=200)  # when it sent something without having to come to rest first
        self._is_held = False

    def forget(self) -> None:
        self.won, self._is_held = -math.inf, bool(self._recent)
        self._counting.clear()

    def hear(self, sent: SentVelocity, slack: float) -> None:
        if not sent.is_finite:
            return
        last = self._recent[-1].time if self._recent else -math.inf
        self._is_held = self._is_held and not sent.is_rest and sent.time <= last + self.source.timeout + slack
        self._recent.append(sent)
        if not self._is_held:
            self._counting.append(sent.time)

    def has_sent(self, velocity: PlanarVelocity, since: float) -> bool:
        return any(
            sent_velocity.velocity == velocity and sent_velocity.time >= since - ROUNDING
            for sent_velocity in self._recent
        )

    def spoke_before(self, time: float) -> float:
        return max((value for value in self._counting if value <= time), default=-math.inf)


def shared_claim(claims: Mapping[str, ActionClaim], story: ObservedStory) -> Iterator[Violation]:
    """Yield where two goals with the same claim are carried out; a goal being cancelled does not count."""
    executing: dict[str, dict[bytes, GoalState]] = {}  # action -> goals
    for event in story:
        if isinstance(event, Ordered) and event.verb == "begin":
            executing = {name: entry for name, entry in executing.items() if claims[name].process != event.process}
        if not isinstance(event, ToldGoals) or event.action not in claims:
            continue
        executing[event.action] = {id_: state for id_, state in event.goals.items() if state is GoalState.EXECUTING}
        part = claims[event.action].part
        rivals = [name for name, goals in executing.items() if claims[name].part == part for _ in goals]
        if len(rivals) > 1:
            yield Violation(event.time, "shared claim", f"{' and '.join(rivals)} both have '{part}'")


def endless_goal(claims: Mapping[str, ActionClaim], story: ObservedStory, longest: float) -> Iterator[Violation]:
    """Yield each goal that did not end in time, or was left open by a process that was shut down."""
    began: dict[str, dict[bytes, float]] = {name: {} for name in claims}
    closed: set[str] = set()  # processes
    for event in story:
        match event:
            case Ordered(_, process, "begin"):
                closed.discard(process)
                began.update((name, {}) for name, claim in claims.items() if claim.process == process)
            case Ordered(_, process, "shutdown"):
                closed.add(process)
            case ToldGoals(time, action, goals) if action in claims:
                is_open = {id_ for id_, state in goals.items() if not state.is_end}
                began[action] = {id_: began[action].get(id_, time) for id_ in is_open}
        for name, since in began.items():
            for id_ in [id_ for id_, time in since.items() if event.time - time > longest]:
                yield Violation(event.time, "endless goal", f"a goal of {name} has run since {since.pop(id_):.3f} s")
    for name, since in began.items():
        if since and claims[name].process in closed:
            yield Violation(story[-1].time, "endless goal", f"a goal of {name} was left open")


def laws_of(plan: Plan, *, slack: float = 0.0, is_lossless: bool = False, longest_goal: float = 60.0) -> Laws:
    """Return the laws of a robot: its bases, its velocity muxes, and the claims of its actions."""
    switches = (
        _switch(instance)
        for instance in plan.instances
        if isinstance(instance.config, MuxConfig) and _is_judged(instance.config)
    )
    return Laws(
        bases=list(_bases(plan)),
        switches=list(switches),
        claims=dict(_claims(plan)),
        longest_goal=longest_goal,
        slack=slack,
        is_lossless=is_lossless,
    )


def events_of(laws: Laws, reported: Iterable[Recorded | Ordered], start: int = 0) -> Iterator[ObservedEvent]:
    """Yield the events of messages in order, merged with orders. `start`: robot time 0 on the messages' clock [ns]."""
    commands = {base.command for base in laws.bases} | {switch.output for switch in laws.switches}
    commands |= {topic for switch in laws.switches for topic in switch.inputs}
    motions = {base.motion for base in laws.bases}
    goals = {ActionNames.of(name).status: name for name in laws.claims}
    for message in reported:
        if isinstance(message, Ordered):
            yield message
            continue
        time, topic = (message.log_time - start) / NANOSECONDS, message.topic.name
        if topic in motions:
            yield SentVelocity(time, topic, _velocity(decode(Odometry, message.payload).twist.twist))
        elif topic in commands and message.topic.type == Twist.TYPE:
            yield SentVelocity(time, topic, _velocity(decode(Twist, message.payload)))
        elif topic in goals:
            statuses = decode(GoalStatusArray, message.payload).status_list
            yield ToldGoals(time, goals[topic], {one.goal_info.goal_id.uuid: GoalState(one.status) for one in statuses})


def _velocity(twist: Twist) -> tuple[float, float]:
    return twist.linear.x, twist.angular.z


def _bases(plan: Plan) -> Iterator[Base]:
    """Yield the bases that declare how they brake."""
    for instance in plan.instances:
        for drives in declared(instance.type, instance.config, Drives):
            timeout, straight, turning = drives.stops_after, drives.acceleration, drives.turn_acceleration
            if timeout and straight and turning and drives.odometry:
                command, motion = instance.topic(drives.commands), instance.topic(drives.odometry)
                cycle = 1.0 / component_type(instance.type).rate_of(instance.config)
                yield Base(command, motion, instance.process, timeout.value, cycle, (straight.value, turning.value))


def _is_judged(config: MuxConfig) -> bool:
    """Return whether the laws are those of this mux; one with a hand-over sends what no input has sent."""
    is_plain = config.profile == "default" and config.handover is None
    return is_plain and registry.message(config.message) is Twist


def _switch(instance: Instance) -> Switch:
    config = instance.config
    assert isinstance(config, MuxConfig)
    inputs = {
        instance.topic(name): SwitchInput(input_.priority, math.inf if input_.timeout is None else input_.timeout)
        for name, input_ in config.inputs.items()
    }
    return Switch(instance.topic("output"), instance.process, inputs)


def _claims(plan: Plan) -> Iterator[tuple[str, ActionClaim]]:
    """Yield each action whose goals claim a part of the robot, by its full name."""
    for instance in plan.instances:
        for name, port in component_type(instance.type).ports(instance.config).items():
            if isinstance(port, ServesAction) and port.claims:
                yield instance.topic(name), ActionClaim(port.claims, instance.process)
