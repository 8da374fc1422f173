"""What a leaf of a mission waits for: a goal, a call, a skill in Python or on topics."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, ClassVar, Protocol

from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.program.goals import SUCCESS, values_of
from rbxcompose.missions.program.outcomes import Result
from rbxcompose.missions.program.program import Program, RobotNames, Skill
from rbxcompose.missions.sources import OUTCOME, PAUSE, SkillSource, SkillWay, TopicSource, ValueSource
from rbxcompose.missions.triggers.trigger import Trigger
from rbxcompose.msgs import registry
from rbxcompose.msgs.std_msgs import String
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.bound import REASONS, Ended, Outcome, Reply, SentGoal
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Port, Qos, SendsOrders

# Prefixes of port names.
VALUE, PUBLISHES, CALLS = "value_", "publishes_", "calls_"
SKILL, PAUSES, ENDS, HALTS = "skill_", "pauses_", "ends_", "halts_"  # of a skill: requests, pauses, ends, cancels


class Equipment(Protocol):
    """The robot's missions, and what they may request of it."""

    @property
    def programs(self) -> Mapping[str, Program]:
        """Return the missions by name."""
        ...

    @property
    def inputs(self) -> Mapping[str, Mapping[str, Any]]:
        """Return the robot's values for inputs, by mission and name."""
        ...

    @property
    def values(self) -> Mapping[str, ValueSource]:
        """Return the sources of values."""
        ...

    @property
    def skills(self) -> Mapping[str, SkillSource]:
        """Return the skills."""
        ...

    @property
    def topics(self) -> Mapping[str, TopicSource]:
        """Return the topics on which missions publish."""
        ...

    @property
    def services(self) -> Mapping[str, str]:
        """Return the services that missions call, with their ROS types."""
        ...

    @property
    def reads(self) -> frozenset[str]:
        """Return the names that any mission reads."""
        ...

    @property
    def used(self) -> Mapping[str, SkillSource]:
        """Return the skills that any mission uses."""
        ...

    @property
    def names(self) -> RobotNames:
        """Return what the robot gives to missions."""
        ...


class Shell(Protocol):
    """The component: its time, its live ports by name, its log."""

    bound: dict[str, Any]

    @property
    def equipment(self) -> Equipment:
        """Return the robot's missions and what they may request of it."""
        ...

    @property
    def now(self) -> float:
        """Return robot time [s]."""
        ...

    def info(self, text: str) -> None:
        """Log an event."""
        ...

    def warn(self, text: str) -> None:
        """Log something that a person should look at."""
        ...

    def look_soon(self) -> None:
        """Request to be woken at this instant."""
        ...


def port_name(beginning: str, topic: str) -> str:
    """Return the name of the port for a topic or a service."""
    return beginning + topic.strip("/").replace("/", "_")


BACK_WITHIN = 5.0  # [s] in which a missing server must appear
STOP_WITHIN = 0.5  # [s] in which the stop that cancelled a goal becomes known here
LOOK_AGAIN = 0.1  # [s] between two polls of what nothing announces

WhenDone = Callable[[Result], None]


class Errand:
    """Something under way for one leaf; `done` is called once, unless it is halted earlier."""

    def __init__(self, shell: Shell, done: WhenDone) -> None:
        self._shell = shell
        self._done: WhenDone | None = done

    def report_to(self, done: WhenDone) -> None:
        """Report the end to somebody else."""
        if not self.is_over:
            self._done = done

    def begin(self) -> None:
        """Begin; an exception is a failure of the leaf."""
        raise NotImplementedError

    def halt(self) -> None:
        """Stop, and report nothing any more."""
        self._done = None

    def pause(self) -> None:
        """Pause it."""

    def resume(self) -> None:
        """Continue."""

    def next_look(self) -> float | None:
        """Return when to poll it next [s]; None if it needs no polling."""
        return None

    def look(self) -> None:
        """Poll it."""

    def end(self, result: Result) -> None:
        """Report how it ended."""
        if self._done is not None:
            done, self._done = self._done, None
            done(result)
            self._shell.look_soon()

    @property
    def is_over(self) -> bool:
        """Return whether it has ended or was halted."""
        return self._done is None


class Waiting(Errand):
    """An errand that needs a server, and waits a while for one."""

    nobody: ClassVar[str] = "nothing serves"  # what is reported about a missing server

    def __init__(self, shell: Shell, done: WhenDone, name: str) -> None:
        super().__init__(shell, done)
        self.name = name
        self.is_sent = False
        self.until = 0.0  # [s] when it stops waiting
        self.earliest = 0.0  # [s] not before: a server that has just gone may still be listed
        self.why = ""  # reason for failing if no server appears

    def send(self) -> bool:
        """Send it, if a server is there; return whether it was sent."""
        raise NotImplementedError

    def begin(self) -> None:
        """Send it, or wait for a server."""
        if not self.send():
            self.wait(f"{self.nobody} {self.name}", f"{self.nobody} {self.name}")

    def wait(self, text: str, why: str) -> None:
        """Wait for a server; at the timeout, fail with this reason."""
        now = self._shell.now
        self.is_sent, self.why = False, why
        self.earliest, self.until = now + LOOK_AGAIN, now + BACK_WITHIN
        self._shell.warn(f"{text}; waiting for up to {BACK_WITHIN:.0f} s")

    def next_look(self) -> float | None:
        """Return when to poll it next [s]; None while a server works on it."""
        return None if self.is_sent else self._shell.now + LOOK_AGAIN

    def look(self) -> None:
        """Send it again once a server is back; fail at the timeout."""
        if self.is_sent or self._shell.now < self.earliest:
            return
        if self.send():
            self._shell.info(f"{self.name}: sent again")
        elif self._shell.now >= self.until:
            self.end(Result(False, self.why))


class GoalErrand(Waiting):
    """A goal of an action."""

    def __init__(self, shell: Shell, done: WhenDone, skill: Skill, goal: Any) -> None:
        super().__init__(shell, done, skill.name)
        self._skill, self._goal = skill, goal
        self._handle: SentGoal | None = None
        self._is_paused = False

    def send(self) -> bool:
        """Send the goal, unless it was cancelled: that may have been a stop, which will soon be known."""
        caller = self._shell.bound[SKILL + self._skill.name]
        if self.why == CANCELLED or not caller.is_available:
            return False
        sent: list[SentGoal] = []
        self.is_sent = True
        handle: SentGoal = caller(self._goal, lambda ended: self._ended(sent[0] if sent else None, ended))
        sent.append(handle)
        self._handle = handle if self.is_sent else None
        return True

    def halt(self) -> None:
        """Cancel the goal."""
        super().halt()
        if self._handle is not None:
            self._handle.cancel()

    def pause(self) -> None:
        """Ask the server to pause it; if it does not, the goal is cancelled, and sent again later."""
        self._is_paused = True
        self._ask_to_pause(True)

    def resume(self) -> None:
        """Resume the goal; send it again if it is gone."""
        self._is_paused = False
        if self.is_sent:
            self._ask_to_pause(False)
        else:
            self.why = ""
            self.begin()

    def _ask_to_pause(self, is_paused: bool) -> None:
        handle = self._handle
        caller = self._shell.bound.get(PAUSES + self._skill.name)
        if handle is None or caller is None:
            return

        def answered(reply: Reply[SetBool.Response]) -> None:
            is_done = reply.response is not None and reply.response.success
            if not is_done and self._handle is handle and self._is_paused is is_paused:
                handle.cancel()
                self._lose()
                if not is_paused:
                    self.begin()

        caller(SetBool.Request(data=is_paused), answered)

    def _lose(self) -> None:
        self._handle, self.is_sent = None, False

    def _ended(self, handle: SentGoal | None, ended: Ended[Any]) -> None:
        if self.is_over or (handle is not None and handle is not self._handle):
            return  # it was halted or abandoned meanwhile
        self._lose()
        if self._is_paused and ended.outcome is not Outcome.SUCCEEDED:
            return  # whoever stopped the robot also ended the goal: it is sent again at the resume
        match ended.outcome:
            case Outcome.SUCCEEDED | Outcome.ABORTED:
                self.end(_result(self._skill, ended))
            case Outcome.LOST if self._skill.restartable:
                self.wait(f"the server of {self.name} is gone", GONE)
            case Outcome.LOST:
                self.end(Result(False, GONE))
            case Outcome.CANCELED:
                # A stop also cancels goals, and its message may still be on its way here: then this is no failure.
                self.why, self.earliest = CANCELLED, self._shell.now
                self.until = self._shell.now + STOP_WITHIN
            case _:
                self.end(Result(False, ended.message or str(ended.outcome)))
        self._shell.look_soon()


GONE, CANCELLED = "its server is gone", "cancelled by someone else"


def _result(skill: Skill, ended: Ended[Any]) -> Result:
    """Return the result of a goal; the fields `outcome` and `message` give its outcome and reason."""
    values = values_of(ended.result)
    is_good = ended.outcome is Outcome.SUCCEEDED
    text = values.get(OUTCOME) if skill.outcomes else ""
    reason = ended.message or text_in(values) or ("" if is_good else str(ended.outcome))
    return Result(is_good, reason, text if isinstance(text, str) else "", values)


def text_in(values: Mapping[str, Value]) -> str:
    """Return the reason in the fields of a result, a response or an end; empty if there is none."""
    texts = (text for name in REASONS if isinstance(text := values.get(name), str))
    return next(filter(None, texts), "")


class CallErrand(Waiting):
    """A call of a service; a response with `success: false` is a failure."""

    def __init__(self, shell: Shell, done: WhenDone, name: str, port: str, request: Any) -> None:
        super().__init__(shell, done, name)
        self._port, self._request = port, request

    def send(self) -> bool:
        """Send the request."""
        caller = self._shell.bound[self._port]
        if not caller.is_available:
            return False
        self.is_sent = True
        caller(self._request, self._answered)
        return True

    def _answered(self, reply: Reply[Any]) -> None:
        if reply.response is None:
            self.end(Result(False, reply.error))
            return
        values = values_of(reply.response)
        self.end(Result(values.get(SUCCESS) is not False, text_in(values), values=values))


EVENTS = "mission/events"
TRIGGER = "trigger_"

Ports = Iterator[tuple[str, Port[Any]]]


def ports_for(equipment: Equipment) -> dict[str, Port[Any]]:
    """Return a port for each value, skill, topic and service that is used, and for the pose if it is read."""
    return {name: port.named(name) for name, port in _ports(equipment)}


def ports_of_triggers(triggers: Iterable[Trigger]) -> dict[str, Port[Any]]:
    """Return a port for each trigger that a message causes."""
    named = {f"{TRIGGER}{one.name}": one for one in triggers if one.topic}
    return {
        name: In(registry.message(one.message), one.topic, qos=Qos.EVENT, may_be_silent=True).named(name)
        for name, one in named.items()
    }


def _ports(equipment: Equipment) -> Ports:
    for name in sorted(equipment.reads & equipment.values.keys()):
        source = equipment.values[name]
        yield (
            VALUE + name,
            In(registry.message(source.message), source.topic, qos=Qos.LATCHED if source.is_latched else Qos.STATE),
        )
    for name, skill in equipment.used.items():
        yield from _of_skill(name, skill)
    for topic, target in equipment.topics.items():
        yield port_name(PUBLISHES, topic), Out(registry.message(target.message), topic, qos=target.qos)
    for name, service in equipment.services.items():
        yield port_name(CALLS, name), Calls(registry.service(service), name)
    if POSE in equipment.reads:
        yield POSE, Looks(source="base_footprint", target="map")
    if equipment.programs:
        yield port_name(PUBLISHES, EVENTS), Out(String, EVENTS, qos=Qos.EVENT)


def _of_skill(name: str, source: SkillSource) -> Ports:
    match source.way:
        case SkillWay.SERVICE:
            yield SKILL + name, Calls(registry.service(source.action), source.topic)
        case SkillWay.ACTION:
            yield SKILL + name, CallsAction(registry.action(source.action), source.topic)
            if source.skill.pausable:
                yield PAUSES + name, Calls(SetBool, f"{source.topic}/{PAUSE}")
        case SkillWay.TOPIC:
            orders, message = source.orders, registry.message(source.action)
            yield SKILL + name, SendsOrders(message, source.topic, servers=orders.servers, qos=orders.qos)
            if (ends := orders.ends) is not None:
                yield (port_name(ENDS, ends.topic), In(registry.message(ends.message), ends.topic, qos=ends.qos))
            if (halts := orders.halts) is not None:
                yield HALTS + name, Out(registry.message(halts.message), halts.topic, qos=halts.qos)
