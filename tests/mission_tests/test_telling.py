"""What people and programs read of tests: traces, coverage, JUnit's XML, JSON."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import pytest

from rbxcompose.testing.golden import Golden
from rbxcompose.tools.mission_tests.coverage import Coverage
from rbxcompose.tools.mission_tests.report import MOST_LINES, FileOutcome, TrialWriter, as_json, coverage_text, junit
from rbxcompose.tools.mission_tests.runner import Verdict
from tests.mission_tests.trying import Trying

WRONG = """
    mocks:
      go_to:
        takes: 3 s
        fails_for: [corner_4]
        message: blocked by <a chair>
      recharge:
        takes: 5 s
        sets:
          battery: 100 %
    events:
      - at: 4 s
        set:
          battery: 20 %
    with:
      rounds: 1
    expect:
      outcome: failure
      steps:
        - go_to: corner_1
          at: 2 s
        - go_to: corner_2
          ended: success
        - go_to: corner_4
          ended: success
        - recharge
      never:
        - go_to: dock
      count:
        recharge: 2
      reports: [all done]
"""
RIGHT = WRONG[: WRONG.index("    expect:")] + "    expect:\n      outcome: success\n"


def outcome(verdict: Verdict, trying: Trying) -> FileOutcome:
    return FileOutcome("tried.test.yaml", verdict.trial.name, (), verdict, 0.001)


def covered(*verdicts: Verdict) -> Coverage:
    coverage = Coverage()
    for verdict in verdicts:
        coverage.add(verdict.trial.linked, verdict.trial.names, verdict.seen.keys)
    return coverage


def test_a_failed_test_shows_its_trace_with_what_is_missing(trying: Trying, golden: Golden) -> None:
    verdict = trying.verdict(WRONG)
    assert not verdict.passed
    file_outcome = outcome(verdict, trying)
    writer = TrialWriter()
    text = "\n".join(
        [writer.line(file_outcome), writer.trace(verdict), writer.summary([file_outcome], covered(verdict)), ""]
    )
    golden.check("failed.txt", text.replace(f"{trying.folder}/", ""))


def test_a_long_trace_shows_its_ends_and_what_is_wrong(trying: Trying) -> None:
    test = RIGHT.replace("rounds: 1", "rounds: 100").replace("outcome: success", "never:\n        - go_to: dock")
    verdict = trying.verdict(test)
    lines = TrialWriter().trace(verdict).splitlines()
    assert len(verdict.record.lines) > MOST_LINES * 3 > len(lines)
    assert any("more lines" in line for line in lines)
    assert sum(">>>" in line for line in lines) == len(verdict.problems) == 1


def test_coverage_names_the_ways_that_no_test_took(trying: Trying, golden: Golden) -> None:
    door = (
        "mocks:\n  go_to:\nevents:\n  - at: 0 s\n    set:\n      battery: 80 %\n      door: true\nexpect:\n  for: 9 s\n"
    )
    missed = "mocks:\n  go_to: failure\nexpect:\n  for: 9 s\n"
    verdicts = [trying.verdict(RIGHT), trying.verdict(door, "choosing"), trying.verdict(missed, "states")]
    golden.check("coverage.txt", coverage_text(covered(*verdicts)).replace(f"{trying.folder}/", "") + "\n")


def test_a_second_test_adds_to_what_is_covered(trying: Trying) -> None:
    verdict, two = (
        trying.verdict(f"mocks:\n  go_to: {word}\nexpect:\n  for: 9 s\n", "states") for word in ("failure", "success")
    )
    assert covered(verdict).taken | covered(two).taken == covered(verdict, two).taken
    assert len(covered(verdict, two).taken) > max(len(covered(verdict).taken), len(covered(two).taken))


def test_junit_tells_passed_failed_and_broken_apart(trying: Trying) -> None:
    broken = FileOutcome("broken.test.yaml", "", (), None, 0.002)
    outcomes = [outcome(trying.verdict(RIGHT), trying), outcome(trying.verdict(WRONG), trying), broken]
    root = ElementTree.fromstring(junit(outcomes))
    assert root.tag == "testsuites"
    suite = root.find("testsuite")
    assert suite is not None
    assert {key: suite.attrib[key] for key in ("tests", "failures", "errors")} == {
        "tests": "3",
        "failures": "1",
        "errors": "1",
    }
    cases = suite.findall("testcase")
    assert [[child.tag for child in case] for case in cases] == [[], ["failure"], ["error"]]
    assert all({"name", "classname", "time", "file"} <= case.attrib.keys() for case in cases)
    assert "blocked by <a chair>" in (cases[1][0].text or "")


def test_json_has_what_the_text_has(trying: Trying) -> None:
    right, wrong = trying.verdict(RIGHT), trying.verdict(WRONG)
    told = as_json([outcome(right, trying), outcome(wrong, trying)], covered(right, wrong))
    assert json.loads(json.dumps(told)) == told
    assert [test["passed"] for test in told["tests"]] == [True, False]
    assert len(told["tests"][1]["problems"]) == len(wrong.problems)
    assert told["coverage"]["ways"] == told["coverage"]["taken"] + len(told["coverage"]["missing"])


@pytest.mark.parametrize("colour", [True, False])
def test_colours_are_only_for_terminals(trying: Trying, colour: bool) -> None:
    assert ("\x1b[" in TrialWriter(colour).trace(trying.verdict(WRONG))) == colour
