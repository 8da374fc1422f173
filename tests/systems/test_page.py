"""The page on systems has every key, and its example is a system without errors."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from rbxcompose.findings import Severity
from rbxcompose.manifest.system_file import HostModel, LinkModel, SystemFile, SystemRobotModel
from rbxcompose.systems.reader import compile_system
from tests.conftest import ROOT

PAGE = (ROOT / "docs/systems.md").read_text(encoding="utf-8")


def test_its_example_can_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("robots/turtlebot", "missions"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    (tmp_path / "systems").mkdir()
    example = re.search(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert example is not None
    (tmp_path / "systems/two_hosts.yaml").write_text(example[1], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    system = compile_system("systems/two_hosts.yaml", environment={})
    assert [one for one in system.report if one.severity is Severity.ERROR] == []
    hosts = system.robots["turtlebot"].hosts
    assert (hosts["base"], hosts["mission"], hosts["go_to"], hosts["charger"]) == ("robot", "desk", "desk", "tablet")


@pytest.mark.parametrize("model", [SystemFile, HostModel, SystemRobotModel, LinkModel])
def test_it_has_every_key(model: type[HostModel]) -> None:
    assert model.model_fields.keys() - set(re.findall(r"\w+", PAGE)) - {"about"} == set()
