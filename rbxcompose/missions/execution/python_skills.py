"""Skills in Python on a running robot: their steps, their results, and what they raise."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.execution.errands import Errand, Shell, WhenDone
from rbxcompose.missions.program.outcomes import Result
from rbxcompose.sdk.registry import Activity, Returned, SkillType

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
