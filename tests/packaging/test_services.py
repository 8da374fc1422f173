"""The action for GitHub and the template for GitLab: their keys, and that their very lines do what they say."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

from tests.packaging.builds import ROOT
from tests.patrol_project import ROBOT, write_project
from tests.soak import rare

ACTION: dict[str, Any] = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
TEMPLATE: dict[str, Any] = yaml.safe_load((ROOT / "templates/robots.gitlab-ci.yml").read_text(encoding="utf-8"))
STEPS: list[dict[str, Any]] = ACTION["runs"]["steps"]
DEFAULTS = {name: one["default"] for name, one in ACTION["inputs"].items()}

pytestmark = pytest.mark.timeout(120)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a test of a mission, and programs that stand for those of a runner."""
    write_project(folder := tmp_path / "project")
    (programs := tmp_path / "programs").mkdir()
    (programs / "rbxcompose").write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m rbxcompose "$@"\n')
    (programs / "python").write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > {shlex.quote(str(tmp_path / "asked"))}\n')
    for program in programs.iterdir():
        program.chmod(0o755)
    return folder


def run(project: Path, lines: str, variables: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run lines as a runner does: bash that stops at the first failure."""
    path = os.pathsep.join((str(project.parent / "programs"), os.environ["PATH"]))
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables, "PATH": path}
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", lines]
    return subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True, check=False)


def step(name: str, **inputs: str) -> tuple[str, dict[str, str]]:
    """Return the lines of a step, and its variables with the inputs put in."""
    [found] = [one for one in STEPS if one.get("name") == name]
    values = {f"${{{{ inputs.{key} }}}}": value for key, value in {**DEFAULTS, **inputs}.items()}
    values["${{ github.action_path }}"] = "/action"
    return found["run"], {key: values[value] for key, value in found["env"].items()}


def job(name: str) -> dict[str, Any]:
    return {**TEMPLATE[".rbxcompose"], **TEMPLATE[name]}


def spoil(project: Path) -> None:
    robot = project / ROBOT
    robot.write_text(robot.read_text(encoding="utf-8") + "\nnonsense: 1\n", encoding="utf-8")


def test_the_action_has_the_keys_that_github_asks_for() -> None:
    assert ACTION.keys() == {"name", "description", "inputs", "outputs", "runs"}
    assert ACTION["runs"]["using"] == "composite"
    assert all({"description", "default"} == one.keys() for one in ACTION["inputs"].values())
    assert all({"description", "value"} == one.keys() for one in ACTION["outputs"].values())
    assert all(isinstance(value, str) for value in DEFAULTS.values())
    for one in STEPS:
        assert one.keys() <= {"name", "if", "shell", "env", "run", "uses", "with"}
        assert ("uses" in one) != (one.get("shell") == "bash" and "run" in one)
        assert "${{" not in one.get("run", ""), "a text of others would be run; give it as a variable"


def test_every_input_is_used() -> None:
    text = json.dumps(ACTION["runs"])
    assert [name for name in ACTION["inputs"] if f"inputs.{name}" not in text] == []


def test_the_page_has_every_input_with_its_default() -> None:
    page = (ROOT / "docs/ci.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]*)\|([^|]*)\|", page[page.index("| input |") :], re.MULTILINE)
    shown = {
        name: value
        for names, values in rows
        for name, value in zip(re.findall("`(.*?)`", names), [*re.findall("`(.*?)`", values), "", ""], strict=False)
    }
    assert shown == DEFAULTS
    examples = [yaml.safe_load(text) for text in re.findall(r"```yml\n(.*?)```", page, re.DOTALL)]
    [steps] = [one["steps"] for one in examples if "steps" in one]
    [ours] = [one for one in steps if "rbxcompose@" in one.get("uses", "")]
    assert ours["with"].keys() <= DEFAULTS.keys()
    [variables] = [one["variables"] for one in examples if "variables" in one]
    assert variables.keys() <= TEMPLATE["variables"].keys()


def test_the_action_installs_its_own_version_with_extras(project: Path) -> None:
    asked = project.parent / "asked"
    for extras, wanted in (("", "/action"), ("navigation,physics", "/action[navigation,physics]")):
        done = run(project, *step("Install rbxcompose", extras=extras, packages="rbx-lamp rbx-siren"))
        assert done.returncode == 0, done.stderr
        assert asked.read_text().split() == ["-m", "pip", "install", "--quiet", wanted, "rbx-lamp", "rbx-siren"]


@pytest.mark.parametrize("is_wrong", [True, *rare(False)])
def test_the_action_writes_sarif_and_fails_with_the_findings(project: Path, is_wrong: bool) -> None:
    if is_wrong:
        spoil(project)
    done = run(project, *step("Check robots"))
    assert done.returncode == int(is_wrong), done.stderr
    [found] = json.loads((project / DEFAULTS["sarif"]).read_text())["runs"]
    assert bool(found["results"]) == is_wrong
    assert ("::error" in done.stdout + done.stderr) == is_wrong


@pytest.mark.soak  # the template does so in the same way
def test_the_action_runs_the_tests_of_missions(project: Path) -> None:
    done = run(project, *step("Test missions"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert ElementTree.parse(project / DEFAULTS["junit"]).getroot().find(".//testcase") is not None


def test_the_action_runs_the_tests_of_missions_also_after_findings() -> None:
    [tests] = [one for one in STEPS if one.get("name") == "Test missions"]
    assert "!cancelled()" in tests["if"]


def test_the_template_has_jobs_with_reports() -> None:
    jobs = {name: one for name, one in TEMPLATE.items() if name != "variables" and not name.startswith(".")}
    assert jobs.keys() == {"check robots", "test missions"}
    for one in jobs.values():
        assert one.keys() <= {"extends", "script", "after_script", "artifacts"}
        assert one["extends"] == ".rbxcompose"
        assert one["artifacts"]["when"] == "always"
    assert job("test missions")["artifacts"]["reports"]["junit"] == "rbxcompose-tests.xml"


@pytest.mark.parametrize("name", ["test missions", *rare("check robots")])
def test_the_lines_of_a_job_run_and_leave_what_it_keeps(project: Path, name: str) -> None:
    one = job(name)
    for part in ("before_script", "script", "after_script"):
        done = run(project, "\n".join(one.get(part, [])), TEMPLATE["variables"])
        assert done.returncode == 0, done.stdout + done.stderr
    assert (project.parent / "asked").read_text().split() == ["-m", "pip", "install", "--quiet", "rbxcompose"]
    kept = [*one["artifacts"].get("paths", []), *one["artifacts"].get("reports", {}).values()]
    assert kept
    assert all((project / path).stat().st_size > 0 for path in kept)


@pytest.mark.soak  # the action fails in the same way
def test_a_job_fails_with_findings_and_keeps_them(project: Path) -> None:
    spoil(project)
    one = job("check robots")
    assert run(project, "\n".join(one["script"]), TEMPLATE["variables"]).returncode == 1
    run(project, "\n".join(one["after_script"]), TEMPLATE["variables"])
    assert json.loads((project / "rbxcompose.sarif").read_text())["runs"][0]["results"]
