"""Modifiers of a node that has started: they change its result, act on it, limit it, retry it, keep it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.missions import codes, sdk


class TurningTask(sdk.Decorator):
    """Replaces some results by others, and then drops the name of the outcome."""

    __slots__ = ("turned",)

    def __init__(self, site: sdk.Site, options: Turning, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.turned = options.turns if options.is_on else {}

    def proceed(self) -> int:
        """Continue, and replace the result."""
        status = self.advance(self.inner)
        turned = self.turned.get(status, status)
        if turned != status:
            self.engine.outcome = ""
        return turned


@sdk.dataclass(frozen=True, slots=True)
class Turning(sdk.Modifier):
    """A modifier that replaces results; it may be switched off."""

    is_on: bool = sdk.flag()

    may_skip = False
    value = None
    turns: ClassVar[dict[int, int]]  # replacements by result
    words: ClassVar[str]

    def clause(self) -> str:
        """Say what it replaces, if it is on."""
        return self.words if self.is_on else ""


class OptionalTask(TurningTask):
    """Keeps in mind whether its node failed, and whether it ever succeeded."""

    __slots__ = ("failed", "succeeded")
    saved = reported = ("failed", "succeeded")

    def __init__(self, site: sdk.Site, options: Optional, inner: sdk.Task) -> None:
        super().__init__(site, options, inner)
        self.failed = self.succeeded = False

    def advance(self, child: sdk.Task) -> int:
        """Start the child or continue with it, and keep in mind how it ended."""
        status = super().advance(child)
        if self.turned:
            self.failed |= status == sdk.FAILURE
            self.succeeded |= status == sdk.SUCCESS
        return status

    def only_failed(self) -> bool | None:
        """Return whether its node failed each time; None if it has not ended yet, or is not optional."""
        return not self.succeeded if self.failed or self.succeeded else None


@sdk.modifier("optional", OptionalTask)
class Optional(Turning):
    """Count a failure as success.

    Example:
        do:
          - go_to: corner_1
            optional: true
          - go_to: dock
    """

    __slots__ = ()
    turns = {sdk.FAILURE: sdk.SUCCESS}
    words = "a failure does not matter"

    def changed(self, inner: sdk.Outcomes) -> sdk.Outcomes:
        """Return the outcomes with failure as success."""
        if not self.is_on or not inner.counting_as(sdk.FAILS):
            return inner
        return inner.of(sdk.SUCCEEDS).both(sdk.ALWAYS_SUCCEEDS)

    @property
    def serves(self) -> sdk.ModifierScope:
        """Return the nodes that may fail."""
        return sdk.ModifierScope.FAILING if self.is_on else sdk.ModifierScope.ALL

    @property
    def forgives(self) -> bool:
        """Return true, even for one that could not be read: no finding blames the node then."""
        return True


@sdk.modifier("invert", TurningTask)
class Invert(Turning):
    """Swap success and failure.

    Example:
        do:
          - check: $battery < 20 %
            invert: true
          - go_to: corner_1
    """

    __slots__ = ()
    turns = {sdk.FAILURE: sdk.SUCCESS, sdk.SUCCESS: sdk.FAILURE}
    words = "success counts as failure, and failure as success"
    serves = sdk.ModifierScope.ALL

    def changed(self, inner: sdk.Outcomes) -> sdk.Outcomes:
        """Return the outcomes with success and failure swapped."""
        return sdk.Outcomes(inner.counting_as(sdk.FAILS), inner.counting_as(sdk.SUCCEEDS)) if self.is_on else inner


ON_START, ON_SUCCESS, ON_FAILURE, ON_HALT = "on_start", "on_success", "on_failure", "on_halt"
_ON: Mapping[int, str] = {sdk.SUCCESS: ON_SUCCESS, sdk.FAILURE: ON_FAILURE}


class HooksTask(sdk.Decorator):
    """Runs the hooks when its node starts, ends or is halted."""

    __slots__ = ("moments",)

    def __init__(self, site: sdk.Site, options: Hooks, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.moments = options.moments

    def begin(self) -> int:
        """Run the hook of the start, and start."""
        sdk.act(self.moments, ON_START, self)
        return self.proceed()

    def proceed(self) -> int:
        """Continue, and run the hook of the result at the end."""
        status = self.advance(self.inner)
        if status in _ON:
            sdk.act(self.moments, _ON[status], self)
        return status

    def halt(self) -> None:
        """Stop the node, and run the hook of a halt."""
        super().halt()
        sdk.act_safely(self.moments, ON_HALT, self)

    def suspend(self, from_start: bool) -> bool:
        """Suspend the node; if it is to start again, that is a halt."""
        starts_over = super().suspend(from_start)
        if starts_over:
            sdk.act_safely(self.moments, ON_HALT, self)
        return starts_over


@sdk.modifier(ON_START, HooksTask)
class Hooks(sdk.Acting):
    """Act when the node starts or ends: `set`, `log` or `publish`.

    They run once per node, not per attempt, and see its result before `optional` and `invert`.

    Example:
        data:
          missed: 0
        do:
          go_to: corner_1
          on_start:
            log: Going to the first corner
          on_failure:
            set:
              missed: $missed + 1
    """

    on_start = sdk.hook()
    on_success = sdk.hook("What is set, logged or published when the node succeeds.")
    on_failure = sdk.hook("What is set, logged or published when the node fails.")
    on_halt = sdk.hook("What is set, logged or published when the node is halted.")


SHORTEST = 1e-6  # [s] of a meaningful timeout


class Cutting(sdk.Modifier):
    """A modifier that may make its node fail."""

    __slots__ = ()
    may_skip = False
    serves = sdk.ModifierScope.ALL

    def changed(self, inner: sdk.Outcomes) -> sdk.Outcomes:
        """Return that it may also fail."""
        return inner.both(sdk.ALWAYS_FAILS)


class AsLongAsTask(sdk.Decorator):
    """Evaluates its condition at each tick."""

    __slots__ = ("watched",)

    def __init__(self, site: sdk.Site, options: AsLongAs, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.watched = sdk.Watched.of(options.value)

    def proceed(self) -> int:
        """Evaluate the condition, then continue."""
        if not sdk.holds(self.watched.condition, self.scope):
            self.cut(f"not as long as {self.watched.condition.text}")
            return sdk.FAILURE
        status = self.advance(self.inner)
        if status == sdk.RUNNING:
            self.engine.watch(self.watched)
        return status


@sdk.modifier("as_long_as", AsLongAsTask)
@sdk.dataclass(frozen=True, slots=True)
class AsLongAs(Cutting):
    """Fail as soon as the condition does not hold, and halt the node.

    Example:
        do:
          go_to: corner_1
          as_long_as: $battery > 20 %
    """

    value: sdk.Expression = sdk.watched()

    clause = sdk.says("as long as {value:if}")


class TimeoutTask(sdk.Decorator):
    """Has a deadline."""

    __slots__ = ("allowed", "deadline", "duration")
    saved = fresh = ("allowed", "deadline")
    times = ("deadline",)

    def __init__(self, site: sdk.Site, options: Timeout, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.duration = options.value
        self.allowed = 0.0  # [s]
        self.deadline = 0.0

    def begin(self) -> int:
        """Set the deadline."""
        self.allowed = self.number_of(self.duration, "a timeout")
        self.deadline = self.engine.time + self.allowed
        return self.proceed()

    def proceed(self) -> int:
        """Continue, unless the deadline has come."""
        status = self.advance(self.inner)
        if status != sdk.RUNNING or not self.engine.is_due(self.deadline):
            return status
        self.cut(f"timeout of {format_quantity(self.allowed, TIME)}")
        return sdk.FAILURE


@sdk.modifier("timeout", TimeoutTask)
@sdk.dataclass(frozen=True, slots=True)
class Timeout(Cutting):
    """Fail when the node takes longer, counting all attempts; a result at that very instant is in time.

    Example:
        do:
          go_to: corner_1
          timeout: 30 s
    """

    value: sdk.Expression = sdk.duration(
        least=SHORTEST, counted="a timeout", effect="of zero lets the step fail at once"
    )

    clause = sdk.says("for at most {value}")

    @property
    def limit(self) -> sdk.Expression | None:
        """Return the duration."""
        return self.value


class AttemptsTask(sdk.Decorator):
    """Starts the task inside again after a failure."""

    __slots__ = ("deadline", "is_between", "left", "tries")
    saved = ("deadline", "is_between", "left")
    times = fresh = ("deadline",)

    def __init__(self, site: sdk.Site, options: Attempts, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.tries = options
        self.left = math.inf
        self.deadline = 0.0  # of this attempt, or of the pause [s]
        self.is_between = False

    def begin(self) -> int:
        """Try for the first time."""
        self.left = math.inf if self.tries.value is None else self.count_of(self.tries.value, "'attempts'")
        self._begin_attempt()
        return self.proceed()

    def proceed(self) -> int:
        """Continue with this attempt, or begin the next one."""
        if self.is_between:
            if not self.engine.is_due(self.deadline):
                return sdk.RUNNING
            self._begin_attempt()
        status = self.advance(self.inner)
        if status == sdk.RUNNING and self.tries.timeout and self.engine.is_due(self.deadline):
            self.cut("timeout of an attempt")
            status = sdk.FAILURE
        if status != sdk.FAILURE:
            return status
        self.left -= 1
        if self.left < 1:
            return sdk.FAILURE
        self.is_between = True
        self.deadline = self.engine.time + self._seconds(self.tries.pause, "'attempt_pause'")
        if self.engine.is_due(self.deadline):
            self.engine.again(self)
        return sdk.RUNNING

    def _begin_attempt(self) -> None:
        self.is_between = False
        self.deadline = self.engine.time + self._seconds(self.tries.timeout, "'attempt_timeout'")

    def _seconds(self, expression: sdk.Expression | None, what: str) -> float:
        return 0.0 if expression is None else self.number_of(expression, what)


@sdk.modifier("attempts", AttemptsTask)
@sdk.dataclass(frozen=True, slots=True)
class Attempts(sdk.Modifier):
    """Retry after a failure, at the next tick or after a pause.

    Example:
        do:
          go_to: corner_1
          attempts: 3
          attempt_timeout: 20 s
          attempt_pause: 2 s
    """

    value: sdk.Expression | None = sdk.count_or_forever(is_required=False, least=1)
    timeout: sdk.Expression | None = sdk.duration(
        "How long each attempt may take.", key="attempt_timeout", optional=True
    )
    pause: sdk.Expression | None = sdk.duration(
        "The time between an attempt that failed and the next one.", key="attempt_pause", optional=True
    )

    may_skip = False
    repeats = True

    @classmethod
    def read(cls, reader: sdk.NodeReader) -> Self:
        """Read its settings; there must be a number of attempts."""
        read = cls(**cls.values(reader))
        if not reader.has(cls.name):
            key = "attempt_timeout" if read.timeout else "attempt_pause"
            reader.add(codes.MISSING.at(reader.key_span(key), f"'{key}' needs 'attempts': how often it is tried"))
        return read

    def changed(self, inner: sdk.Outcomes) -> sdk.Outcomes:
        """Return that endless attempts end in success, unless each has a timeout."""
        return inner.of(sdk.SUCCEEDS) if self.value is None and not self.timeout else inner

    @property
    def serves(self) -> sdk.ModifierScope:
        """Return the nodes that may fail; with a timeout for each attempt, any may."""
        return sdk.ModifierScope.ALL if self.timeout else sdk.ModifierScope.FAILING

    def clause(self) -> str:
        """Say how often, and how long."""
        often = "again until it succeeds" if self.value is None else f"tried {sdk.times_in_words(self.value)} at most"
        each = f", each for at most {sdk.spoken(self.timeout)}" if self.timeout else ""
        pause = f", {sdk.spoken(self.pause)} apart" if self.pause else ""
        return f"{often}{each}{pause}"

    @property
    def said(self) -> str:
        """Return its settings."""
        return ", ".join(expression.text for expression in (self.value, self.timeout, self.pause) if expression)

    @property
    def endless(self) -> sdk.Advice | None:
        """Return advice on endless attempts."""
        advice = sdk.Advice(
            "this retries for ever without waiting", "give it a number of attempts, or an 'attempt_pause'"
        )
        return advice if self.value is None and not sdk.takes_time(self.pause) else None

    @property
    def attempt_limit(self) -> sdk.Expression | None:
        """Return the time limit of each attempt."""
        return self.timeout


class SaveTask(sdk.Decorator):
    """Keeps the result at the end."""

    __slots__ = ("name",)

    def __init__(self, site: sdk.Site, options: Save, inner: sdk.Task) -> None:
        super().__init__(site, inner)
        self.name = options.kept_as.text

    def proceed(self) -> int:
        """Continue, and keep the result at the end."""
        status = self.advance(self.inner)
        if status != sdk.RUNNING and self.name:
            self.run.data[self.name] = self.inner.result()
        return status


@sdk.modifier("save", SaveTask)
@sdk.dataclass(frozen=True, slots=True)
class Save(sdk.Plain):
    """Keep the result of a skill or a `call`, the outputs of a `use`, or `{done, failed}` of a `for`.

    It is also kept after a failure.

    Example:
        do:
          - for: corner
            in: [corner_1, corner_2]
            if_one_fails: next
            do:
              go_to: $corner
            optional: true
            save: tour
          - log: $tour.failed could not be reached
    """

    kept_as: sdk.ScalarNode = sdk.new_name("a name for the result")

    value = None
    clause = sdk.says("keeping the result as {kept_as}")

    @property
    def saved(self) -> sdk.ScalarNode | None:
        """Return the name."""
        return self.kept_as if self.kept_as.text else None

    @property
    def said(self) -> str:
        """Return the name."""
        return self.kept_as.text
