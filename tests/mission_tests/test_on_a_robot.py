"""Tests in which the whole robot runs: only what the test answers or sets is not the robot's."""

from __future__ import annotations

from tests.mission_tests.trying import Trying

STOPPED = """
    with:
      rounds: 1
    events:
      - at: 2 s
        stop: true
      - at: 10 s
        release: true
        resume: true
    expect:
      for: 18 s
      steps:
        - go_to: corner_1
          ended: halted
          at: 0 s
        - go_to: corner_1
          at: 10 s
          ended: success
      never: [recharge]
"""
SHADOWED = """
    mocks:
      recharge:
        takes: 2 s
        sets:
          battery: 90 %
    events:
      - at: 1 s
        set:
          battery: 10 %
    expect:
      for: 20 s
      steps:
        - go_to: corner_1
          ended: halted
        - go_to: dock
          ended: success
        - recharge:
          ended: success
        - go_to: corner_1
      count:
        recharge: 1
"""
PLACED = """
    events:
      - at: 1 s
        set:
          pose: corner_1
    expect:
      outcome: running
      for: 3 s
"""
PUBLISHED = """
    events:
      - at: 2 s
        publish:
          topic: door
          message: true
    expect:
      outcome: success
      steps:
        - listen:
          ended: success
      reports: [door is open]
"""


def test_a_stop_stops_the_robot_and_its_mission(trying: Trying) -> None:
    verdict = trying.verdict(STOPPED)
    assert not verdict.trial.is_complete
    assert [problem.message for problem in verdict.problems] == []


def test_a_value_of_the_test_lies_over_that_of_the_robot(trying: Trying) -> None:
    assert trying.problems(SHADOWED) == []


def test_a_pose_that_the_mission_does_not_read_can_be_set(trying: Trying) -> None:
    assert trying.problems(PLACED) == []


def test_a_skill_that_a_test_answers_can_set_the_pose(trying: Trying) -> None:
    mocked = """
        mocks:
          go_to:
            takes: 1 s
            sets:
              pose: $pose
        expect:
          outcome: running
          for: 3 s
    """
    assert trying.problems(mocked) == []


def test_a_pose_has_no_age_and_no_messages(trying: Trying) -> None:
    assert trying.problems("expect:\n  outcome: success\n", "posed") == []


def test_two_runs_of_a_robot_leave_the_same_trace(trying: Trying) -> None:
    verdict, other = trying.verdict(SHADOWED), trying.verdict(SHADOWED)
    assert verdict.record.lines == other.record.lines


def test_a_message_comes_from_outside(trying: Trying) -> None:
    assert trying.problems(PUBLISHED, "waiting") == []


def test_a_mission_that_cannot_begin_is_told_with_what_it_waits_for(trying: Trying) -> None:
    (problem,) = trying.problems("expect:\n  outcome: success\n", "waiting")
    assert problem == "the mission does not start: nothing has arrived for $door"


def test_a_mission_that_waits_for_its_first_value_can_be_what_a_test_expects(trying: Trying) -> None:
    assert trying.problems("expect:\n  outcome: running\n  for: 5 s\n", "waiting") == []


def test_what_a_mission_waits_for_is_told_though_the_test_sets_another_value(trying: Trying) -> None:
    text = "events:\n  - at: 1 s\n    set:\n      battery: 20 %\nexpect:\n  outcome: success\n"
    (problem,) = trying.problems(text, "waiting")
    assert problem == "the mission does not start: nothing has arrived for $door"


def test_what_the_robot_refuses_is_told(trying: Trying) -> None:
    text = "events:\n  - at: 30 s\n    pause: true\nexpect:\n  for: 40 s\n"
    verdict = trying.verdict(text.replace("events:", "mocks:\n  go_to: failure\nevents:"), "states")
    assert verdict.problems


def test_a_call_that_fails_sets_nothing_on_a_robot_either(trying: Trying) -> None:
    mocked = """
        mocks:
          go_to:
            takes: 1 s
            result: failure
            sets:
              battery: 10 %
        expect:
          outcome: running
          for: 5 s
          never:
            - recharge
            - go_to: dock
    """
    assert trying.problems(mocked) == []
