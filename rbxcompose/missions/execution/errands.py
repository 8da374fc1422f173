"""What a leaf of a mission waits for: a goal, a call, a skill in Python or on topics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol, TypeVar

from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.execution.equipment import ENDS, HALTS, PAUSES, SKILL, MissionConfig, port_name
from rbxcompose.missions.program.goals import SUCCESS, values_of
from rbxcompose.missions.program.outcomes import Result
from rbxcompose.missions.program.program import Skill
from rbxcompose.missions.sources import OUTCOME, SkillSource
from rbxcompose.msgs import registry
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.bound import REASONS, Ended, OrderSender, Outcome, Reply, SentGoal
from rbxcompose.sdk.registry import Activity, Returned, SkillType


class Shell(Protocol):
    """The component: its time, its live ports by name, its log."""

    bound: dict[str, Any]
    config: MissionConfig

    @property
    def now(self) -> float:
        """Return robot time [s]."""

    def info(self, text: str) -> None:
        """Log an event."""

    def warn(self, text: str) -> None:
        """Log something that a person should look at."""

    def look_soon(self) -> None:
        """Request to be woken at this instant."""


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
    reason = ended.message or text_in(values) or ("" if is_good else str(ended.outcome))
    return Result(is_good, reason, _outcome_in(values, skill), values)


def _outcome_in(values: Mapping[str, Value], skill: Skill) -> str:
    """Return the skill's own outcome in the fields of a result or an end; empty if it has none."""
    outcome = values.get(OUTCOME) if skill.outcomes else ""
    return outcome if isinstance(outcome, str) else ""


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


LONGEST = 0.005  # [s] in one call, during which all missions wait
WORDS = ("success", "failure")

T = TypeVar("T")


class PythonErrand(Errand):
    """One run of a skill in Python."""

    def __init__(self, shell: Shell, done: WhenDone, declared: SkillType, arguments: Mapping[str, Value]) -> None:
        super().__init__(shell, done)
        self._declared = declared
        self._arguments = {name: _fitted(declared, name, value) for name, value in arguments.items()}
        self._activity: Activity | None = None
        self._is_paused = False
        self._due = 0.0  # [s] when the next step is due
        self._is_told = False  # it was reported to take long

    def begin(self) -> None:
        """Call the function, or start the activity; an exception is a failure of the leaf."""
        if not self._declared.is_activity:
            returned = self._timed(lambda: self._declared.make(**self._arguments))
            self.end(result_of(True if returned is None else returned))
            return
        made: Any = self._timed(self._declared.make)
        self._timed(lambda: made.start(**self._arguments))
        self._activity, self._due = made, self._shell.now
        self._shell.look_soon()

    def halt(self) -> None:
        """Halt the activity."""
        super().halt()
        if self._activity is not None:
            self._safely(self._activity.halt)

    def pause(self) -> None:
        """Pause the activity; if it raises, it has failed."""
        self._is_paused = True
        if (activity := self._activity) is not None:
            self._safely(lambda: activity.pause(self._shell.now))

    def resume(self) -> None:
        """Resume the activity."""
        self._is_paused, self._due = False, self._shell.now
        if (activity := self._activity) is not None:
            self._safely(lambda: activity.resume(self._shell.now))
        self._shell.look_soon()

    def next_look(self) -> float | None:
        """Return when its next step is due [s]."""
        return None if self._is_paused or self._activity is None else self._due

    def look(self) -> None:
        """Do a step of the activity, if one is due."""
        activity, now = self._activity, self._shell.now
        if activity is None or self._is_paused or now + 1e-9 < self._due:
            return
        self._due = now + 1.0 / activity.rate
        try:
            returned = self._timed(lambda: activity.step(now))
            result = None if returned is None else result_of(returned)
        except (Exception, SystemExit) as error:  # whatever a plug-in raises is its own failure, and reported as such
            result = _raised(error)
        if result is not None:
            self.end(result)

    def _safely(self, call: Callable[[], None]) -> None:
        try:
            self._timed(call)
        except (Exception, SystemExit) as error:
            self._shell.warn(f"{self._declared.name}: {_raised(error).message}")
            self.end(_raised(error))

    def _timed(self, call: Callable[[], T]) -> T:
        began = self._shell.now
        result = call()
        seconds = self._shell.now - began
        if seconds > LONGEST and not self._is_told:
            self._is_told = True
            self._shell.warn(
                f"the skill {self._declared.name} took {seconds * 1e3:.0f} ms in one call and held up all missions: "
                "make it an activity with shorter steps, or an action of a component"
            )
        return result


def result_of(returned: Returned) -> Result:
    """Return the result that a skill gives as True, False, a word or a map.

    Raises:
        TypeError: if it is something else.
    """
    match returned:
        case bool():
            return Result(returned)
        case str():
            return Result(returned == WORDS[0], outcome="" if returned in WORDS else returned)
        case Mapping():
            return Result(True, values=dict(returned))
    raise TypeError(f"a skill returns True, False, an outcome or a map, and not {returned!r}")


def _raised(error: BaseException) -> Result:
    return Result(False, f"{type(error).__name__}: {error}")


def _fitted(declared: SkillType, name: str, value: Value) -> object:
    """Return an argument as the function expects it: counts are whole numbers."""
    is_count = declared.arguments[name].kind.name == "COUNT"
    return int(value) if is_count and isinstance(value, int | float) else value


LATE_BY = 0.2  # [s] how long after an order was abandoned its end may still arrive
ROUNDING = 1e-9  # [s]
REPLACED = "replaced by a newer order"


class Desk:
    """The orders whose ends arrive on one topic, whichever skills and missions they belong to.

    Ends do not name their order, so at most one order is under way.
    """

    def __init__(self) -> None:
        self.current: TopicErrand | None = None
        self.closed_until = -math.inf  # [s] until then, an end belongs to an abandoned order

    def take(self, errand: TopicErrand) -> None:
        """Make an order the one that is under way; abandon the one before it."""
        if self.current is not None:
            self.current.replace()
        self.current = errand

    def leave(self, errand: TopicErrand) -> None:
        """Note that an order has ended or was abandoned."""
        if self.current is errand:
            self.current = None

    def ended(self, message: Any) -> None:
        """Handle an end. One that arrives while no order is under way belongs to an abandoned order."""
        current = self.current
        if current is not None and current.is_sent:
            current.ended(message)
            return
        self.closed_until = -math.inf
        if current is not None:
            current.look_soon()

    def changed(self) -> None:
        """Handle a change of subscribers."""
        if self.current is not None:
            self.current.changed()


class Desks:
    """The desks of all skills that are topics."""

    def __init__(self, shell: Shell) -> None:
        self._shell = shell
        self._desks: dict[str, Desk] = {}  # by the port on which ends arrive, else by that of the skill
        self._watched: set[str] = set()  # skills

    def of(self, source: SkillSource) -> Desk:
        """Return the desk of a skill."""
        asked, ends = SKILL + source.skill.name, source.orders.ends
        desk = self._desks.setdefault(port_name(ENDS, ends.topic) if ends is not None else asked, Desk())
        if asked not in self._watched:
            self._watched.add(asked)
            self._shell.bound[asked].watch(desk.changed)
        return desk

    def ended(self, port: str, message: Any) -> None:
        """Handle the end of an order; ignore it if nothing waits for it."""
        if port in self._desks:
            self._desks[port].ended(message)


class TopicErrand(Waiting):
    """An order on a topic."""

    nobody = "nothing subscribes to"

    def __init__(self, shell: Shell, done: WhenDone, desk: Desk, source: SkillSource, order: Any) -> None:
        super().__init__(shell, done, source.topic)
        self._desk, self._source, self._order = desk, source, order
        self._has_begun = False
        self._sent_to: frozenset[bytes] = frozenset()

    def begin(self) -> None:
        """Send the order once no end of an earlier one can arrive any more, or wait for a subscriber."""
        if self._source.orders.ends is not None:
            self._desk.take(self)
        self._begin_if_free()
        if not self._has_begun:
            self.look_soon()

    def send(self) -> bool:
        """Send it, if there is a subscriber that carries it out."""
        sender: OrderSender[Any] = self._shell.bound[SKILL + self._source.skill.name]
        if not sender.listeners:
            return False
        self.is_sent, self._sent_to = True, sender.listeners
        sender(self._order)
        if self._source.orders.ends is None:
            self.end(Result(True))
        return True

    def halt(self) -> None:
        """Abandon the order."""
        super().halt()
        self._give_up()

    def replace(self) -> None:
        """Abandon the order for a newer one."""
        self._give_up()
        self.end(Result(False, REPLACED))

    def ended(self, message: Any) -> None:
        """Handle its end."""
        values = values_of(message)
        outcome = _outcome_in(values, self._source.skill)
        self.end(Result(values.get(SUCCESS) is True, text_in(values), outcome, values))

    def changed(self) -> None:
        """Check whether any of the subscribers that it was sent to is left."""
        sender: OrderSender[Any] = self._shell.bound[SKILL + self._source.skill.name]
        if not self.is_sent or self._sent_to & sender.listeners:
            return
        if not self._source.skill.restartable:
            self.end(Result(False, GONE))
            return
        self.wait(f"nothing subscribes to {self.name} any more", GONE)
        self.look_soon()

    def next_look(self) -> float | None:
        """Return when to poll it next [s]: when it may be sent, and while there is no subscriber."""
        return super().next_look() if self._has_begun else max(self._desk.closed_until, self._shell.now)

    def look(self) -> None:
        """Send it as soon as possible; fail at the timeout."""
        if self._has_begun:
            super().look()
        else:
            self._begin_if_free()

    def look_soon(self) -> None:
        """Request a poll at this instant."""
        self._shell.look_soon()

    def end(self, result: Result) -> None:
        """Report how it ended."""
        self._desk.leave(self)
        super().end(result)

    def _begin_if_free(self) -> None:
        if self._shell.now + ROUNDING >= self._desk.closed_until:
            self._has_begun = True
            super().begin()

    def _give_up(self) -> None:
        self._desk.leave(self)
        halts = self._source.orders.halts
        if not self.is_sent:
            return
        self.is_sent = False
        self._desk.closed_until = self._shell.now + LATE_BY
        if halts is not None:
            self._shell.bound[HALTS + self._source.skill.name](registry.message(halts.message)())
