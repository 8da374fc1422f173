"""What the corpus of misconfigured robots promises: mistakes are told at their line, right robots give nothing."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rbxcompose.base.findings import KINDS
from rbxcompose.compiler.check_runner import all_checks
from rbxcompose.missions.analysis.examined import mission_checks
from tests.misconfig.corpus import Case, Outcome, cases, described, figures, kinds, outcomes
from tests.misconfig.page import page, row_start
from tests.soak import Soak

pytestmark = pytest.mark.timeout(300)  # the first of the tests checks all robots, for all of them
WRITTEN = Path(__file__).parents[2] / "docs" / "misconfig.md"


@pytest.fixture(scope="module")
def tried(soak: Soak) -> tuple[Outcome, ...]:
    """What came of all cases, or of those that are right and the first one of each kind that is wrong."""
    return outcomes() if soak.is_on else outcomes(is_whole=False)


def wrong() -> list[Case]:
    return [case for case in cases() if case.kind]


def slip_of(outcome: Outcome) -> str:
    """Return what is wrong with what is said of a case; empty if it is right."""
    case, found = outcome.case, outcome.found
    if case.misses:
        return f"it is found now: say what is expected instead of '# misses:': {sorted(found)}" if found else ""
    if missing := case.expected - found:
        return f"missing {sorted(missing)}, found {sorted(found)}"
    codes = {code for _, _, code in outcome.noise}
    return f"found besides: {sorted(outcome.noise)}" if codes != case.known_noise else ""


def test_each_mistake_is_told_at_its_line_and_nothing_else_is(tried: tuple[Outcome, ...]) -> None:
    slips = {outcome.case.name: slip_of(outcome) for outcome in tried if outcome.case.kind}
    assert {name: slip for name, slip in slips.items() if slip} == {}


def test_an_unusual_robot_that_is_right_gives_no_finding(tried: tuple[Outcome, ...]) -> None:
    right = {outcome.case.name: outcome.found for outcome in tried if not outcome.case.kind}
    assert {name: found for name, found in right.items() if found} == {}


def test_the_corpus_is_as_large_as_it_says_and_most_of_it_is_caught(tried: tuple[Outcome, ...]) -> None:
    found = figures(tried)
    assert found.wrong >= 120
    assert found.right >= 30
    assert found.caught >= 0.9 * found.wrong
    assert found.kinds_caught >= 0.9 * found.kinds >= 45
    assert found.false_alarms == 0


def test_every_kind_is_described_and_has_a_case() -> None:
    assert described().keys() <= kinds().keys() == {case.kind for case in wrong()}


def test_every_wrong_case_says_what_is_wrong_with_it() -> None:
    assert [case.name for case in wrong() if bool(case.expected) == bool(case.misses)] == []


def frayed(text: str) -> bool:
    """Return whether a text begins or ends with what joins two texts, or with a blank."""
    return text != text.strip() or bool(re.match(r"[,;:.]", text)) or bool(re.search(r"[,;:]$", text))


def test_no_message_and_no_help_begins_or_ends_with_a_separator(tried: tuple[Outcome, ...]) -> None:
    texts = {
        text
        for outcome in tried
        for finding in outcome.findings
        for text in (finding.message, finding.label, finding.help, *(related.message for related in finding.related))
    }
    assert [text for text in texts if frayed(text)] == []


def test_no_help_in_a_golden_file_begins_or_ends_with_a_separator() -> None:
    files = (Path(__file__).parents[1]).rglob("golden/**/*.txt")
    helps = [line.partition("= help: ")[2] for file in files for line in file.read_text("utf-8").splitlines()]
    assert len([text for text in helps if text]) > 100
    assert [text for text in helps if frayed(text)] == []


# No component that ships has an action that cannot be restarted, a topic in another QoS class, or sends heartbeats.
NOT_SHIPPED = {"RBX3109", "RBX4116", "RBX3120"}


def test_every_expected_code_exists_and_every_check_has_a_case() -> None:
    all_checks()
    expected = {code for case in wrong() for _, _, code in case.expected}
    assert expected - KINDS.keys() == set()
    rules = {rule.code for rule in all_checks()} | {rule.code for rule in mission_checks()}
    assert rules - expected == NOT_SHIPPED


def test_the_page_of_the_corpus_has_its_kinds_and_how_many_robots_are_of_each() -> None:
    rows = [line for line in WRITTEN.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    starts = [
        row_start(kind, about, [case for case in wrong() if case.kind == kind]) for kind, about in kinds().items()
    ]
    assert [row[: len(start)] for row, start in zip(rows, starts, strict=True)] == starts, "run `make docs`"


@pytest.mark.soak  # it says what came of every case
def test_the_page_of_the_corpus_is_up_to_date() -> None:
    assert WRITTEN.read_text(encoding="utf-8") == page(), "run `make docs`"
