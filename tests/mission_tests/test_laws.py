"""Laws: what was recorded passes as a test, two runs are the same, and the order of mocks means nothing."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.manifest.tree import NOWHERE
from rbxcompose.tools.mission_tests.judge import judge
from rbxcompose.tools.mission_tests.model import Expectations, ExpectedStep, Trial
from rbxcompose.tools.mission_tests.record import Done, TrialRecord
from rbxcompose.tools.mission_tests.runner import run_trial
from tests.mission_tests.trying import Trying

MANY = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
MOCKS = """
    mocks:
      go_to:
        takes: {takes:.1f} s
        fails_at: {fails}
      recharge:
        takes: {charge:.1f} s
        sets:
          battery: 100 %
    events:
      - at: {low:.1f} s
        set:
          battery: 20 %
      - at: {stop:.1f} s
        stop: true
      - at: {resume:.1f} s
        release: true
        resume: true
    expect:
      for: 60 s
"""
TEXTS = st.builds(
    lambda takes, charge, fails, times: MOCKS.format(
        takes=takes, charge=charge, fails=fails, low=times[0], stop=times[1], resume=times[2]
    ),
    st.floats(0, 9),
    st.floats(0, 9),
    st.lists(st.integers(1, 9), max_size=4),
    st.tuples(*[st.floats(0, 40)] * 3).map(sorted),
)


def told(record: TrialRecord) -> list[tuple[float, str]]:
    return [(line.time, line.text) for line in record.lines]


def expecting(trial: Trial, record: TrialRecord) -> Trial:
    """Return a test that expects just what happened."""
    steps = tuple(
        ExpectedStep(step.name, NOWHERE, dict(step.arguments), step.ended, step.began, step.text)
        for step in record.steps
    )
    return replace(trial, expect=Expectations(record.outcome, NOWHERE, trial.expect.until, steps))


@MANY
@given(text=TEXTS)
def test_what_was_recorded_passes_as_a_test_and_two_runs_are_the_same(trying: Trying, text: str) -> None:
    first = run_trial(trying.trial(text))
    second = run_trial(expecting(first.trial, first.record))
    assert told(first.record) == told(second.record)
    assert [problem.message for problem in second.problems if "before" not in problem.message] == []


@MANY
@given(text=TEXTS)
def test_the_order_of_mocks_changes_nothing(trying: Trying, text: str) -> None:
    trial = trying.trial(text)
    turned = replace(trial, mocks=dict(reversed(list(trial.mocks.items()))))
    assert told(run_trial(trial).record) == told(run_trial(turned).record)


NAMES = st.sampled_from(["go_to", "recharge", "wait"])
ENDS = st.sampled_from(["success", "failure", "halted"])
DONE = st.lists(st.tuples(NAMES, ENDS), max_size=12)


def recorded(done: list[tuple[str, str]]) -> TrialRecord:
    steps = [Done(name, name, {}, float(time), -1, ended) for time, (name, ended) in enumerate(done)]
    return TrialRecord("m", steps=steps)


@given(done=DONE, data=st.data())
def test_any_part_of_what_happened_in_its_order_is_found(done: list[tuple[str, str]], data: st.DataObject) -> None:
    kept = data.draw(st.lists(st.booleans(), min_size=len(done), max_size=len(done)))
    steps = tuple(
        ExpectedStep(name, NOWHERE, ended=ended) for (name, ended), keep in zip(done, kept, strict=True) if keep
    )
    assert judge(Expectations(steps=steps, until=1.0), recorded(done), {}) == []


@given(done=DONE, wanted=DONE)
def test_steps_are_found_just_when_they_are_a_subsequence(
    done: list[tuple[str, str]], wanted: list[tuple[str, str]]
) -> None:
    steps = tuple(ExpectedStep(name, NOWHERE, ended=ended) for name, ended in wanted)
    rest = iter(done)
    is_there = all(pair in rest for pair in wanted)
    assert (judge(Expectations(steps=steps), recorded(done), {}) == []) == is_there


@given(done=DONE, step=st.tuples(NAMES, ENDS))
def test_never_is_what_is_nowhere(done: list[tuple[str, str]], step: tuple[str, str]) -> None:
    never = (ExpectedStep(step[0], NOWHERE, ended=step[1]),)
    assert (judge(Expectations(never=never), recorded(done), {}) == []) == (step not in done)
