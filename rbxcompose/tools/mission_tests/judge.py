"""Compares what happened with what was expected; pure."""

from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.expressions.values import NOT_ARRIVED, Value
from rbxcompose.base.findings import Span
from rbxcompose.base.units import format_number
from rbxcompose.missions.engine.world import show
from rbxcompose.tools.mission_tests.model import RUNS, Expectations, ExpectedStep
from rbxcompose.tools.mission_tests.record import Done, TrialRecord
from rbxcompose.tools.mission_tests.scope import agrees

ON_TIME = 0.01  # [s] by which the start of a step may differ from its `at`
MOST_MISSING = 50  # steps that are reported
MOST_COMPARED = 500_000  # pairs of something expected and something that happened

C = TypeVar("C")


@dataclass(frozen=True, slots=True)
class UnmetExpectation:
    """An unmet expectation: a description, its place in the test, the line of the trace that it follows."""

    message: str
    span: Span | None = None
    line: int | None = None


def judge(expect: Expectations, record: TrialRecord, types: Mapping[str, Type]) -> list[UnmetExpectation]:
    """Return the unmet expectations, none for a test that passed; `types` are those of the data."""
    effort = _Effort()
    problems = [
        *_ending(expect, record),
        *_steps(expect.steps, record, effort),
        *_never(expect.never, record, effort),
        *_counts(expect, record),
        *_data(expect, record, types),
        *_published(expect, record, effort),
        *_reports(expect, record, effort),
    ]
    if effort.left < 0:
        problems.append(UnmetExpectation("there is too much to compare: not all that is expected was", None))
    return problems


class _Effort:
    """Counts comparisons: what is expected is compared with what happened, and there may be much of both."""

    def __init__(self) -> None:
        self.left = MOST_COMPARED

    def of(self, candidates: Iterable[C]) -> Iterator[C]:
        """Yield candidates as long as there are comparisons left."""
        for candidate in candidates:
            self.left -= 1
            if self.left < 0:
                return
            yield candidate


class _StepsByName:
    """The steps that ran: those of a name before and after a place among all."""

    def __init__(self, steps: Sequence[Done]) -> None:
        self._steps = steps
        self._places: dict[str, list[int]] = {}
        for place, step in enumerate(steps):
            self._places.setdefault(step.name, []).append(place)

    def after(self, name: str, behind: int) -> Iterator[tuple[int, Done]]:
        """Yield the steps of this name from a place on, with their places."""
        places = self._places.get(name, [])
        for index in range(bisect_left(places, behind), len(places)):
            yield places[index], self._steps[places[index]]

    def before(self, name: str, behind: int) -> Iterator[Done]:
        """Yield the steps of this name before a place, the last one first."""
        places = self._places.get(name, [])
        for index in reversed(range(bisect_left(places, behind))):
            yield self._steps[places[index]]


def _ending(expect: Expectations, record: TrialRecord) -> Iterator[UnmetExpectation]:
    last = len(record.lines) - 1
    if record.trouble:
        yield UnmetExpectation(record.trouble, expect.outcome_span, last)
        return
    happened = record.outcome
    counts_as = record.end.result if record.end else RUNS
    if expect.outcome and expect.outcome not in (happened, counts_as):
        why = f": {record.end.message}" if record.end and record.end.message else ""
        how = "is still running" if happened == RUNS else f"ended with {happened}"
        yield UnmetExpectation(f"expected outcome {expect.outcome}, the mission {how}{why}", expect.outcome_span, last)
    if record.late:
        events = "an event" if record.late == 1 else f"{record.late} events"
        words = f"the mission ended at {at(record.now)}, before {events} of the test"
        yield UnmetExpectation(words, expect.outcome_span, last)


def _steps(expected: Sequence[ExpectedStep], record: TrialRecord, effort: _Effort) -> Iterator[UnmetExpectation]:
    """Search each step after the previous one, even if that one is missing."""
    behind, missing = 0, 0
    done = _StepsByName(record.steps)
    for step in expected:
        found = next((i for i, one in effort.of(done.after(step.name, behind)) if is_it(step, one)), None)
        if effort.left < 0:
            return
        if found is not None:
            behind = found + 1
            continue
        missing += 1
        if missing > MOST_MISSING:
            continue
        line = record.steps[behind - 1].line if behind else -1
        last = record.steps[behind - 1] if behind else None
        near = _nearest(step, done.after(step.name, behind), done.before(step.name, behind), last)
        yield UnmetExpectation(f"expected {_written(step)}: {near}", step.span, line)
    if missing > MOST_MISSING:
        yield UnmetExpectation(f"{missing - MOST_MISSING:,} more of the expected steps are missing")


def is_it(step: ExpectedStep, done: Done) -> bool:
    """Return whether a step that ran is the expected one."""
    return done.name == step.name and not _differences(step, done)


def _differences(step: ExpectedStep, done: Done) -> list[str]:
    """Return the differences between an expected step and one of the same name; an empty text for other arguments."""
    found = []
    arguments = step.arguments.items()
    if any(name not in done.arguments or not agrees(value, done.arguments[name]) for name, value in arguments):
        found.append("")
    if step.ended and step.ended not in (done.ended, step.counts_as.get(done.ended)):
        found.append("was still running" if done.ended == RUNS else f"ended {done.ended}")
    if step.at is not None and abs(step.at - done.began) > ON_TIME:
        found.append(f"started at {at(done.began)}")
    return found


def _nearest(step: ExpectedStep, later: Iterable[tuple[int, Done]], before: Iterable[Done], last: Done | None) -> str:
    """Return in words what comes nearest to a missing step: the same call first, then a similar one.

    The same call earlier counts more than a later call with other arguments. `last` is the latest expected step.
    """
    earlier = next((item for item in before if is_it(step, item)), None)
    pairs = ((one, _differences(step, one)) for _, one in later)
    near, differences = min(pairs, key=lambda pair: ("" in pair[1], len(pair[1])), default=(None, []))
    if near and not (earlier and "" in differences):
        others = [difference for difference in differences if difference and not difference.startswith("started")]
        return "".join([f"the nearest is {near.text} at {at(near.began)}", *(f", which {other}" for other in others)])
    if earlier:
        return f"it was done only earlier, at {at(earlier.began)}"
    return f"it did not start after {last.text}" if last else "it never started"


def _written(step: ExpectedStep) -> str:
    ended = f", ended {step.ended}" if step.ended else ""
    return f"{step.text}{ended}" + (f", at {at(step.at)}" if step.at is not None else "")


def _never(never: Sequence[ExpectedStep], record: TrialRecord, effort: _Effort) -> Iterator[UnmetExpectation]:
    steps = _StepsByName(record.steps)
    for step in never:
        done = next((one for _, one in effort.of(steps.after(step.name, 0)) if is_it(step, one)), None)
        if done:
            words = f"{_written(step)} must never be done, but was at {at(done.began)}"
            yield UnmetExpectation(words, step.span, done.line)


def _counts(expect: Expectations, record: TrialRecord) -> Iterator[UnmetExpectation]:
    counts = Counter(step.name for step in record.steps)
    for one in expect.count:
        if counts[one.name] != one.value:
            times = "once" if one.value == 1 else f"{one.value} times"
            yield UnmetExpectation(f"expected {one.name} {times}, counted {counts[one.name]}", one.span)


def _data(expect: Expectations, record: TrialRecord, types: Mapping[str, Type]) -> Iterator[UnmetExpectation]:
    for datum in expect.data:
        happened, kind = record.data.get(datum.name, NOT_ARRIVED), types.get(datum.name)
        if not agrees(datum.value, happened):
            actual = "it has no value" if happened is NOT_ARRIVED else f"it is {show(kind, happened)}"
            yield UnmetExpectation(f"expected {datum.name} to be {show(kind, datum.value)}, {actual}", datum.span)


def _published(expect: Expectations, record: TrialRecord, effort: _Effort) -> Iterator[UnmetExpectation]:
    behind = 0
    by_topic: dict[str, list[tuple[int, Mapping[str, Value]]]] = {}
    for place, (topic, fields) in enumerate(record.published):
        by_topic.setdefault(topic, []).append((place, fields))
    for sent in expect.published:
        all_sent = by_topic.get(sent.topic, [])
        rest = range(bisect_left(all_sent, behind, key=lambda one: one[0]), len(all_sent))
        fits = (all_sent[index][0] for index in effort.of(rest) if agrees(sent.fields, all_sent[index][1]))
        found = next(fits, None)
        if effort.left < 0:
            return
        if found is None:
            others = [show(None, fields) for _, fields in all_sent[:3]]
            actual = f"; on it were: {', '.join(others)}" if others else "; nothing was published on it"
            yield UnmetExpectation(f"expected {show(None, sent.fields)} on {sent.topic}{actual}", sent.span)
        else:
            behind = found + 1


def _reports(expect: Expectations, record: TrialRecord, effort: _Effort) -> Iterator[UnmetExpectation]:
    texts = list(dict.fromkeys(record.reports))
    for report in expect.reports:
        is_there = any(report.name in text for text in effort.of(texts))
        if effort.left < 0:
            return
        if not is_there:
            yield UnmetExpectation(f"nothing that was logged or reported contains '{report.name}'", report.span)


def at(seconds: float) -> str:
    """Return a time in readable form."""
    return f"{format_number(round(seconds, 3))} s"
