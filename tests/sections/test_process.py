from __future__ import annotations

from pathlib import Path

from tests.parts.project import Project

ROBOT = """
components:
  base: {type: diff_drive_sim}
  battery: {type: battery_sim, process: power}
profiles:
  one: {process: PROCESS}
"""


def processes(project: Project, process: str, *profiles: str) -> dict[str, str]:
    """Return the processes of all components."""
    robot = project.check(ROBOT.replace("PROCESS", process), profiles=profiles).compilation.robot
    assert robot
    return {name: component.process for name, component in robot.components.items()}


def test_without_it_each_type_has_its_default(tmp_path: Path) -> None:
    found = processes(Project(tmp_path), "world")
    assert found == {"base": "world", "battery": "power", "transforms": "robot", "diagnostics": "robot"}


def test_all_components_run_there_but_those_that_name_their_own(tmp_path: Path) -> None:
    project = Project(tmp_path)
    found = processes(project, "world", "one")
    assert found == {"base": "world", "battery": "power", "transforms": "world", "diagnostics": "world"}
    assert [finding.help for finding in project.findings if finding.code == "RBX6001"] == ["remove 'process'"]


def test_what_is_simulated_belongs_into_the_world_also_if_the_robot_has_a_single_process(tmp_path: Path) -> None:
    project = Project(tmp_path)
    processes(project, "robot", "one")
    told = [finding for finding in project.findings if finding.code == "RBX6001"]
    assert {finding.help for finding in told} == {"write 'process: world'", "remove 'process'"}


def test_a_process_is_a_name(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT.replace("PROCESS", "1 2"), profiles=["one"])
    assert [finding.code for finding in project.findings if finding.severity.name == "ERROR"]
