"""How often, and how soon, what has failed is tried again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.config import Restart, When
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.manifest.section import ComponentOptions
from rbxcompose.runtime.faults import RestartPolicy
from rbxcompose.testing import instance

RESTARTS = st.builds(
    Restart,
    when=st.just("on_failure"),
    max=st.integers(1, 100),
    within=st.floats(0.01, 1e4),
    backoff=st.floats(0.0, 1e4),
)


def restart(when: When) -> Restart:
    return Restart(when=when)


def test_by_default_the_pause_doubles_and_the_fifth_failure_is_the_last() -> None:
    policy = RestartPolicy()
    assert [policy.after_failure(time) for time in (0.0, 1.0, 2.0, 3.0, 4.0)] == [0.1, 0.2, 0.4, 0.8, None]
    assert policy.restarts == 4


def test_failures_that_lie_back_do_not_count() -> None:
    policy = RestartPolicy()
    assert [policy.after_failure(61.0 * number) for number in range(20)] == [0.1] * 20


def test_only_the_time_in_which_it_was_ready_counts() -> None:
    policy = RestartPolicy(Restart(max=2))
    for _ in range(20):
        policy.begin(1000.0 * policy.restarts)
        policy.ready(1000.0 * policy.restarts + 900.0)
        assert policy.after_failure(1000.0 * policy.restarts + 961.0) == 0.1


def test_never_means_no_try_at_all() -> None:
    assert RestartPolicy(restart("never")).after_failure(0.0) is None


def test_always_means_that_there_is_no_last_try() -> None:
    policy = RestartPolicy(restart("always"))
    assert None not in [policy.after_failure(0.01 * number) for number in range(50)]


@pytest.mark.parametrize("when", ["on_failure", "always"])
def test_while_time_stands_still_tries_follow_at_once_and_the_fifth_failure_is_the_last(when: When) -> None:
    policy = RestartPolicy(restart(when))
    assert [policy.after_failure(0.0, stands=True) for _ in range(5)] == [0.0, 0.0, 0.0, 0.0, None]


@given(RESTARTS, st.floats(0.0, 1e4))
def test_what_fails_at_each_try_is_given_up_at_the_failure_that_was_set_however_long_a_try_takes(
    limits: Restart, takes: float
) -> None:
    policy = RestartPolicy(limits)
    now, failures = 0.0, 0
    pause: float | None = 0.0
    while pause is not None:
        now += pause
        policy.begin(now)
        now += takes
        pause = policy.after_failure(now)
        failures += 1
        assert failures <= limits.max
    assert failures == limits.max


@given(RESTARTS)
def test_what_a_manifest_says_stands_in_the_plan_and_its_text(limits: Restart) -> None:
    battery = replace(instance("battery", "battery_sim", {"runtime": "45 s"}), restart=limits)
    plan = Plan("robot", "robot.yaml", (battery,))
    assert load(dump(plan)) == plan


def test_one_word_stands_for_the_map_that_has_it() -> None:
    assert ComponentOptions.model_validate({"restart": "never"}).restart == restart("never")


def test_a_restart_option_reaches_the_plan(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(
        "rbx: 1\nkind: Robot\nname: robot\ncomponents:\n"
        "  battery: {type: battery_sim, runtime: 45 s, restart: {max: 2, within: 1 min}}\n"
    )
    compilation = compile_robot(str(path), environment={})
    assert compilation.plan is not None
    found = {one.name: one.restart for one in compilation.plan.instances}
    assert (found["battery"], found["diagnostics"]) == (Restart(max=2, within=60.0), Restart())
