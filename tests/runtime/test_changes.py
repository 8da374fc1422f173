"""What another plan changes in a running robot: decided from two plans, before anything is touched."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbxcompose.base.config import Restart, with_values
from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.compiler.plan.model import BusPlan, Plan
from rbxcompose.runtime.supervision.plan_change import Changes, Fate, changes
from rbxcompose.testing.bench import instance
from tests.conftest import ROOT
from tests.manifests import turtlebot
from tests.missions.simulated import program_of

MOVES = ["'base' moves"]
RUNS = {"mission": "mission patrol runs"}


def between(*sets: str, failed: tuple[str, ...] = ()) -> Changes:
    return changes(turtlebot(), turtlebot(*sets), failed)


def fates(found: Changes) -> dict[str, Fate]:
    return {one.instance.name: one.fate for one in found.fated if one.fate is not Fate.KEPT}


def test_the_same_robot_keeps_everything() -> None:
    found = between()
    assert (found.is_empty, fates(found)) == (True, {})
    assert changes(turtlebot(), load(dump(turtlebot()))).is_empty


def test_a_live_setting_is_changed_live_and_any_other_restarts() -> None:
    assert fates(between("go_to.speed=0.4 m/s")) == {"go_to": Fate.LIVE}
    assert fates(between("charger.reach=0.1 m")) == {"charger": Fate.RESTARTED}
    assert fates(between("go_to.speed=0.4 m/s", "go_to.process=legs")) == {"go_to": Fate.RESTARTED}


def test_start_order_and_restart_policy_are_taken_over_without_a_restart() -> None:
    assert fates(between("charger.starts_after=[go_to]", "go_to.restart=never"))["go_to"] is Fate.LIVE
    before = turtlebot()
    one = replace(before.instances[0], restart=Restart(when="never"))
    after = replace(before, instances=(one, *before.instances[1:]))
    assert fates(changes(before, after)) == {one.name: Fate.LIVE}


def test_what_is_new_is_added_and_what_has_gone_is_removed() -> None:
    before = turtlebot()
    lamp = instance("lamp", "transforms")
    after = replace(before, instances=(*before.instances, lamp))
    assert fates(changes(before, after)) == {"lamp": Fate.ADDED}
    found = changes(after, before)
    assert fates(found) == {"lamp": Fate.REMOVED}
    assert found.stopping == {"lamp"}


def test_what_has_failed_is_tried_again() -> None:
    found = between(failed=("charger",))
    assert fates(found) == {"charger": Fate.RESTARTED}
    assert [str(reason) for reason in found.fated[3].reasons] == ["state: failed -> active"]


def test_simulated_truth_never_restarts() -> None:
    [text] = between("base.process=robot").impossible
    words = "'base' holds simulated truth, which would be reset (process: world -> robot): it needs 'down' and 'up'"
    assert text == words
    assert between("battery.runtime=30 s", "base.max_speed=0.4 m/s").impossible == ()


@pytest.mark.parametrize("after", [{"bus": BusPlan(domain=3)}, {"is_simulated": False}, {"robot": "another"}])
def test_what_concerns_the_whole_robot_needs_down_and_up(after: dict[str, object]) -> None:
    found = changes(turtlebot(), replace(turtlebot(), **after))  # type: ignore[arg-type]
    assert "concerns the whole robot" in found.impossible[0]
    assert not found.is_empty


def test_the_path_of_commands_is_not_touched_while_something_moves() -> None:
    mux = between("muxes.cmd_vel.inputs.teleop.priority=50")
    assert mux.commanding == ["cmd_vel"]
    assert mux.unsafe([], {}) == ""
    assert mux.unsafe(MOVES, {}).startswith(
        "'base' moves, and 'cmd_vel' is on the path of its commands: 'rbxcompose stop'"
    )
    assert between("go_to.process=legs").unsafe(MOVES, {}) != ""


def test_what_is_not_on_the_path_of_commands_may_change_while_something_moves() -> None:
    assert between("charger.reach=0.1 m").unsafe(MOVES, RUNS) == ""
    assert between("go_to.speed=0.4 m/s", "base.max_speed=0.4 m/s").unsafe(MOVES, RUNS) == ""


def test_who_leaves_the_path_of_commands_is_on_it_too() -> None:
    before = turtlebot()
    after = replace(before, instances=tuple(one for one in before.instances if one.name != "go_to"))
    assert changes(before, after).unsafe(MOVES, {}) != ""


def test_a_mission_that_runs_is_changed_live_unless_it_needs_other_ports() -> None:
    found = between("missions.patrol.with.rounds=3")
    assert fates(found) == {"mission": Fate.LIVE}
    assert found.unsafe(MOVES, RUNS) == ""
    before, quiet = turtlebot(), program_of("do: {wait: 1 s}")
    mission = next(instance for instance in before.instances if instance.name == "mission")
    other = replace(mission, config=with_values(mission.config, {"programs": {"patrol": quiet}}))
    instances = tuple(other if instance is mission else instance for instance in before.instances)
    found = changes(before, replace(before, instances=instances))
    assert fates(found) == {"mission": Fate.RESTARTED}
    assert found.unsafe([], RUNS).startswith(
        "mission patrol runs, and 'mission' would restart: run 'rbxcompose mission"
    )
    assert found.unsafe([], {}) == ""


def test_lines_that_move_change_nothing() -> None:
    text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")
    assert changes(turtlebot(), turtlebot(text=f"# one line more\n{text}")).is_empty


def test_a_plan_of_nothing_can_become_another() -> None:
    nothing = Plan("turtlebot", "robot.yaml", ())
    assert {one.fate for one in changes(nothing, turtlebot()).fated} == {Fate.ADDED}
