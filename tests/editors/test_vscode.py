"""The extension for VS Code: what its package has, and what it does with the real server in a stand-in for VS Code."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import rbxcompose
from tests.conftest import ROOT
from tests.editors.quick_server import SAID

pytestmark = pytest.mark.timeout(150)
HERE = Path(__file__).parent
FOLDER = ROOT / "editors/vscode"
WRONG = "unknown key 'runtme' in component 'battery'\ndid you mean 'runtime'?"
Session = Callable[..., Any]


def _load_build() -> Any:
    spec = importlib.util.spec_from_file_location("vscode_build", FOLDER / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


vscode = _load_build()


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with what the package has."""
    try:
        vscode.build()
    except vscode.CannotBuildError as error:
        pytest.skip(str(error))
    unpacked = tmp_path_factory.mktemp("vsix")
    with zipfile.ZipFile(vscode.BUILT) as archive:
        archive.extractall(unpacked)
    return unpacked


@pytest.mark.parametrize("program", ["code", "code-server"])
def test_vs_code_installs_it(package: Path, program: str, tmp_path: Path) -> None:
    if (found := shutil.which(program)) is None:
        pytest.skip(f"needs {program}")
    words = [found, "--user-data-dir", str(tmp_path / "user"), "--extensions-dir", str(tmp_path / "extensions")]
    environment = {**os.environ, "HOME": str(tmp_path)}

    def said(*more: str) -> str:
        done = subprocess.run([*words, *more], capture_output=True, text=True, env=environment, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    said("--install-extension", str(vscode.BUILT))
    assert (
        f"rbxcompose.rbxcompose@{rbxcompose.__version__}" in said("--list-extensions", "--show-versions").splitlines()
    )


@pytest.fixture
def project(tmp_path: Path) -> Path:
    folder = tmp_path / "project"
    shutil.copytree(ROOT / "robots/turtlebot", folder / "robots/turtlebot")
    shutil.copytree(ROOT / "missions", folder / "missions")
    return folder


def written(path: Path, *lines: str) -> Path:
    """Return a program that is a script."""
    path.write_text("\n".join(("#!/bin/sh", *lines, "")), "utf-8")
    path.chmod(0o755)
    return path


@pytest.fixture
def program(tmp_path: Path) -> Path:
    return written(tmp_path / "rbxcompose", f'exec "{sys.executable}" -m rbxcompose "$@"')


@pytest.fixture
def quick(tmp_path: Path) -> Path:
    """The program, with a server that starts at once."""
    server = f'[ "$1" = lsp ] && exec "{sys.executable}" "{HERE / "quick_server.py"}"'
    return written(tmp_path / "quick", server, f'exec "{sys.executable}" -m rbxcompose "$@"')


@pytest.fixture
def session(package: Path, project: Path) -> Session:
    """Return a function that plays a scenario of `vscode_session.cjs` and returns what was seen."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("there is no node here")

    def play(scenario: str, *programs: Path | str) -> Any:
        words = [node, str(HERE / "vscode_session.cjs"), scenario, str(package / "extension/dist/extension.js")]
        done = subprocess.run(
            [*words, str(project), *programs], text=True, capture_output=True, timeout=60, check=False
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return play


def test_the_package_has_what_it_needs_and_nothing_of_this_computer(package: Path) -> None:
    there = {path.relative_to(package).as_posix() for path in package.rglob("*") if path.is_file()}
    assert there == {
        "[Content_Types].xml",
        "extension.vsixmanifest",
        "extension/LICENSE.txt",
        "extension/dist/extension.js",
        "extension/dist/licences.txt",
        "extension/package.json",
        "extension/readme.md",
    }
    assert (package / "extension/LICENSE.txt").read_text("utf-8") == (ROOT / "LICENSE").read_text("utf-8")
    for name in there:
        text = (package / name).read_text("utf-8")
        assert str(ROOT) not in text
        assert "sourceMappingURL" not in text


def test_the_licence_of_each_package_within_is_named(package: Path) -> None:
    licences = (package / "extension/dist/licences.txt").read_text("utf-8")
    assert "vscode-languageclient" in licences
    named = re.findall(r"^(\S+) [\d.]+ \((.+)\)$", licences, re.MULTILINE)
    assert {licence for _, licence in named} <= {"MIT", "ISC", "BlueOak-1.0.0"}


def test_manifest_and_lock_file_agree_with_the_project() -> None:
    manifest = json.loads((FOLDER / "package.json").read_text("utf-8"))
    lock = json.loads((FOLDER / "package-lock.json").read_text("utf-8"))
    declared = {entry["command"] for entry in manifest["contributes"]["commands"]}
    registered = re.findall(r'registerCommand\("([\w.]+)"', (FOLDER / "src/extension.ts").read_text("utf-8"))
    assert declared == set(registered)
    assert manifest["version"] == rbxcompose.__version__
    assert manifest["engines"]["vscode"] == f"^{manifest['devDependencies']['@types/vscode']}"
    assert manifest["capabilities"]["untrustedWorkspaces"]["supported"] is False
    assert not any("resolved" in package for package in lock["packages"].values())
    assert all(re.fullmatch(r"[\d.]+", version) for version in manifest["devDependencies"].values())
    readme = (FOLDER / "README.md").read_text("utf-8")
    assert all(f"**rbxcompose: {entry['title']}**" in readme for entry in manifest["contributes"]["commands"])
    assert all(f"`{name}`" in readme for name in manifest["contributes"]["configuration"]["properties"])


def test_findings_of_the_server_arrive(session: Session, program: Path) -> None:
    found = session("found", program)
    assert [(entry["code"], entry["message"], entry["severity"]) for entry in found] == [("RBX1001", WRONG, 0)]


def test_findings_arrive_also_after_a_restart(session: Session, quick: Path) -> None:
    seen = session("session", quick)
    for found in (seen["first"], seen["again"]):
        assert [entry["message"] for entry in found] == [SAID]
    assert seen["commands"] == ["rbxcompose.check", "rbxcompose.showMission", "rbxcompose.restart"]


def test_a_file_is_checked(session: Session, quick: Path, project: Path) -> None:
    command, said = session("check", quick)
    assert command == f"$ rbxcompose check {project / 'missions/patrol.yaml'}"
    assert said == "turtlebot is fine: 9 components in 3 processes\n"


def test_a_mission_is_drawn_beside_its_text_and_again_when_it_is_saved(session: Session, quick: Path) -> None:
    seen = session("picture", quick)
    assert seen["title"] == "patrol.yaml"
    assert seen["options"] == {"enableScripts": False, "enableForms": False, "localResourceRoots": []}
    assert "corner_1" in seen["after"]
    assert seen["before"] != seen["after"]
    for page in (seen["before"], seen["after"], seen["failed"]):
        (policy,) = re.findall(r'<head><meta http-equiv="Content-Security-Policy" content="(.*?)">', page)
        assert policy.startswith("default-src 'none'; style-src 'nonce-")
        assert "unsafe" not in policy
        assert "<script" not in page
    (nonce,) = re.findall(r'<style nonce="(.*?)">', seen["before"])
    assert f"'nonce-{nonce}'" in seen["before"]
    assert nonce not in seen["after"]
    assert "error[RBX" in seen["failed"]
    assert "<b>" not in seen["failed"]
    assert [entry["text"] for entry in seen["messages"]] == ["Open a mission first: a file with 'kind: Mission'."]


def test_where_the_program_is_not_found_a_message_leads_to_the_settings(
    session: Session, quick: Path, tmp_path: Path
) -> None:
    seen = session("missing", tmp_path / "none", quick)
    assert seen["text"].startswith(f"'{tmp_path / 'none'}' cannot be started. Install it with: pip install")
    assert seen["buttons"] == ["Open Settings", "Try Again"]
    assert seen["executed"] == [["workbench.action.openSettings", "rbxcompose.path"]]
    assert seen["then"][0]["message"] == SAID, "the server starts with the path that was set"


@pytest.mark.soak  # the other button of the same message
def test_a_program_that_was_installed_meanwhile_is_found_by_the_button(
    session: Session, quick: Path, tmp_path: Path
) -> None:
    assert session("again", tmp_path / "none", quick)[0]["message"] == SAID


def test_a_server_that_cannot_start_says_why_once(session: Session, tmp_path: Path) -> None:
    bare = written(
        tmp_path / "bare", '[ "$1" = --version ] && exit 0', "echo 'error[RBX9010]: not installed' >&2; exit 1"
    )
    (message,) = session("without_extra", bare)["messages"]
    assert message["text"] == "The language server did not start. error[RBX9010]: not installed"
    assert message["buttons"] == ["Show Output"]


def test_yaml_of_others_starts_nothing(session: Session, tmp_path: Path) -> None:
    started = tmp_path / "started"
    noisy = written(tmp_path / "noisy", f"touch {started}")
    assert session("foreign", noisy) == {"messages": [], "output": []}
    assert not started.exists()


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("robots/new.yaml", ""),
        pytest.param(
            *("elsewhere.yaml", "# yaml-language-server: $schema=../schemas/mission.schema.json\n"),
            marks=pytest.mark.soak,
        ),
        pytest.param("elsewhere.yaml", "# A robot.\nrbx: 1\n", marks=pytest.mark.soak),
    ],
    ids=["folder", "schema", "header"],
)
def test_the_server_is_started_by(path: str, text: str, session: Session, tmp_path: Path) -> None:
    said = session("begins", tmp_path / "none", json.dumps([path, text]))
    assert said.startswith(f"'{tmp_path / 'none'}' cannot be started.")


def test_the_program_of_the_workspace_comes_first(session: Session, quick: Path, project: Path) -> None:
    own = project / ".venv/bin/rbxcompose"
    own.parent.mkdir(parents=True)
    quick.rename(own)
    assert session("found", "")[0]["message"] == SAID


@pytest.mark.soak  # the page of a mission that fails is shown above
def test_a_mission_of_no_robot_has_a_page_that_says_so(session: Session, quick: Path) -> None:
    assert "error[RBX9040]" in session("no_robot", quick)
