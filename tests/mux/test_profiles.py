"""Each rule of the programs of ROS that a profile reproduces, its holes included, and what the default does instead."""

from __future__ import annotations

import pytest

from rbxcompose.domains.muxes.config import MODE_OF, MuxProfile
from tests.mux.velocities import Driven, Input

HIGH: Input = {"priority": 100, "timeout": 0.5}
LOW: Input = {"priority": 10, "timeout": 0.5}
BOTH = {"high": HIGH, "low": LOW}


# twist_mux


def test_twist_mux_lets_the_highest_priority_through_until_it_expires() -> None:
    mux = Driven(BOTH, profile="twist_mux")
    assert mux.send(0.0, "low", 1.0)
    assert mux.send(0.1, "high", 2.0)
    assert not mux.send(0.6, "low", 1.0)  # exactly at the timeout it has not expired yet
    assert mux.send(0.7, "low", 1.0)


def test_twist_mux_sends_no_stop_of_its_own() -> None:
    mux = Driven(BOTH, profile="twist_mux")
    mux.send(0.0, "low", 1.0)
    mux.at(9.0)
    assert mux.speeds == [1.0]
    usual = Driven(BOTH)
    usual.send(0.0, "low", 1.0)
    usual.at(9.0)
    assert usual.speeds == [1.0, 0.0]


def test_twist_mux_gives_equal_priorities_to_the_first_in_the_list_always() -> None:
    mux = Driven({"one": LOW, "two": LOW}, profile="twist_mux")
    assert mux.send(0.0, "two", 2.0)
    assert mux.send(0.1, "one", 1.0)
    assert not mux.send(0.2, "two", 2.0)


def test_in_twist_mux_priority_0_never_passes_and_by_default_it_does() -> None:
    none: dict[str, Input] = {"none": {"priority": 0, "timeout": 0.5}}
    assert not Driven(none, profile="twist_mux").send(0.0, "none", 1.0)
    assert Driven(none).send(0.0, "none", 1.0)


@pytest.mark.parametrize(("priority", "passes"), [(-5, False), (999, True)])
def test_twist_mux_brings_priorities_into_0_to_255(priority: int, passes: bool) -> None:
    mux = Driven(
        {"top": {"priority": 255, "timeout": 0.5}, "odd": {"priority": priority, "timeout": 0.5}}, profile="twist_mux"
    )
    assert mux.send(0.0, "odd", 1.0) == passes
    assert mux.send(0.1, "top", 2.0)
    assert not mux.send(0.2, "odd", 1.0)  # 999 is no more than 255, and the first of equal ones wins


def test_in_twist_mux_a_timeout_of_0_masks_what_is_below_before_its_first_message_and_for_ever() -> None:
    mux = Driven({"high": {"priority": 100, "timeout": 0}, "low": LOW}, profile="twist_mux")
    assert not mux.send(0.0, "low", 1.0)
    assert mux.send(0.1, "high", 2.0)
    assert not mux.send(99.0, "low", 1.0)


def test_a_lock_of_twist_mux_masks_priorities_strictly_below_it_while_it_is_true() -> None:
    mux = Driven(BOTH, profile="twist_mux", locks={"pause": {"topic": "pause", "priority": 100}})
    assert mux.send(0.0, "low", 1.0)
    mux.flag(0.1, "pause", is_on=True)
    assert not mux.send(0.2, "low", 1.0)
    assert mux.send(0.3, "high", 2.0)
    mux.flag(0.9, "pause", is_on=False)
    assert mux.send(1.0, "low", 1.0)


def test_a_lock_of_twist_mux_with_a_timeout_starts_locked_and_locks_when_it_expires() -> None:
    mux = Driven(BOTH, profile="twist_mux", locks={"pause": {"topic": "pause", "priority": 50, "timeout": 0.5}})
    assert not mux.send(0.0, "low", 1.0)
    mux.flag(0.1, "pause", is_on=False)
    assert mux.send(0.2, "low", 1.0)
    assert not mux.send(0.7, "low", 1.0)


def test_when_a_source_of_twist_mux_expires_the_next_priority_passes_and_nothing_leaks() -> None:
    mux = Driven({"safety": HIGH, "joy": {"priority": 50, "timeout": 2.0}, "any": LOW}, profile="twist_mux")
    mux.send(0.0, "safety", 3.0)
    mux.send(0.1, "joy", 2.0)
    assert not mux.send(0.6, "any", 1.0)
    assert mux.send(0.7, "joy", 2.0)


# yocs_cmd_vel_mux


def test_yocs_lets_a_higher_priority_take_over_and_a_lower_one_wait() -> None:
    mux = Driven(BOTH, profile="yocs")
    assert mux.send(0.0, "low", 1.0)
    assert mux.send(0.1, "high", 2.0)
    assert not mux.send(0.2, "low", 1.0)
    assert mux.core.active == "high"


def test_yocs_leaks_one_message_of_a_lower_source_on_hand_back_and_the_default_does_not() -> None:
    rules = {"safety": (2, 0.2), "joy": (1, 1.0), "any": (0, 1.0)}
    sources: dict[str, Input] = {name: {"priority": rank, "timeout": time} for name, (rank, time) in rules.items()}
    leaks = {}
    for profile in ("yocs", "default"):
        mux = Driven(sources, profile=profile)
        mux.send(0.0, "safety", 3.0)
        mux.send(0.1, "joy", 2.0)
        leaks[profile] = mux.send(0.3, "any", 1.0)
        assert mux.send(0.4, "joy", 2.0)
    assert leaks == {"yocs": True, "default": False}


def test_between_equal_priorities_of_yocs_the_holder_keeps_the_output_until_its_own_timeout() -> None:
    mux = Driven({"one": LOW, "two": LOW}, profile="yocs")
    assert mux.send(0.0, "two", 2.0)
    assert not mux.send(0.4, "one", 1.0)
    assert mux.send(0.6, "one", 1.0)
    assert not mux.send(0.7, "two", 2.0)


def test_a_source_of_yocs_with_the_timeout_0_lets_go_after_each_message_so_that_both_pass() -> None:
    mux = Driven({"high": {"priority": 20, "timeout": 0}, "low": LOW}, profile="yocs")
    assert mux.send(0.0, "high", 2.0)
    assert mux.send(0.1, "low", 1.0)
    assert mux.send(0.2, "high", 2.0)
    mux.at(0.3)
    assert mux.core.active is None


def test_in_yocs_priority_0_passes_and_no_stop_follows() -> None:
    mux = Driven({"any": {"priority": 0, "timeout": 0.5}}, profile="yocs")
    assert mux.send(0.0, "any", 1.0)
    mux.at(9.0)
    assert (mux.speeds, mux.core.active) == ([1.0], None)


# topic_tools


def test_topic_tools_lets_the_selected_one_through_and_nobody_else_even_if_it_is_silent() -> None:
    mux = Driven({"one": {}, "two": {}}, profile="topic_tools", mode="select")
    assert mux.send(0.0, "one", 1.0)
    assert not mux.send(99.0, "two", 2.0)
    mux.core.select("two", 99.0)
    assert mux.send(99.1, "two", 2.0)
    mux.core.select(None, 99.2)
    assert not mux.send(99.3, "two", 2.0)
    mux.at(200.0)
    assert mux.speeds == [1.0, 2.0]


def test_topic_tools_selects_first_what_is_named_or_nothing() -> None:
    sources: dict[str, Input] = {"one": {}, "two": {}}
    assert Driven(sources, mode="select").core.arbiter.selected == "one"
    assert Driven(sources, mode="select", initial="two").core.arbiter.selected == "two"
    assert Driven(sources, mode="select", initial="__none").core.arbiter.selected is None


# All of them


@pytest.mark.parametrize("profile", ["twist_mux", "yocs", "topic_tools"])
def test_the_stop_of_the_robot_is_above_every_profile(profile: MuxProfile) -> None:
    mux = Driven({"one": {"priority": 1, "timeout": 0.5}}, profile=profile, mode=MODE_OF[profile])
    mux.send(0.0, "one", 1.0)
    mux.take(mux.core.stop(0.1))
    assert mux.speeds == [1.0, 0.0]
    assert not mux.send(0.2, "one", 1.0)
    mux.core.release(0.3)
    assert not mux.send(0.4, "one", 1.0)  # it must come to rest once
    assert mux.send(0.5, "one", 0.0)
    assert mux.send(0.6, "one", 1.0)
