"""How long a base moves on after a link is cut: a bound that the base itself keeps, found wherever commands cross."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Velocity2
from rbxcompose.compiler.systems.cut_link import CYCLES, stops_after_cut
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveCore, DiffDriveSimConfig
from tests.systems.test_shares import ROBOT, SHARES, spread

CYCLE = 0.02  # [s]
BASE = ROBOT.robot.components["base"].config


@given(SHARES)
def test_a_base_has_a_bound_exactly_if_its_commands_cross(hosts: dict[str, str]) -> None:
    _, robot = spread(hosts)
    way = {hosts[name] for name in ("base", "cmd_vel", "go_to")}
    assert [(stop.base, stop.host) for stop in stops_after_cut(robot)] == ([("base", hosts["base"])] * (len(way) > 1))


def test_a_slower_base_needs_two_of_its_own_cycles() -> None:
    (fast,) = stops_after_cut(ROBOT)
    slower = BASE.model_copy(update={"rate": 10.0})
    components = {**ROBOT.robot.components, "base": replace(ROBOT.robot.components["base"], config=slower)}
    (slow,) = stops_after_cut(replace(ROBOT, robot=replace(ROBOT.robot, components=components)))
    assert fast.time is not None
    assert slow.time == pytest.approx(fast.time + CYCLES * (1 / 10 - 1 / 50))


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, CYCLE))
def test_the_base_stands_still_within_it_whatever_the_last_command_was(
    linear: float, angular: float, phase: float
) -> None:
    (bound,) = stops_after_cut(ROBOT)
    assert isinstance(BASE, DiffDriveSimConfig)
    core, now = DiffDriveCore(BASE), 0.0
    while now < 2.0:
        now += CYCLE
        core.command(Velocity2(linear * BASE.max_speed, angular * BASE.max_turn_rate), now - phase)
        core.step(now, CYCLE)
    last = now - phase
    while not core.at_rest:
        now += CYCLE
        core.step(now, CYCLE)
    assert bound.time is not None
    assert now - last <= bound.time + 1e-9
    assert bound.time == pytest.approx(0.25 + CYCLES * CYCLE + 0.3)
