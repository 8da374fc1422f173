"""`plan` and `plan --diff`: what would run, what is other, which processes that concerns."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from rbxcompose.compiler.plan.diff import Difference, difference
from rbxcompose.compiler.plan.dump import PlanTextError, dump, load
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.testing import Golden, check_file, check_text
from rbxcompose.tools.inspection.plan_text import plan_text
from tests.conftest import ROOT


@cache
def plan(*sets: str, name: str = "turtlebot", profiles: tuple[str, ...] = ()) -> Plan:
    return check_file(ROOT / "robots" / name / "robot.yaml", profiles=profiles, sets=sets).plan


def between(*sets: str, profiles: tuple[str, ...] = ()) -> Difference:
    return difference(plan(), plan(*sets, profiles=profiles))


@pytest.mark.parametrize("name", ["turtlebot", "twins"])
def test_a_plan_tells_processes_order_topics_and_keys(name: str, golden: Golden) -> None:
    golden.check(f"plan_{name}.txt", plan_text(plan(name=name), with_keys=True) + "\n")


def test_a_plan_that_was_saved_reads_the_same() -> None:
    assert plan_text(load(dump(plan()))) == plan_text(plan())


@pytest.mark.parametrize("name", ["turtlebot", "twins"])
def test_a_plan_is_no_other_than_itself_also_when_it_was_saved(name: str) -> None:
    found = difference(load(dump(plan(name=name))), plan(name=name))
    assert found.is_empty
    assert found.text() == "no difference"
    assert found.restarts == ()


def test_a_profile_that_changes_one_value_concerns_one_process() -> None:
    found = between(profiles=("tired",))
    assert found.text() == "~ battery\n    runtime: 45 s -> 30 s\nprocesses that restart: world"


def test_values_are_told_as_they_are_written() -> None:
    patterns = "[battery, {contains: foreign}, {not: {startswith: b}}]"
    text = between("base.max_speed=1.5 km/h", f"diagnostics.analyzers.power.match={patterns}").text()
    assert "    max_speed: 0.5 m/s -> 1.5 km/h\n" in text
    assert f" -> {patterns}\n" in text


def test_a_file_that_is_no_json_is_told_so_with_its_place() -> None:
    with pytest.raises(PlanTextError, match="this is not JSON: Expecting ':' delimiter: line 1 column 5"):
        load('{"a"')


def test_locks_that_come_or_go_are_told_by_what_is_in_them(tmp_path: Path) -> None:
    robot = "rbx: 1\nkind: Robot\nname: one\ncomponents: {base: {type: diff_drive_sim}}\nmuxes:\n  cmd_vel:\n"
    without = robot + "    inputs: {teleop: {priority: 1, timeout: 1 s}}\n"
    locked = without + "    locks: {door: {priority: 2, timeout: 1 s}}\n"
    plans = [check_text(text, tmp_path).plan for text in (locked, without)]
    gone = [line.strip() for line in difference(*plans).text().splitlines() if "locks" in line]
    words = ["locks.door.priority: 2", "locks.door.timeout: 1 s", "locks.door.topic: nothing"]
    assert sorted(gone) == [f"{word} (gone)" for word in words]
    new = [line.strip() for line in difference(*reversed(plans)).text().splitlines() if "locks" in line]
    assert sorted(new) == [f"{word} (new)" for word in words]


def test_a_component_that_moves_concerns_both_processes() -> None:
    found = between("go_to.process=legs")
    assert found.text().splitlines() == [
        "~ go_to",
        "    process: robot -> legs",
        "processes that start: legs",
        "processes that restart: robot",
    ]


def test_another_domain_concerns_all_processes() -> None:
    found = between("bus.domain=4")
    assert (found.text().splitlines()[0], found.restarts) == ("bus.domain: 0 -> 4", ("world", "robot", "mission"))


def test_the_inputs_of_a_mission_concern_its_process() -> None:
    found = between("missions.patrol.with.rounds=3", "missions.patrol.with.low=41 %")
    assert found.restarts == ("mission",)
    assert "    inputs.patrol.rounds: 2 -> 3" in found.text()


def test_a_change_too_small_for_the_text_is_told_all_the_same() -> None:
    assert between("battery.runtime=45.0000000001 s").changed["battery"][0].after == "45.0000000001 s"


def test_what_one_way_adds_the_other_way_removes() -> None:
    there, back = difference(plan(), plan(name="twins")), difference(plan(name="twins"), plan())
    assert [one.name for one in there.added] == [one.name for one in back.removed]
    assert [one.name for one in there.removed] == [one.name for one in back.added]
    assert {
        name: {(change.key, change.before, change.after) for change in changes}
        for name, changes in there.changed.items()
    } == {
        name: {(change.key, change.after, change.before) for change in changes}
        for name, changes in back.changed.items()
    }
    assert there.data()["removed"] == ["battery", "base", "go_to", "charger", "robot_description"]


def test_a_mission_whose_lines_have_moved_is_the_same_and_one_with_another_step_is_not(tmp_path: Path) -> None:
    robot = "rbx: 1\nkind: Robot\nname: one\nmissions:\n  tour: tour.yaml\nstart: tour\n"
    tour = "rbx: 1\nkind: Mission\nname: tour\ndo:\n  - log: hello\n  - wait: {} s\n"
    plans = [
        check_text(robot, tmp_path / str(number), others={"tour.yaml": text}).plan
        for number, text in enumerate((tour.format(1), f"# moved\n\n{tour.format(1)}", tour.format(2)))
    ]
    assert difference(plans[0], plans[1]).is_empty
    changed = difference(plans[0], plans[2])
    assert [str(one) for one in changed.changed["mission"]] == ["programs.tour.do.1.wait: 1 s -> 2 s"]


def test_a_setting_without_a_limit_can_be_compared(tmp_path: Path) -> None:
    text = "rbx: 1\nkind: Robot\nname: still\ncomponents: {battery: {type: battery_sim, runtime: 1 h}}\nconsole: {}\n"
    still = check_text(text, tmp_path).plan  # without a base, its console limits no speed
    assert difference(load(dump(still)), still).is_empty
