"""What the test answers in the place of skills, and what it does to the robot."""

from __future__ import annotations

import pytest

from rbxcompose.tools.mission_tests import runner as stage
from tests.mission_tests.trying import Trying
from tests.soak import rare

OPEN = "events:\n  - at: 2 s\n    set:\n      door: false\n"


def text(expect: str, more: str = "", events: str = "") -> str:
    def indented(lines: str, by: int) -> str:
        return "\n".join(" " * by + line for line in lines.splitlines()).strip()

    return (
        "with:\n  rounds: 1\nmocks:\n  go_to:\n    takes: 3 s\n    "
        + indented(more, 4)
        + "\n  recharge:\nevents:\n  - at: 0 s\n    set:\n      battery: 100 %\n  "
        + indented(events, 2)
        + "\nexpect:\n  "
        + indented(expect, 2)
        + "\n"
    )


def test_a_call_takes_its_time(trying: Trying) -> None:
    expect = "steps:\n  - go_to: corner_1\n    at: 0 s\n  - go_to: corner_3\n    at: 6 s"
    assert trying.problems(text(expect)) == []


def test_a_step_that_was_done_before_is_said_to_have_been(trying: Trying) -> None:
    expect = "steps:\n  - go_to: corner_2\n  - go_to: corner_1"
    assert trying.problems(text(expect)) == ["expected go_to corner_1: it was done only earlier, at 0 s"]


def test_a_call_fails_at_its_number(trying: Trying) -> None:
    expect = "steps:\n  - go_to: corner_2\n    ended: failure\n  - go_to: corner_3\n    ended: success"
    assert trying.problems(text(expect, "fails_at: [2]")) == []


def test_a_call_fails_for_an_argument(trying: Trying) -> None:
    expect = "steps:\n  - go_to: corner_3\n    ended: failure\ncount:\n  go_to: 4"
    assert trying.problems(text(expect, "fails_for: [corner_3]")) == []


def test_calls_that_were_halted_are_not_counted(trying: Trying) -> None:
    # The first call of corner_2 is halted by the stop: the second one that ends is that of corner_2 all the same.
    events = "- at: 4 s\n  stop: true\n- at: 9 s\n  release: true\n  resume: true"
    expect = "steps:\n  - go_to: corner_2\n    ended: halted\n  - go_to: corner_2\n    at: 9 s\n    ended: failure"
    assert trying.problems(text(expect, "fails_at: [2]", events)) == []


def test_a_paused_mission_waits_for_its_resume(trying: Trying) -> None:
    events = "- at: 4 s\n  pause: true\n- at: 60 s\n  resume: true"
    assert trying.problems(text("steps:\n  - go_to: corner_3\n    at: 63 s", events=events)) == []


def test_one_that_is_stopped_before_it_begins_begins_at_the_resume(trying: Trying) -> None:
    events = "- at: 0 s\n  stop: true\n- at: 5 s\n  release: true\n  resume: true"
    assert trying.problems(text("steps:\n  - go_to: corner_1\n    at: 5 s", events=events)) == []


def test_the_reason_of_a_failure_is_told(trying: Trying) -> None:
    expected = "outcome: success\nreports: [the way is blocked]"
    verdict = trying.verdict(text(expected, "result: failure\nmessage: the way is blocked"))
    assert verdict.passed
    assert [line.text for line in verdict.record.lines if "blocked" in line.text]


def test_the_message_of_an_end_is_reported(trying: Trying) -> None:
    assert trying.problems("expect: {outcome: failure, reports: [nobody came]}", "ending") == []


def test_values_are_set_when_a_call_has_succeeded_and_see_its_arguments(trying: Trying) -> None:
    more = "sets:\n  battery: 20 %\n  pose: $pose"
    verdict = trying.verdict(text("for: 4 s\nsteps:\n  - go_to: dock", more))
    assert verdict.passed
    told = [line.text for line in verdict.record.lines if line.text.startswith("*")]
    assert told[1:] == ["* battery is 20 %", "* pose is corner 1"]


def test_a_failed_call_sets_nothing(trying: Trying) -> None:
    more = "result: failure\nsets:\n  battery: 20 %"
    assert trying.problems(text("outcome: success\nnever:\n  - recharge\n  - go_to: dock", more)) == []


def test_before_it_is_set_a_value_has_not_arrived(trying: Trying) -> None:
    test = """
        mocks:
          go_to:
        events:
          - at: 5 s
            set:
              battery: 20 %
              door: true
        expect:
          outcome: failure
          reports: [has not arrived yet]
    """
    assert trying.problems(test, "choosing") == ["the mission ended at 0 s, before an event of the test"]


def test_messages_and_reports_are_looked_at(trying: Trying) -> None:
    test = """
        events:
          - at: 3 s
            set:
              door: true
        expect:
          outcome: success
          published:
            - topic: cmd_vel/teleop
              message:
                linear:
                  x: 0.1
          reports: [door is open]
          steps:
            - call_out
            - listen:
              ended: success
    """
    assert trying.problems(test, "waiting") == []


def test_an_end_of_its_own_is_an_outcome(trying: Trying) -> None:
    test = "mocks:\n  go_to: failure\nexpect:\n  outcome: {}\n  steps:\n    - away:\n      ended: failure\n"
    assert trying.problems(test.format("stranded"), "states") == []
    assert trying.problems(test.format("failure"), "states") == []
    place = f"{trying.folder}/missions/states.yaml:12"
    assert trying.problems(test.format("success"), "states") == [
        f"expected outcome success, the mission ended with stranded: {place}: go_to failed"
    ]


def test_data_are_compared_at_the_end(trying: Trying) -> None:
    test = """
        mocks:
          go_to:
        events:
          - at: 0 s
            set:
              battery: 80 %
              door: true
        expect:
          outcome: success
          data:
            seen: {}
    """
    assert trying.problems(test.replace("{}", "1"), "choosing") == []
    assert trying.problems(test.replace("{}", "2"), "choosing") == ["expected seen to be 2, it is 1"]


def test_a_mission_that_waits_for_nothing_that_comes_is_told(trying: Trying) -> None:
    (problem,) = trying.problems(f"{OPEN}expect:\n  outcome: success\n", "patient")
    assert problem == "did not end: since 2 s it waits for something that the test does not do"


def test_a_mission_that_goes_on_and_on_is_told(trying: Trying) -> None:
    text = "with:\n  rounds: 10000\nmocks:\n  go_to:\n    takes: 9 s\n  recharge:\nevents:\n  - at: 0 s\n    set:\n"
    (problem,) = trying.problems(f"{text}      battery: 100 %\nexpect:\n  outcome: success\n")
    assert problem == "did not end within 3600 s of robot time"


def test_one_in_which_no_time_passes_is_told(trying: Trying) -> None:
    text = "with:\n  rounds: 1000000\nmocks:\n  go_to:\n  recharge:\nevents:\n  - at: 0 s\n    set:\n"
    verdict = trying.verdict(f"{text}      battery: 100 %\nexpect:\n  outcome: success\n")
    assert verdict.problems[0].message.startswith("did not end: 5000 steps")


@pytest.mark.parametrize("expect", ["outcome: success", *rare("outcome: running\n  for: 1 h")])
def test_a_loop_that_does_not_wait_ends_after_a_fixed_amount_of_work(
    trying: Trying, expect: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, "MOST_WORK", 20_000)
    first, second = (trying.verdict(f"expect:\n  {expect}\n", "spinning") for _ in range(2))
    (problem,) = first.problems
    assert problem.message.startswith("did not end: 20,000 nodes started or continued within")
    assert problem.message.endswith("missions/spinning.yaml:6 does not wait")
    assert first.record.now == second.record.now < 600


def test_one_that_logs_without_end_is_told(trying: Trying, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "MOST_LINES", 500)
    verdict = trying.verdict("expect:\n  outcome: success\n", "babbling")
    assert verdict.problems[0].message.startswith("did not end: 500 lines of the trace within")
    assert len(verdict.record.lines) < 700
