"""Expectations of one test that cannot all be met, whatever the mission does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from rbxcompose.findings import Finding, Related
from rbxcompose.mission_tests import codes
from rbxcompose.mission_tests.judge import ON_TIME
from rbxcompose.mission_tests.model import Expectations, ExpectedStep
from rbxcompose.mission_tests.scope import agrees

_REMOVE = "remove one of them"


def contradictions(expect: Expectations) -> Iterator[Finding]:
    """Yield what contradicts something else that is expected."""
    for count in expect.count:
        other = next((one for one in expect.never if _bars_all(one) and one.name == count.name and count.value), None)
        if other is not None:
            message = f"'{count.name}' can begin never, or as often as 'count' says, but not both"
            related = [Related(count.span, "it is to begin here")]
            yield codes.NEVER.at(other.span, message, help=_REMOVE, related=related)
    for step in expect.steps:
        barred = next((one for one in expect.never if _bars(one, step)), None)
        if barred is not None:
            message = f"'{barred.text}' must never be, but it is one of the expected 'steps'"
            related = [Related(step.span, "it is expected here")]
            yield codes.NEVER.at(barred.span, message, help=_REMOVE, related=related)
    yield from _too_many(expect)
    yield from _turned_round(expect)


def _too_many(expect: Expectations) -> Iterator[Finding]:
    """Yield the counts of steps that are listed more often."""
    listed = Counter(step.name for step in expect.steps)
    for count in expect.count:
        if isinstance(count.value, int) and count.value < listed[count.name]:
            times = "once" if listed[count.name] == 1 else f"{listed[count.name]} times"
            last = [step for step in expect.steps if step.name == count.name][-1]
            message = f"'{count.name}' is to begin fewer times than 'steps' has it: that is {times}"
            related = [Related(last.span, "the last of them")]
            yield codes.NEVER.at(count.span, message, help="change the count, or the steps", related=related)


def _turned_round(expect: Expectations) -> Iterator[Finding]:
    """Yield the steps that are to begin before those above them, because they are searched in their order."""
    latest: ExpectedStep | None = None
    for step in expect.steps:
        if step.at is None:
            continue
        if latest is not None and latest.at is not None and step.at < latest.at - 2 * ON_TIME:
            related = [Related(latest.span, "this one is later")]
            yield codes.NEVER.at(
                step.span, "steps are listed as they begin, and this is earlier", help="exchange them", related=related
            )
        else:
            latest = step


def _bars_all(step: ExpectedStep) -> bool:
    return not step.arguments and not step.ended and step.at is None


def _bars(never: ExpectedStep, step: ExpectedStep) -> bool:
    """Return whether every step that is as expected is one that must never be."""
    if never.name != step.name or never.at not in (None, step.at):
        return False
    if never.ended and (not step.ended or never.ended not in (step.ended, never.counts_as.get(step.ended))):
        return False
    return all(
        name in step.arguments and agrees(value, step.arguments[name]) for name, value in never.arguments.items()
    )
