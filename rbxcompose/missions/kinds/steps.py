"""Steps that are done at once, and those that wait.

`log`: write a line to the robot's log.
`set`: give new values to the mission's data.
`publish`: one message on a topic.
`end`: the mission is over.
`check`: does a condition hold now?
`wait`: let time pass.
`wait_for`: until a condition holds.
"""

from __future__ import annotations

from rbxcompose.base.config import PUBLISHED
from rbxcompose.missions import sdk
from rbxcompose.missions.engine.instant_actions import assign, publish
from rbxcompose.missions.program.parts import Assignment
from rbxcompose.missions.sdk import FAILURE, SUCCESS, holds  # looked up in every tick


class LogTask(sdk.Task):
    """Writes one line."""

    __slots__ = ("step",)

    def __init__(self, site: sdk.Site, step: LogStep) -> None:
        super().__init__(site)
        self.step = step

    def begin(self) -> int:
        """Write it."""
        self.engine.say(sdk.Logged(self.step.level, self.run.filled(self.step.template, self.scope)))
        return sdk.SUCCESS


@sdk.kind("log", LogTask)
@sdk.dataclass(frozen=True, slots=True)
class LogStep(sdk.Deed):
    """Write one line; `$name` in it is filled in.

    Example:
        do:
          log: The battery has $battery
          level: warn
    """

    template: sdk.Template = sdk.text()
    level: str = sdk.choice(*sdk.LEVELS, help="Its severity.")

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the text."""
        return sdk.logged_in_words(self.template, self.level)

    def text(self, node: sdk.MissionNode) -> str:
        """Return the text, in which names are not filled in."""
        return self.template.text

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it fails only if it cannot read a value."""
        return sdk.ALWAYS_SUCCEEDS if sdk.is_sure(node, endings.program, endings.robot) else sdk.ANY


class SetTask(sdk.Task):
    """Sets the data once."""

    __slots__ = ("assignments",)

    def __init__(self, site: sdk.Site, step: SetStep) -> None:
        super().__init__(site)
        self.assignments = step.assignments

    def begin(self) -> int:
        """Set the data."""
        assign(self.assignments, self)
        return sdk.SUCCESS


@sdk.kind("set", SetTask)
@sdk.dataclass(frozen=True, slots=True)
class SetStep(sdk.Deed):
    """Compute all right-hand sides first, then set them.

    Example:
        data:
          visited: 0
        do:
          - go_to: corner_1
          - set:
              visited: $visited + 1
          - log: $visited visited
    """

    assignments: tuple[Assignment, ...] = sdk.assignments()

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say what is set to what."""
        return sdk.set_in_words(self.assignments)

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it fails only if it cannot read a value."""
        return sdk.ALWAYS_SUCCEEDS if sdk.is_sure(node, endings.program, endings.robot) else sdk.ANY

    def text(self, node: sdk.MissionNode) -> str:
        """Return the assignments as text."""
        return ", ".join(f"{assignment.name} = {assignment.asked.scalar.text}" for assignment in self.assignments)

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the assignments."""
        return sdk.NodeEffects(assignments=self.assignments)


class PublishTask(sdk.Task):
    """Publishes once."""

    __slots__ = ("message",)

    def __init__(self, site: sdk.Site, step: PublishStep) -> None:
        super().__init__(site)
        self.message = step.message

    def begin(self) -> int:
        """Publish it."""
        publish(self.message, self)
        return sdk.SUCCESS


@sdk.kind("publish", PublishTask)
@sdk.dataclass(frozen=True, slots=True)
class PublishStep(sdk.Deed):
    """Publish a message on a topic of the robot; missing fields are zero or empty.

    Example:
        do:
          publish: cmd_vel/teleop
          message:
            linear:
              x: 0.1
    """

    message: sdk.MessageTemplate = sdk.message("message", PUBLISHED)
    body = sdk.contents("The fields of the message; a single value stands for the only field.", "message")

    may_end = sdk.ends(sdk.ANY)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the topic."""
        return f"Publish on {self.message.target.text}"

    def text(self, node: sdk.MissionNode) -> str:
        """Return the topic."""
        return self.message.target.text

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the message."""
        return sdk.NodeEffects(published=self.message)


class EndTask(sdk.Task):
    """Ends the run that it belongs to."""

    __slots__ = ("step",)

    def __init__(self, site: sdk.Site, step: EndStep) -> None:
        super().__init__(site)
        self.step = step

    def begin(self) -> int:
        """Request the end of the run, which takes effect at the end of this tick."""
        message = self.run.filled(self.step.message, self.scope) if self.step.message else ""
        status = sdk.SUCCESS if self.step.result == sdk.SUCCEEDS else sdk.FAILURE
        if self.run.ending is None or (status, self.run.ending) == (sdk.FAILURE, sdk.SUCCESS):
            self.run.ending, self.run.message = status, message
            if status == sdk.FAILURE:
                self.engine.reasons[self.number] = message or "the mission ended itself in failure"
        return sdk.RUNNING


@sdk.kind("end", EndTask)
@sdk.dataclass(frozen=True, slots=True)
class EndStep(sdk.Deed):
    """End the mission that contains this node, in `success` or `failure`; what runs is halted.

    If two branches of a parallel end it in one tick, failure beats success.

    Example:
        do:
          if: $battery < 10 %
          then:
            end: failure
            message: The battery has only $battery
          else:
            go_to: corner_1
    """

    result: str = sdk.choice(sdk.SUCCEEDS, sdk.FAILS)
    message: sdk.Template | None = sdk.text("A message for the log.", optional=True)

    may_end = sdk.ends(sdk.NEVER)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the result, and the message."""
        return f"End in {self.result}{f': {sdk.spoken(self.message)}' if self.message else ''}"

    @property
    def ends_mission(self) -> str:
        """Return how the mission ends."""
        return self.result


class CheckTask(sdk.Task):
    """Evaluates the condition once."""

    __slots__ = ("condition",)

    def __init__(self, site: sdk.Site, step: CheckStep) -> None:
        super().__init__(site)
        self.condition = step.condition

    def begin(self) -> int:
        """Evaluate the condition."""
        return SUCCESS if holds(self.condition, self.scope) else FAILURE


@sdk.kind("check", CheckTask)
@sdk.dataclass(frozen=True, slots=True)
class CheckStep(sdk.LeafStep):
    """Succeed if the condition holds, else fail.

    Example:
        do:
          - check: $battery > 20 %
          - go_to: corner_1
    """

    condition: sdk.Expression = sdk.condition()

    waits = False
    has_result = False
    lasts = None
    only_asks = True

    may_end = sdk.ends(sdk.ANY)
    sentence = sdk.says("Check that {condition:if}")


class WaitTask(sdk.Task):
    """Has a deadline."""

    __slots__ = ("deadline", "duration")
    saved = times = fresh = ("deadline",)

    def __init__(self, site: sdk.Site, step: WaitStep) -> None:
        super().__init__(site)
        self.duration = step.lasts
        self.deadline = 0.0

    def begin(self) -> int:
        """Set the deadline."""
        self.deadline = self.engine.time + self.number_of(self.duration, "a duration")
        return self.proceed()

    def proceed(self) -> int:
        """Succeed once the deadline has come."""
        return sdk.SUCCESS if self.engine.is_due(self.deadline) else sdk.RUNNING


@sdk.kind("wait", WaitTask)
@sdk.dataclass(frozen=True, slots=True)
class WaitStep(sdk.LeafStep):
    """Succeed after a time; after an interrupt, only the rest of it remains.

    Example:
        do:
          - wait: 5 s
          - go_to: corner_1
    """

    lasts: sdk.Expression = sdk.duration(least=0, counted="a wait")

    waits = True
    has_result = False
    only_asks = False
    sentence = sdk.says("Wait {lasts}")

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it always succeeds if the duration is a literal."""
        return sdk.ALWAYS_SUCCEEDS if isinstance(self.lasts.tree, sdk.Number) else sdk.ANY


class WaitForTask(sdk.Task):
    """Evaluates the condition whenever its value may have changed."""

    __slots__ = ("watched",)

    def __init__(self, site: sdk.Site, step: WaitForStep) -> None:
        super().__init__(site)
        self.watched = sdk.Watched.of(step.condition)

    def begin(self) -> int:
        """Evaluate the condition for the first time."""
        return self.proceed()

    def proceed(self) -> int:
        """Evaluate the condition again."""
        if sdk.holds(self.watched.condition, self.scope):
            return sdk.SUCCESS
        self.engine.watch(self.watched)
        return sdk.RUNNING

    def suspend(self, from_start: bool) -> bool:
        """Return whether it starts again; there is nothing to stop."""
        if from_start:
            self.statuses[self.number] = sdk.IDLE
        return from_start


@sdk.kind("wait_for", WaitForTask)
@sdk.dataclass(frozen=True, slots=True)
class WaitForStep(sdk.LeafStep):
    """Succeed as soon as the condition holds; `timeout` limits the wait.

    Example:
        do:
          wait_for: $battery > 50 %
          timeout: 1 min
    """

    condition: sdk.Expression = sdk.watched()

    waits = True
    has_result = False
    lasts = None
    only_asks = True
    sentence = sdk.says("Wait until {condition:if}")

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return that it succeeds; only a condition that cannot be evaluated is a failure."""
        return sdk.ALWAYS_SUCCEEDS if sdk.is_simple(node) else sdk.ANY
