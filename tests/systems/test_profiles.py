"""Profiles of a system change its hosts and what its robots are; a name that it has not is a finding."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands.formats.text import render_text
from rbxcompose.compiler.systems.reader import compile_system
from tests.conftest import ROOT

PROFILES = """
profiles:
  hall:
    hosts: {desk: {address: 10.9.0.1, labels: [fast]}}
    robots: {turtlebot: {profile: tired, stop_within: 1.5 s, place: {battery: desk}}}
  broken:
    robots: {turtlebot: {on: nowhere}}
  bare:
    hosts: {desk: {labels: [fast]}}
    robots: {turtlebot: !remove }
"""


@pytest.fixture
def system(tmp_path: Path) -> str:
    text = (ROOT / "systems/patrol_two_hosts.yaml").read_text(encoding="utf-8")
    path = tmp_path / "system.yaml"
    path.write_text(text.replace("../robots", f"{ROOT}/robots") + PROFILES, encoding="utf-8")
    return str(path)


def test_a_chosen_profile_changes_the_system_and_its_robots_and_others_do_not(system: str) -> None:
    plain = compile_system(system, environment={})
    assert not plain.report.has_errors, render_text(plain.report, plain.sources, False)
    hall = compile_system(system, environment={}, profiles=["hall"])
    assert not hall.report.has_errors, render_text(hall.report, hall.sources, False)
    assert (plain.hosts["desk"].address, hall.hosts["desk"].address) == ("10.42.0.1", "10.9.0.1")
    assert hall.hosts["robot"] == plain.hosts["robot"]
    assert (plain.robots["turtlebot"].hosts["battery"], hall.robots["turtlebot"].hosts["battery"]) == ("robot", "desk")
    assert hall.robots["turtlebot"].model.profile == "tired"
    assert hall.robots["turtlebot"].plan != plain.robots["turtlebot"].plan
    assert hall.robots["turtlebot"].version != plain.robots["turtlebot"].version, "hosts with another profile are told"


def test_what_a_profile_breaks_is_reported_and_an_unknown_one_with_those_that_exist(system: str) -> None:
    broken = compile_system(system, environment={}, profiles=["broken"])
    assert "RBX6100" in {finding.code for finding in broken.report}
    unknown = compile_system(system, environment={}, profiles=["hal"])
    text = render_text(unknown.report, unknown.sources, False)
    assert "did you mean 'hall'" in text
    assert "1 | hal\n" in text, "the excerpt is what was typed, not the profile of a robot"


def test_a_profile_that_removes_all_robots_is_named_at_its_place(system: str) -> None:
    bare = compile_system(system, environment={}, profiles=["bare"])
    (found,) = (finding for finding in bare.report if finding.code == "RBX1002")
    assert found.message.startswith("profile 'bare' leaves no 'robots'")
    assert found.span is not None
    line = Path(system).read_text(encoding="utf-8").splitlines()[found.span.line - 1]
    assert line == "    robots: {turtlebot: !remove }"
