"""Mistakes in a test are findings, with their places."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rbxcompose.base.findings import FindingKind
from rbxcompose.commands.finding_pages import body_of
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.mission_tests import codes
from tests.loops import for_all
from tests.mission_tests.trying import Trying

FINE = "mocks:\n  go_to:\n  recharge:\nexpect:\n  outcome: success\n"
BAD = """
    with:
      round: 1
    mocks:
      recharg:
        takes: 5 s
      go_to:
        takes: 3 m
        result: blocked
        sets:
          batery: 20 %
          door: 3 s
        fails_at: [0]
        fails_for: [kitchen]
    events:
      - at: 5 s
        set:
          battery: 20 m
      - at: 4 s
        resume: true
      - at: 90 s
        stop: false
      - at: 95 s
      - at: 96 s
        publish:
          topic: cmd_vell
    expect:
      outcome: fine
      for: 60 s
      steps:
        - go_too: dock
        - ended: success
        - go_to: {pose: docks, speed: 1 m/s}
          ended: fainted
        - go_to: dock
          at: 61 s
      never: [charge]
      count:
        recharg: 1
        go_to: -1
      data:
        laps: 2
      published:
        - topic: news
      outcom: success
"""


def test_each_mistake_is_told_at_its_place(trying: Trying, golden: Golden) -> None:
    trial, found = trying.read(BAD)
    assert trial is None
    _, more = trying.read(
        BAD.replace("takes: 3 m", "takes: 3 s")
        .replace("[0]", "[1]")
        .replace("stop: false", "stop: true")
        .replace("outcom: success", "reports: []")
    )
    golden.check("mistakes.txt", found + more)


@for_all(
    "text, words",
    [
        ("mocks: 3\nexpect:\n  outcome: success\n", "'mocks'"),
        ("mocks: [go_to]\nexpect:\n  outcome: success\n", "'mocks'"),
        ("events: {at: 3 s}\nexpect:\n  outcome: success\n", "'events'"),
        ("expect: success\n", "'expect'"),
        ("expect:\n", "needs 'expect'"),
        ("expect: {}\n", "needs 'expect'"),
        ("mocks:\n  go_to:\n", "needs 'expect'"),
        ("expect:\n  outcome: running\n", "every test of a mission ends"),
        ("expect:\n  outcome: running\n  for: 1e14 s\n", "'for' must be at most"),
        ("expect:\n  steps: go_to\n", "'steps'"),
        ("expect:\n  steps:\n    - recharge: dock\n", "takes no argument"),
        ("expect:\n  steps:\n    - [go_to]\n", "this is not a step"),
        ("with: 3\nexpect:\n  outcome: success\n", "'with'"),
        ("with:\n  rounds: -1\nexpect:\n  outcome: success\n", "'rounds'"),
        ("expecting:\n  outcome: success\n", "unknown key 'expecting'"),
    ],
)
def test_a_wrong_shape_is_told(trying: Trying, text: str, words: str) -> None:
    trial, found = trying.read(text)
    assert trial is None
    assert words in found


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("steps: [go_to: dock]\n  never: [go_to: dock]", "'go_to dock' must never be"),
        ("steps: [go_to: dock]\n  never: [go_to]", "'go_to' must never be"),
        ("steps: [{go_to: dock, ended: halted}]\n  never: [go_to: dock]", "'go_to dock' must never be"),
        ("steps: [recharge, recharge]\n  count: {recharge: 1}", "that is 2 times"),
        ("steps: [{recharge: , at: 5 s}, {go_to: , at: 4 s}]", "this is earlier"),
    ],
)
def test_expectations_that_contradict_each_other_are_told(trying: Trying, text: str, words: str) -> None:
    trial, found = trying.read(f"mocks:\n  go_to:\n  recharge:\nexpect:\n  for: 9 s\n  {text}\n")
    assert trial is None
    assert codes.NEVER.code in found
    assert words in found


@pytest.mark.parametrize(
    "text",
    [
        "steps: [go_to: dock]\n  never: [go_to: corner_1]",
        "steps: [go_to: dock]\n  never: [{go_to: dock, ended: failure}]",
        "steps: [{go_to: dock, ended: halted}]\n  never: [{go_to: dock, ended: failure}]",
        "steps: [go_to]\n  never: [go_to: dock]",
        "steps: [recharge, recharge]\n  count: {recharge: 2}",
        "steps: [{recharge: , at: 4 s}, {go_to: , at: 4 s}]",
    ],
)
def test_expectations_that_can_be_met_together_are_fine(trying: Trying, text: str) -> None:
    trial, found = trying.read(f"mocks:\n  go_to:\n  recharge:\nexpect:\n  for: 9 s\n  {text}\n")
    assert trial is not None, found


def test_values_without_the_brackets_of_a_list_are_told_with_them(trying: Trying) -> None:
    trial, found = trying.read("mocks:\n  go_to:\n    fails_for: dock\nexpect:\n  for: 1 s\n")
    assert trial is None
    assert "a list needs brackets: write '[dock]'" in found


def test_a_profile_that_the_robot_does_not_have_is_told_in_the_test(trying: Trying) -> None:
    trial, found = trying.read(f"profile: simulation\n{FINE}")
    assert trial is None
    assert "the robot has no profile 'simulation'\n  --> tried.test.yaml" in found
    assert "has errors, so the test cannot run" not in found
    assert not trying.reading.report.has_errors


def test_a_mock_that_nothing_uses_is_a_warning(trying: Trying) -> None:
    trial, found = trying.read("mocks:\n  go_to:\n  recharge:\nexpect:\n  for: 1 s\n", "states")
    assert trial is not None
    assert codes.UNUSED_MOCK.code in found


def test_a_robot_with_mistakes_is_told_and_its_tests_do_not_run(trying: Trying) -> None:
    path = trying.folder / "broken.test.yaml"
    (trying.folder / "broken.yaml").write_text("rbx: 1\nkind: Robot\nname: broken\nplacs: {}\n", encoding="utf-8")
    path.write_text(f"rbx: 1\nkind: Test\nname: t\nrobot: broken.yaml\nmission: patrol\n{FINE}", encoding="utf-8")
    trial, report = trying.reading.read(path)
    assert trial is None
    assert report.has_errors
    assert any("placs" in finding.message for finding in trying.reading.report)


def test_a_robot_or_mission_that_is_not_there_is_told(trying: Trying) -> None:
    path = trying.folder / "lost.test.yaml"
    path.write_text(f"rbx: 1\nkind: Test\nname: t\nrobot: robt.yaml\nmission: patrol\n{FINE}", encoding="utf-8")
    assert [finding.code for finding in trying.reading.read(path)[1]] == ["RBX1301"]
    assert "did you mean 'patrol'?" in trying.read(FINE, "patrl")[1]


@pytest.mark.parametrize(
    "kind", [codes.UNKNOWN, codes.WRONG_VALUE, codes.NEVER, codes.NO_STEP], ids=lambda kind: kind.code
)
def test_the_example_on_its_page_is_wrong_and_right(trying: Trying, kind: FindingKind) -> None:
    bad, good = re.findall(r"```yaml\n(.*?)```", body_of(kind), re.DOTALL)
    rest = "" if "expect:" in bad else "expect:\n  for: 100 s\n"
    assert kind.code in trying.read(bad + rest)[1]
    assert kind.code not in trying.read(good + rest)[1]


def test_a_slip_of_the_hand_can_be_fixed(trying: Trying) -> None:
    trying.read("mocks:\n  rechrge:\nexpect:\n  for: 1 s\n")
    path = trying.folder / "tried.test.yaml"
    fixes = [finding.fix for finding in trying.reading.read(path)[1] if finding.fix]
    assert [fix.title for fix in fixes] == ["'rechrge' -> 'recharge'"]


@pytest.mark.parametrize(
    ("text", "message", "cure"),
    [
        (FINE + "for: 3 min\n", "unknown key 'for' in this file", "it belongs below 'expect', beside 'outcome'"),
        (
            FINE + "  profile: home\n",
            "unknown key 'profile' in 'expect'",
            "it belongs at the left margin, beside 'robot'",
        ),
        (FINE + "  takes: 3 s\n", "unknown key 'takes' in 'expect'", "it belongs to an entry of 'mocks'"),
        (
            FINE.replace("  go_to:\n", "  go_to: {at: 3 s}\n"),
            "unknown key 'at' in 'mocks.go_to'",
            "it belongs to an entry of 'events'",
        ),
        (
            "events: [{at: 3 s, never: [go_to], resume: true}]\n" + FINE,
            "unknown key 'never' in 'events.0'",
            "it belongs below 'expect', beside 'outcome'",
        ),
    ],
)
def test_a_key_of_another_place_in_the_file_says_where_it_belongs(
    text: str, message: str, cure: str, trying: Trying
) -> None:
    _, found = trying.read(text)
    assert message in found
    assert f"= help: {cure}\n" in found
    assert found.count("error[RBX1001]") == 1


TOUR = """\
rbx: 1
kind: Mission
name: ending
inputs:
  room: {type: text, default: corner_1}
  pause: {type: time, default: 5 min}
do:
  - go_to: dock
  - go_to: $room
    timeout: $pause
"""


@pytest.mark.parametrize(
    ("test", "code"),
    [
        ("with: {room: attic}\nexpect: {outcome: success}", "RBX4131"),
        ("with: {pause: 1 s}\nexpect: {outcome: success}", "RBX4120"),
        ("expect: {outcome: success}", ""),
        ("with: {room: corner_2, pause: 4 min}\nexpect: {outcome: success}", ""),
        ("with: {room: attic}\nexpect: {outcome: failure}", ""),  # it is to fail
        ("with: {room: attic}\nmocks: {go_to: success}\nexpect: {outcome: success}", ""),  # nothing drives there
    ],
)
def test_inputs_with_which_the_robot_cannot_do_a_step_are_a_finding(test: str, code: str, tmp_path: Path) -> None:
    trying = Trying(tmp_path)
    (tmp_path / "missions/ending.yaml").write_text(TOUR, encoding="utf-8")
    trial, found = trying.read(test, "ending")
    assert (trial is None) == (code == "RBX4131")
    assert (f"[{code}]" in found and "--> tried.test.yaml:6:" in found) if code else not found, found
