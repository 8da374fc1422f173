"""Compares what happened with what was expected; pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rbxcompose.expressions.types import Type
from rbxcompose.expressions.values import NOT_ARRIVED
from rbxcompose.findings import Span
from rbxcompose.mission_tests.model import RUNS, Expectations, ExpectedStep
from rbxcompose.mission_tests.record import Done, TrialRecord
from rbxcompose.mission_tests.scope import agrees
from rbxcompose.missions.engine.value_text import show
from rbxcompose.units import format_number

ON_TIME = 0.01  # [s] by which the start of a step may differ from its `at`


@dataclass(frozen=True, slots=True)
class UnmetExpectation:
    """An unmet expectation: a description, its place in the test, the line of the trace that it follows."""

    message: str
    span: Span | None = None
    line: int | None = None


def judge(expect: Expectations, record: TrialRecord, types: Mapping[str, Type]) -> list[UnmetExpectation]:
    """Return the unmet expectations, none for a test that passed; `types` are those of the data."""
    return [
        *_ending(expect, record),
        *_steps(expect.steps, record),
        *_never(expect.never, record),
        *_counts(expect, record),
        *_data(expect, record, types),
        *_published(expect, record),
        *_reports(expect, record),
    ]


def _ending(expect: Expectations, record: TrialRecord) -> Iterator[UnmetExpectation]:
    last = len(record.lines) - 1
    if record.trouble:
        yield UnmetExpectation(record.trouble, expect.outcome_span, last)
        return
    happened = record.outcome
    counts_as = record.end.result if record.end else RUNS
    if expect.outcome and expect.outcome not in (happened, counts_as):
        why = f": {record.end.message}" if record.end and record.end.message else ""
        yield UnmetExpectation(
            f"expected outcome {expect.outcome}, the mission {_how(happened)}{why}", expect.outcome_span, last
        )
    if record.late:
        events = "an event" if record.late == 1 else f"{record.late} events"
        yield UnmetExpectation(
            f"the mission ended at {at(record.now)}, before {events} of the test", expect.outcome_span, last
        )


def _how(outcome: str) -> str:
    return "is still running" if outcome == RUNS else f"ended with {outcome}"


def _steps(expected: Sequence[ExpectedStep], record: TrialRecord) -> Iterator[UnmetExpectation]:
    """Search each step after the previous one, even if that one is missing."""
    behind = 0
    for step in expected:
        found = next((i for i in range(behind, len(record.steps)) if is_it(step, record.steps[i])), None)
        if found is None:
            line = record.steps[behind - 1].line if behind else -1
            yield UnmetExpectation(
                f"expected {_written(step)}: {_nearest(step, record.steps, behind)}", step.span, line
            )
        else:
            behind = found + 1


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


def _nearest(step: ExpectedStep, done: Sequence[Done], behind: int) -> str:
    """Return in words what comes nearest to a missing step: the same call first, then a similar one.

    The same call earlier counts more than a later call with other arguments.
    """
    earlier = [one for one in done[:behind] if is_it(step, one)]
    later = [(one, _differences(step, one)) for one in done[behind:] if one.name == step.name]
    near, differences = min(later, key=lambda pair: ("" in pair[1], len(pair[1])), default=(None, []))
    if near and not (earlier and "" in differences):
        told = [one for one in differences if one and not one.startswith("started")]
        return f"the nearest is {near.text} at {at(near.began)}" + "".join(f", which {one}" for one in told)
    if earlier:
        return f"it was done only earlier, at {at(earlier[-1].began)}"
    return "it never started" if not behind else f"it did not start after {done[behind - 1].text}"


def _written(step: ExpectedStep) -> str:
    ended = f", ended {step.ended}" if step.ended else ""
    return f"{step.text}{ended}" + (f", at {at(step.at)}" if step.at is not None else "")


def _never(never: Sequence[ExpectedStep], record: TrialRecord) -> Iterator[UnmetExpectation]:
    for step in never:
        done = next((one for one in record.steps if is_it(step, one)), None)
        if done:
            yield UnmetExpectation(
                f"{_written(step)} must never be done, but was at {at(done.began)}", step.span, done.line
            )


def _counts(expect: Expectations, record: TrialRecord) -> Iterator[UnmetExpectation]:
    for one in expect.count:
        count = sum(step.name == one.name for step in record.steps)
        if count != one.value:
            yield UnmetExpectation(f"expected {_times(one.name, one.value)}, counted {count}", one.span)


def _times(name: str, count: object) -> str:
    return f"{name} {'once' if count == 1 else f'{count} times'}"


def _data(expect: Expectations, record: TrialRecord, types: Mapping[str, Type]) -> Iterator[UnmetExpectation]:
    for one in expect.data:
        happened, kind = record.data.get(one.name, NOT_ARRIVED), types.get(one.name)
        if not agrees(one.value, happened):
            told = "it has no value" if happened is NOT_ARRIVED else f"it is {show(kind, happened)}"
            yield UnmetExpectation(f"expected {one.name} to be {show(kind, one.value)}, {told}", one.span)


def _published(expect: Expectations, record: TrialRecord) -> Iterator[UnmetExpectation]:
    behind = 0
    for sent in expect.published:
        rest = enumerate(record.published[behind:], behind)
        fits = (i for i, (topic, fields) in rest if topic == sent.topic and agrees(sent.fields, fields))
        found = next(fits, None)
        if found is None:
            others = [show(None, fields) for topic, fields in record.published if topic == sent.topic]
            told = f"; on it were: {', '.join(others[:3])}" if others else "; nothing was published on it"
            yield UnmetExpectation(f"expected {show(None, sent.fields)} on {sent.topic}{told}", sent.span)
        else:
            behind = found + 1


def _reports(expect: Expectations, record: TrialRecord) -> Iterator[UnmetExpectation]:
    for one in expect.reports:
        if not any(one.name in text for text in record.reports):
            yield UnmetExpectation(f"nothing that was logged or reported contains '{one.name}'", one.span)


def at(seconds: float) -> str:
    """Return a time in readable form."""
    return f"{format_number(round(seconds, 3))} s"
