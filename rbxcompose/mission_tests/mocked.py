"""Skills and services that a test answers, and the values that it sets: pure, with time as an argument."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.values import NOT_ARRIVED, NotArrived, Value
from rbxcompose.mission_tests.model import FAILS, SUCCEEDS, Mock, ValueSetting
from rbxcompose.mission_tests.scope import TrialScope, agrees
from rbxcompose.missions.engine.scopes import RobotValues
from rbxcompose.missions.program.program import RobotNames
from rbxcompose.missions.program.results import Result

ROUNDING = 1e-9  # [s]


@dataclass(slots=True)
class MockedCall:
    """A call whose answer is due at `due` [s]; while it is held, `due` is the remaining time."""

    leaf: int
    mock: Mock
    arguments: Mapping[str, Value]
    due: float
    is_held: bool = False


class Mocked:
    """Answers calls; the outcome of a call is decided when it ends, so that a halted call does not count."""

    def __init__(self, mocks: Mapping[str, Mock]) -> None:
        self.mocks = mocks
        self._calls: dict[int, MockedCall] = {}
        self._ended: Counter[str] = Counter()

    def start(self, leaf: int, name: str, arguments: Mapping[str, Value], now: float) -> None:
        """Begin to answer a call."""
        mock = self.mocks[name]
        self._calls[leaf] = MockedCall(leaf, mock, arguments, now + mock.takes)

    def halt(self, leaf: int) -> bool:
        """Forget a call; return whether there was one."""
        return self._calls.pop(leaf, None) is not None

    def pause(self, leaf: int, now: float) -> bool:
        """Hold a call; return whether there is one."""
        return self._shift(leaf, -now, True)

    def resume(self, leaf: int, now: float) -> bool:
        """Let a call continue; return whether there is one."""
        return self._shift(leaf, now, False)

    def _shift(self, leaf: int, seconds: float, is_held: bool) -> bool:
        call = self._calls.get(leaf)
        if call is not None and call.is_held != is_held:
            call.due, call.is_held = call.due + seconds, is_held
        return call is not None

    def next_due(self) -> float | None:
        """Return when the next call ends [s]."""
        return min((call.due for call in self._calls.values() if not call.is_held), default=None)

    def ended(self, now: float) -> Iterator[tuple[MockedCall, Result]]:
        """Yield the calls that end now, ordered by due time, then by leaf."""
        due = [call for call in self._calls.values() if not call.is_held and call.due <= now + ROUNDING]
        for call in sorted(due, key=lambda call: (call.due, call.leaf)):
            del self._calls[call.leaf]
            self._ended[call.mock.name] += 1
            yield call, self._result(call)

    def _result(self, call: MockedCall) -> Result:
        mock = call.mock
        outcome = mock.outcome(self._ended[mock.name], call.arguments.get(mock.main), agrees)
        succeeds = mock.outcomes.get(outcome, outcome) == SUCCEEDS
        own = "" if outcome in (SUCCEEDS, FAILS) else outcome
        return Result(succeeds, "" if succeeds else mock.message, own)


class SetValues:
    """The values that a test has set, over those of the robot."""

    def __init__(self, robot: RobotNames, inputs: Mapping[str, Value], below: RobotValues | None = None) -> None:
        self._robot = robot
        self._inputs = inputs
        self.below = below  # the robot's own values, if it runs
        self._set: dict[str, Value] = {}
        self._times: dict[str, float] = {}
        self._counts: dict[str, int] = {}

    def set(self, settings: Mapping[str, ValueSetting], known: Mapping[str, Value], now: float) -> dict[str, Value]:
        """Compute all values, then set and return them; raise what the expressions raise."""
        scope = TrialScope({**self._inputs, **known}, self._robot.places, Now(self, now))
        computed = {name: setting(scope) for name, setting in settings.items()}
        for name, value in computed.items():
            self._counts[name] = self.count(name) + 1
            self._set[name], self._times[name] = value, now
        return computed

    def value(self, name: str) -> Value | NotArrived:
        """Return the newest value."""
        if name in self._set:
            return self._set[name]
        return NOT_ARRIVED if self.below is None else self.below.value(name)

    def age(self, name: str, now: float) -> float | NotArrived:
        """Return the age of a value [s]."""
        if name in self._times:
            return now - self._times[name]
        return NOT_ARRIVED if self.below is None else self.below.age(name)

    def count(self, name: str) -> int:
        """Return how many values have arrived; those of the robot count only until the test sets the first one."""
        if name in self._counts:
            return self._counts[name]
        return 0 if self.below is None else self.below.count(name)


class Now:
    """The values as they are at a time [s]."""

    def __init__(self, values: SetValues, now: float) -> None:
        self._values = values
        self._now = now

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value."""
        return self._values.value(name)

    def age(self, name: str, /) -> float | NotArrived:
        """Return the age of a value [s]."""
        return self._values.age(name, self._now)

    def count(self, name: str, /) -> int:
        """Return how many values have arrived."""
        return self._values.count(name)
