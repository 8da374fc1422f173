"""What a test expects: each sentence of the language about `expect` and `mocks`, in a mission of a few steps."""

from __future__ import annotations

import pytest

from rbxcompose.base.expressions.values import Value
from rbxcompose.manifest.tree import NOWHERE
from rbxcompose.tools.mission_tests.judge import is_it
from rbxcompose.tools.mission_tests.model import ExpectedStep
from rbxcompose.tools.mission_tests.record import Done
from rbxcompose.tools.mission_tests.scope import agrees
from tests.mission_tests.trying import Trying

SETTING = """
mocks:
  go_to:
    takes: {takes}
events:
  - at: 0 s
    set:
      door: {door}
expect:
{expect}
"""


def problems(trying: Trying, expect: str, *, door: bool = True, takes: str = "3 s") -> list[str]:
    """Return what is not as it is expected of the mission `several`."""
    indented = "\n".join(f"  {line}" for line in expect.splitlines())
    return trying.problems(SETTING.format(door=str(door).lower(), takes=takes, expect=indented), "several")


@pytest.mark.parametrize(("takes", "is_fine"), [("3.008 s", True), ("2.992 s", True), ("3.02 s", False)])
def test_a_step_begins_at_its_time_to_10_ms(trying: Trying, takes: str, is_fine: bool) -> None:
    expect = "steps:\n  - go_to: corner_2\n    at: 3 s"
    assert (problems(trying, expect, takes=takes) == []) is is_fine


@pytest.mark.parametrize(
    ("outcome", "until", "is_fine"),
    [
        ("success", "", True),
        ("running", "for: 5 s", True),
        ("success", "for: 5 s", False),
        ("failure", "for: 5 s", False),
        ("running", "for: 60 s", False),
        ("success", "for: 60 s", True),
    ],
)
def test_the_test_ends_after_its_time_or_with_the_mission(
    trying: Trying, outcome: str, until: str, is_fine: bool
) -> None:
    assert (problems(trying, f"outcome: {outcome}\n{until}") == []) is is_fine


def test_what_is_done_after_the_end_of_the_test_has_not_happened(trying: Trying) -> None:
    assert problems(trying, "for: 2 s\ncount: {go_to: 1}\nsteps: [{go_to: corner_1, ended: running}]") == []


@pytest.mark.parametrize(("order", "is_fine"), [((0.1, 0.2), True), ((0.2, 0.1), False), ((0.1, 0.1), False)])
def test_messages_are_published_in_this_order(trying: Trying, order: tuple[float, float], is_fine: bool) -> None:
    sent = "".join(f"  - topic: cmd_vel/teleop\n    message: {{linear: {{x: {x}}}}}\n" for x in order)
    assert (problems(trying, f"published:\n{sent}") == []) is is_fine


@pytest.mark.parametrize(
    ("steps", "is_fine"),
    [
        ("[{go_to: corner_1}, {go_to: corner_2}]", True),
        ("[{go_to: corner_2}, {go_to: corner_1}]", False),
        ("[{go_to: corner_1}, {go_to: corner_1}]", False),  # one call is one step
        ("[go_to, go_to]", True),
        ("[go_to, go_to, go_to]", False),
    ],
)
def test_steps_are_done_in_this_order_and_each_is_another_one(trying: Trying, steps: str, is_fine: bool) -> None:
    assert (problems(trying, f"steps: {steps}") == []) is is_fine


@pytest.mark.parametrize(("door", "ended"), [(True, "success"), (False, "skipped")])
def test_a_node_with_a_name_is_a_step_also_if_it_was_skipped(trying: Trying, door: bool, ended: str) -> None:
    steps = "steps:\n  - visit:\n    ended: {}"
    assert problems(trying, steps.format(ended), door=door) == []
    assert problems(trying, steps.format("failure"), door=door) != []


@pytest.mark.parametrize(("word", "is_it_so"), [("empty", True), ("failure", True), ("success", False)])
def test_a_step_with_an_outcome_of_its_own_has_also_ended_as_that_counts(word: str, is_it_so: bool) -> None:
    done = Done("look", "look", {}, 0.0, 0, ended="empty")
    assert is_it(ExpectedStep("look", NOWHERE, ended=word, counts_as={"empty": "failure"}), done) is is_it_so


@pytest.mark.parametrize(("step", "is_fine"), [("go_to", False), ("go_to: corner_1", False), ("go_to: dock", True)])
def test_what_must_never_be_done_may_be_done_with_other_arguments(trying: Trying, step: str, is_fine: bool) -> None:
    assert (problems(trying, f"never:\n  - {step}") == []) is is_fine


@pytest.mark.parametrize(("report", "is_fine"), [("is a corn", True), ("division by", True), ("an owl", False)])
def test_reports_are_parts_of_what_is_logged_or_reported(trying: Trying, report: str, is_fine: bool) -> None:
    assert (problems(trying, f"reports: [{report}]") == []) is is_fine


def test_a_datum_that_was_never_given_a_value_is_not_as_expected(trying: Trying) -> None:
    (problem,) = problems(trying, "data:\n  found:\n    ok: true", door=False)
    assert problem == "expected found to be ok: true, it has no value"


@pytest.mark.parametrize("mock", ["go_to:", "go_to: success", "go_to:\n    result: success"])
def test_a_mock_that_says_little_succeeds_at_once(trying: Trying, mock: str) -> None:
    text = SETTING.replace("go_to:\n    takes: {takes}", mock).format(
        door="true", expect="  steps:\n    - visit:\n      at: 0 s"
    )
    assert trying.problems(text, "several") == []


def test_what_a_call_sets_may_read_the_inputs(trying: Trying) -> None:
    test = """
        with:
          rounds: 1
          low: 40 %
        mocks:
          go_to:
            takes: 1 s
            sets:
              battery: $low + 2 %
          recharge:
        events:
          - at: 0 s
            set:
              battery: 100 %
        expect:
          outcome: success
    """
    verdict = trying.verdict(test)
    assert verdict.passed
    assert "* battery is 42 %" in [line.text for line in verdict.record.lines]


def test_a_value_that_is_set_again_is_a_new_message_of_no_age(trying: Trying) -> None:
    setting = "  - at: {} s\n    set: {{door: false}}\n"
    events = "events:\n" + "".join(setting.format(at) for at in (0, 2, 5))
    assert (
        trying.problems(f"{events}expect:\n  outcome: success\n  steps:\n    - heard:\n      at: 5 s\n", "hearing")
        == []
    )


@pytest.mark.parametrize(
    ("expected", "happened", "is_so"),
    [
        ({}, {}, True),
        ({}, {"kitchen": []}, False),
        ({"kitchen": []}, {"kitchen": [], "hallway": []}, True),
        ({"kitchen": {}}, {"kitchen": {"mop": 7.0}}, False),
    ],
)
def test_of_a_map_what_was_written_counts_and_an_empty_one_is_empty(
    expected: Value, happened: Value, is_so: bool
) -> None:
    assert agrees(expected, happened) is is_so
