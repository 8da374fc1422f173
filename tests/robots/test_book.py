"""The missions after the book run on their simulated robots as they are, with all that the robots do."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.testing.bench import Ran, run_robot
from tests.soak import rare

FOLDER = Path(__file__).parents[2] / "robots"
ROBOTS = ("rooms", "patroller")
ENDLESS = {"patrol_greeting", "random_patrol", "random_patrol_battery", "battery_monitor"}
LONG = 20.0  # [s] for which those that never end are watched


@cache
def compiled(robot: str, *profiles: str) -> Compilation:
    return compile_robot(str(FOLDER / robot / "robot.yaml"), profiles=profiles, environment={})


def missions_of(robot: str) -> list[str]:
    whole = compiled(robot).robot
    return [mission for mission in (whole.missions if whole else {}) if mission != "patrol"]


def starting(plan: Plan, mission: str) -> Plan:
    """Return a plan that runs another mission, without compiling the robot again, which takes longer than to run it."""
    others = tuple(instance for instance in plan.instances if instance.name != "mission")
    [executive] = (instance for instance in plan.instances if instance.name == "mission")
    config = executive.config.model_copy(update={"start": mission})
    return replace(plan, instances=(*others, replace(executive, config=config)))


def ran(robot: str, mission: str, *profiles: str, most: float = 3600.0) -> Ran:
    out = compiled(robot, *profiles)
    assert out.plan, render_text(out.report, out.sources)
    return run_robot(starting(out.plan, mission), most=most)


def told(run: Ran) -> list[str]:
    """Return what the mission did, in order, without how long it took."""
    return [record.text.partition(" (")[0] for record in run.bench.records if record.source == "mission"]


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_has_no_findings(robot: str) -> None:
    assert list(compiled(robot).report) == []
    assert list(compiled(robot, "tired").report) == []


@pytest.mark.parametrize("robot", rare("rooms", "patroller"))  # three missions of the first are run below
def test_each_mission_does_what_it_should(robot: str, subtests: pytest.Subtests) -> None:
    for mission in missions_of(robot):
        with subtests.test(mission):
            run = ran(robot, mission, most=LONG if mission in ENDLESS else 3600.0)
            assert run.outcome == ("running" if mission in ENDLESS else "success")
            assert not [text for text in told(run) if text.endswith(": failure")]
            if mission not in ENDLESS:
                run.bench.advance(0.5)
                assert run.bench.host.is_at_rest


def test_a_house_with_a_short_battery_is_cleaned_all_the_same() -> None:
    did = told(ran("rooms", "clean_house", "tired"))
    assert did.count("recharge: success") >= 1
    done = {text for text in did if text.endswith(": success") and text.split()[0] in ("vacuum", "mop", "scrub")}
    assert done == {f"{chore}: success" for chore in ("vacuum 5 s", "mop 7 s", "scrub 9 s", "mop 5 s")}


@pytest.mark.soak  # as a house with a short battery
def test_a_chore_is_never_done_at_the_dock() -> None:
    did = told(ran("rooms", "clean_house_steps", "tired"))
    docked = [at for at, text in enumerate(did) if text == "recharge: success"]
    assert docked
    for at in docked:
        assert " Go to " in did[at + 1]


@pytest.mark.soak  # a test of its mission says so, too
def test_the_cleaning_machine_runs_the_house_in_its_fixed_order() -> None:
    did = told(ran("rooms", "clean_house_machine"))
    rooms = [text.partition(" Go to ")[2] for text in did if " Go to " in text]
    assert rooms == ["living room", "kitchen", "bathroom", "hallway"]
    assert "All chores complete!" in did
