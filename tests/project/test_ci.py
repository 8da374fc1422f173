"""The hooks and the workflow that the pages show do what they say."""

from __future__ import annotations

import argparse
import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import yaml

from rbxcompose.commands.verbs import load

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/ci.md").read_text(encoding="utf-8")
HOOKS: list[dict[str, Any]] = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
EXAMPLES: list[dict[str, Any]] = [yaml.safe_load(text) for text in re.findall(r"```yml\n(.*?)```", PAGE, re.DOTALL)]


def parse(command: str) -> argparse.Namespace:
    program, verb, *words = shlex.split(command.partition(">")[0])
    assert program == "rbxcompose"
    parser = argparse.ArgumentParser(verb, exit_on_error=False)
    load(verb).add_arguments(parser)
    return parser.parse_args(words)


@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_a_hook_runs_a_command_with_the_files_that_changed(hook: dict[str, Any]) -> None:
    assert hook.keys() >= {"id", "name", "entry", "language", "files"}
    assert hook["language"] == "python"
    assert parse(f"{hook['entry']} robots/a.yaml missions/b.yaml").paths == ["robots/a.yaml", "missions/b.yaml"]
    assert hook["require_serial"], "two runs would check the same robot"


@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_a_hook_looks_at_all_manifests_of_the_project_and_at_nothing_else(hook: dict[str, Any]) -> None:
    def is_passed(path: str) -> bool:
        return bool(re.search(hook["files"], path)) and not re.search(hook["exclude"], path)

    below = [
        path.relative_to(ROOT).as_posix() for name in ("robots", "missions") for path in (ROOT / name).rglob("*.yaml")
    ]
    assert below
    assert [path for path in below if not is_passed(path)] == [path for path in below if path.endswith(".test.yaml")]
    assert is_passed("sub/parts/arm.yml")
    assert not any(map(is_passed, ("docker-compose.yaml", "docs/robots.yaml", ".github/workflows/ci.yaml")))


def test_the_configuration_of_the_page_names_hooks_that_exist() -> None:
    [config] = [example for example in EXAMPLES if "repos" in example]
    shown = {hook["id"] for repo in config["repos"] for hook in repo["hooks"]}
    assert shown <= {hook["id"] for hook in HOOKS}


def test_the_workflow_of_the_page_checks_and_uploads_what_it_wrote() -> None:
    [workflow] = [example for example in EXAMPLES if "jobs" in example]
    assert workflow["permissions"]["security-events"] == "write"
    steps = workflow["jobs"]["check"]["steps"]
    [check] = [step["run"] for step in steps if "rbxcompose check" in step.get("run", "")]
    [upload] = [step for step in steps if "upload-sarif" in step.get("uses", "")]
    arguments = parse(check)
    assert (arguments.format, arguments.strict) == ("sarif", True)
    assert check.split(">")[1].strip() == upload["with"]["sarif_file"]
    assert upload["if"] == "always()"
    assert all(re.fullmatch(r"[\w./-]+@v\d+", step["uses"]) for step in steps if "uses" in step)
