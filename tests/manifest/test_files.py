"""Paths are relative to their file, stay inside the project, and missing ones name their neighbours."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rbxcompose.base.findings import Finding, Span, one_compile
from rbxcompose.manifest.files import find, project_of, resolve, shown_name

HERE = Span("robot.yaml", 1, 1, 1, 2)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    for name in ("home/robots/one/robot.yaml", "home/missions/patrol.yaml", "secret.yaml"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("rbx: 1\n")
    return tmp_path / "home"


def resolved(written: str, project: Path) -> Path | Finding:
    return resolve(written, project / "robots/one/robot.yaml", HERE)


def refused(written: str, project: Path) -> Finding:
    found = resolved(written, project)
    assert isinstance(found, Finding)
    return found


def test_a_project_is_the_nearest_folder_with_robots_or_missions(project: Path) -> None:
    assert project_of(project / "robots/one/robot.yaml") == project
    assert project_of(project.parent / "secret.yaml") == project.parent


def test_a_path_is_relative_to_the_file_that_writes_it(project: Path) -> None:
    assert resolved("../../missions/patrol.yaml", project) == project / "missions/patrol.yaml"


def test_a_folder_means_its_robot_where_one_may_be_meant(project: Path) -> None:
    robot = project / "robots/one/robot.yaml"
    for folder in ("../one", "."):
        assert resolve(folder, robot, HERE, may_be_robot=True) == robot
        assert refused(folder, project).message == f"the folder '{folder}' is no file"


def test_the_library_is_named_rbx() -> None:
    found = find("rbx:robots/turtlebot")
    assert found == find("rbx:robots/turtlebot/robot.yaml")
    assert isinstance(found, Path)
    assert found.name == "robot.yaml"


@pytest.mark.parametrize(
    "written", ["../../../secret.yaml", "/etc/passwd", "rbx:../../../etc/passwd", "../../link.yaml"]
)
def test_a_path_that_leads_out_of_the_project_is_a_finding(project: Path, written: str) -> None:
    (project / "link.yaml").symlink_to(project.parent / "secret.yaml")
    assert refused(written, project).code == "RBX1306"


def test_a_link_that_leads_out_of_the_project_says_where(project: Path) -> None:
    (project / "missions/link.yaml").symlink_to(secret := project.parent / "secret.yaml")
    finding = refused("../../missions/link.yaml", project)
    assert finding.message == "'../../missions/link.yaml' leads through a link out of the project"
    assert finding.help == f"it leads to '{secret}': put a copy of that file in its place"


def test_a_missing_file_names_the_nearest_neighbour(project: Path) -> None:
    finding = refused("../../missions/patrl.yaml", project)
    assert (finding.code, finding.span, finding.help) == ("RBX1301", HERE, "did you mean 'patrol.yaml'?")


@pytest.mark.parametrize("written", ["missions/patrol.yaml", "patrol.yaml", "../missions/patrol.yaml"])
def test_a_path_that_is_relative_to_the_wrong_folder_names_the_right_path(project: Path, written: str) -> None:
    (project / "robots/one/spare.yaml").write_text("rbx: 1\n")
    assert refused(written, project).help == "did you mean '../../missions/patrol.yaml'?"


def test_a_missing_folder_names_the_folder_where_the_path_ends(project: Path) -> None:
    assert "the path ends at the folder" in refused("../../mission/x/tour.yaml", project).help


@pytest.mark.parametrize("written", ["a" * 5000, "loop/robot.yaml", "x\x00y", ""])
def test_an_impossible_path_is_a_finding(project: Path, written: str) -> None:
    loop = project / "robots/one/loop"
    loop.symlink_to(loop)
    (project / "robots/one/robot.yaml").unlink()
    assert isinstance(resolved(written, project), Finding)


def test_files_below_the_current_folder_are_shown_relative_to_it(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(project)
    assert shown_name(project / "missions/patrol.yaml") == "missions/patrol.yaml"
    assert shown_name(project.parent / "secret.yaml") == str(project.parent / "secret.yaml")


@pytest.mark.parametrize("kind", ["pipe", "link"])
def test_what_is_there_and_no_file_is_told_as_that(project: Path, kind: str) -> None:
    path = project / "missions/odd.yaml"
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("nowhere.yaml")
    expected = "is not a regular file" if kind == "pipe" else "does not exist"
    assert expected in refused("../../missions/odd.yaml", project).message


@pytest.mark.parametrize(
    ("written", "message", "help_text"),
    [
        (".", "there is no robot in this folder: it has no robot.yaml", "did you mean 'robots/one'?"),
        ("robots", "there is no robot in the folder 'robots': it has no robot.yaml", "did you mean 'robots/one'?"),
        (
            "missions",
            "there is no robot in the folder 'missions': it has no robot.yaml",
            "'rbxcompose new robot NAME' makes one in 'robots/NAME'",
        ),
    ],
)
def test_a_folder_that_is_there_is_not_told_to_be_missing(
    project: Path, monkeypatch: pytest.MonkeyPatch, written: str, message: str, help_text: str
) -> None:
    monkeypatch.chdir(project)
    finding = find(written)
    assert isinstance(finding, Finding)
    assert (finding.code, finding.message, finding.help) == ("RBX1301", message, help_text)


def test_a_manifest_that_names_a_folder_hears_which_files_are_in_it(project: Path) -> None:
    finding = refused("../../missions", project)
    assert finding.message == "the folder '../../missions' is no file"
    assert finding.help == "name a file in it: '../../missions/patrol.yaml'"


def test_a_command_may_name_a_link_inside_its_project_but_not_one_that_leads_out(project: Path) -> None:
    robot, inside, outside = (project / f"robots/{name}" for name in ("one/robot.yaml", "two.yaml", "three.yaml"))
    inside.symlink_to(robot)
    outside.symlink_to(project.parent / "secret.yaml")
    assert find(str(inside)) == robot
    refused = find(str(outside))
    assert isinstance(refused, Finding)
    assert refused.code == "RBX1306"


def test_the_robot_file_of_a_folder_may_not_be_a_link_that_leads_out(project: Path) -> None:
    robot = project / "robots/one/robot.yaml"
    robot.unlink()
    robot.symlink_to(project.parent / "secret.yaml")
    refused = find(str(robot.parent))
    assert isinstance(refused, Finding)
    assert refused.code == "RBX1306"


def test_a_command_may_name_a_file_without_a_project_and_go_through_links_to_folders(project: Path) -> None:
    assert find(str(project.parent / "secret.yaml")) == project.parent / "secret.yaml"
    (project.parent / "elsewhere").symlink_to(project / "robots")
    assert find(str(project.parent / "elsewhere/one")) == project / "robots/one/robot.yaml"


def test_within_one_compile_a_folder_is_listed_once(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    listed: list[object] = []
    scan = os.scandir

    def counted(folder: Path) -> object:
        listed.append(folder)
        return scan(folder)

    monkeypatch.setattr(os, "scandir", counted)

    def listings(count: int) -> int:
        listed.clear()
        with one_compile():
            for number in range(count):
                refused(f"../../missions/none_{number}.yaml", project)
        return len(listed)

    assert listings(20) == listings(1) > 0


def test_what_one_compile_found_the_next_looks_up_again(project: Path) -> None:
    with one_compile():
        refused("../../missions/tour.yaml", project)
    (project / "missions/tours.yaml").write_text("rbx: 1\n")
    with one_compile():
        assert "tours.yaml" in refused("../../missions/tour.yaml", project).help
