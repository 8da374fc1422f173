"""`repeat`: the same node, a number of times or for ever."""

from __future__ import annotations

import math

from rbxcompose.missions import sdk
from rbxcompose.missions.sdk import FAILURE, RUNNING, SKIPPED, SUCCESS  # looked up in every tick


class RepeatTask(sdk.Task):
    """Runs one round after the other."""

    __slots__ = ("body", "did", "due", "is_between", "left", "period", "step")
    saved = ("did", "due", "is_between", "left", "period")
    times = ("due",)
    fresh = ("due", "period")

    def __init__(self, site: sdk.Site, step: RepeatStep) -> None:
        super().__init__(site)
        self.body = site.children[0]
        self.step = step
        self.left = math.inf
        self.period = 0.0
        self.due = 0.0  # when the next round may start [s]
        self.is_between = False  # one round has ended and the next one has not started
        self.did = SKIPPED

    def begin(self) -> int:
        """Start the first round, or the one in which it was halted."""
        if self.engine.places.kept and self.engine.places.take_up(self):
            self.due = self.engine.time if self.is_between else self.engine.time + self.period
            return self.proceed()
        rounds, every = self.step.rounds, self.step.every
        self.left = math.inf if rounds is None else self.count_of(rounds, "'repeat'")
        self.period = 0.0 if every is None else self.number_of(every, "'every'")
        if self.left < 1:
            return SKIPPED
        self.did = SKIPPED
        self.is_between = True
        self.due = self.engine.time
        return self.proceed()

    def proceed(self) -> int:
        """Continue with this round; the next one starts in another tick."""
        if self.is_between:
            if not self.engine.is_due(self.due):
                return RUNNING
            self.is_between = False
            self.due = self.engine.time + self.period
            self.forget()
        status = self.advance(self.body)
        if status == RUNNING:
            return RUNNING
        self.engine.outcome = ""
        if status == FAILURE:
            return FAILURE
        if status == SUCCESS:
            self.did = SUCCESS
        self.left -= 1
        until = self.step.until
        if self.left < 1 or (until is not None and sdk.holds(until, self.scope)):
            return self.did
        self.is_between = True
        if self.engine.is_due(self.due):
            self.engine.again(self)
        return RUNNING


@sdk.kind("repeat", RepeatTask)
@sdk.dataclass(frozen=True, slots=True)
class RepeatStep(sdk.Loop):
    """Do the body repeatedly. It fails with the first round that fails, and succeeds after the last.

    Example:
        do:
          repeat: 3
          every: 1 min
          until: $battery < 40 %
          do:
            go_to: corner_1
    """

    rounds: sdk.Expression | None = sdk.count_or_forever(least=1)
    do = sdk.child("What is done in each round.")
    until: sdk.Expression | None = sdk.watched(
        "A condition that ends the loop; it is evaluated after each round and never cuts one short.", optional=True
    )
    every: sdk.Expression | None = sdk.duration(
        "Time from the start of one round to the start of the next.", optional=True, least=0
    )

    flow = sdk.NodeFlow.IN_TURN
    look = sdk.NodeLook("↻")

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say how often, how fast, and what ends it."""
        often = "for ever" if self.rounds is None else sdk.times_in_words(self.rounds)
        every = f", every {sdk.spoken(self.every)}" if self.every else ""
        until = f", until {sdk.condition_in_words(self.until)}" if self.until else ""
        return f"Repeat {often}{every}{until}"

    @property
    def lasts(self) -> sdk.Expression | None:
        """Return `every`."""
        return self.every

    def may_end(self, node: sdk.MissionNode, endings: sdk.Endings) -> sdk.Outcomes:
        """Return the outcomes; an endless loop can only fail."""
        body = endings.of(node.children[0]).plain if node.children else sdk.ANY
        if self.rounds is None and self.until is None:
            return sdk.Outcomes(succeeds=False, fails=body.fails)
        return sdk.Outcomes(fails=body.fails) if self._is_counted(node) else sdk.ANY

    def _is_counted(self, node: sdk.MissionNode) -> bool:
        """Return whether the number of rounds and their period are literals, and `until` can always be evaluated."""
        if not any(asked.expression.names for asked in node.asked):
            return True
        return sdk.is_simple(node) and all(
            expression is None or isinstance(expression.tree, sdk.Number) for expression in (self.rounds, self.every)
        )

    def endless(self, ends: sdk.Outcomes) -> sdk.Advice | None:
        """Return advice on an endless loop."""
        advice = sdk.Advice("this loop never waits", "give it 'every: 1 s', or a 'wait' in its body")
        return advice if self.rounds is None else None

    @property
    def waits(self) -> bool:
        """Return whether it waits between its rounds, which takes a period."""
        return sdk.takes_time(self.every)
