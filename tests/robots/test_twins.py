"""The tug with two batteries of one make: one part twice, told apart by `connect:`."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.compile import Compilation, compile_robot
from rbxcompose.testing.bench import Ran, run_robot


@pytest.fixture(autouse=True)
def _at_home(repository: Path) -> None:
    """Findings name files as from the repository's root."""


def compiled(*sets: str, profiles: tuple[str, ...] = ()) -> Compilation:
    return compile_robot("robots/twins", sets=sets, profiles=profiles, environment={})


def ran(*sets: str, profiles: tuple[str, ...] = ()) -> Ran:
    out = compiled(*sets, profiles=profiles)
    assert out.plan, render_text(out.report, out.sources)
    return run_robot(out.plan)


def charged(run: Ran) -> dict[str, int]:
    said = [record.text for record in run.bench.records if record.source == "mission"]
    return {name: sum(text.endswith(f" Recharge {name}") for text in said) for name in ("drive", "lift")}


@pytest.mark.parametrize("profiles", [(), ("tired",)])
def test_it_has_no_findings(profiles: tuple[str, ...]) -> None:
    assert list(compiled(profiles=profiles).report) == []


def test_it_hauls_to_the_end_and_charges_each_battery_when_that_is_low() -> None:
    run = ran()
    assert run.outcome == "success"
    assert charged(run) == {"drive": 2, "lift": 1}


@pytest.mark.soak  # above, each is charged when its own battery is low
def test_what_is_given_to_one_instance_does_not_change_the_other() -> None:
    assert charged(ran("include.lift.with.runtime=1 h")) == {"drive": 1, "lift": 0}


@pytest.mark.soak  # `test_turtlebot` has a profile, too
def test_a_profile_changes_both_batteries() -> None:
    assert charged(ran(profiles=("tired",)))["drive"] > 1


def test_the_robot_has_the_last_word_on_what_a_part_brought() -> None:
    robot = compiled().robot
    assert robot
    warnings = {name: robot.components[f"{name}_battery"].config.model_dump()["warn"] for name in ("drive", "lift")}
    assert warnings == {"drive": 0.5, "lift": 0.45}


@pytest.mark.parametrize("name", ["base", "battery", "navigation", "teleop"])
def test_every_part_of_the_library_says_what_it_is(name: str, repository: Path) -> None:
    text = (repository / "parts" / f"{name}.yaml").read_text(encoding="utf-8")
    assert f"kind: Part\nname: {name}\nabout: " in text
