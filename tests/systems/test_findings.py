"""Mistakes in systems are findings at their places."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rbxcompose.rendering.text import render_text
from rbxcompose.systems.reader import compile_system
from rbxcompose.testing.golden import Golden
from tests.conftest import ROOT

FINE = (ROOT / "systems/patrol_two_hosts.yaml").read_text(encoding="utf-8")
ROBOT = "robots/turtlebot/robot.yaml"

WRONG = {
    "RBX6100": {"on: desk": "on: dest", "battery: robot": "battery: rob"},
    "RBX6101": {"base: robot": "bas: robot"},
    "RBX6102": {"file:type: go_to": "type: go_too"},
    "RBX6104": {"{address: 10.42.0.2}": "{}", "{address: 10.42.0.1}": "{labels: [fast]}"},
    "RBX6105": {"file:command_timeout: 0.5 s": "command_timeout: 0.15 s"},
    "RBX6107": {"on: desk": "on: desk\n    link_port: 7000", "robots:": "robots:\n  second:\n    robot: "
                "../robots/turtlebot/robot.yaml\n    on: desk\n    link_port: 7000\n    place: {base: robot}"},
    "RBX6118": {"robots:": "links:\n  wifi: {between: [robot, desk], downsample: {batery_level: 1 Hz}}\nrobots:"},
    "RBX6119": {"robots:": "links:\n  wifi: {between: [robot, desk], downsample: {cmd_vel: 1 Hz}}\nrobots:"},
    "RBX6120": {"robots:": "links:\n  wifi: {between: [robot, desk], limit: 500 bit/s}\n"
                "  eth: {between: [robot, dsk]}\nrobots:"},
    "RBX6108": {"file:places:": "bus: {router: tcp/10.0.0.1:7447}\n\nplaces:"},
    "RBX1001": {"hosts:": "hots:"},
    "RBX1002": {"robots:": "other:"},
    "RBX1003": {"address: 10.42.0.2": "address: [1, 2]"},
}  # fmt: skip


@pytest.mark.parametrize("code", WRONG)
def test_a_mistake_is_a_finding_at_its_place(
    code: str, golden: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("robots/turtlebot", "missions"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    monkeypatch.chdir(tmp_path)
    texts = {True: (tmp_path / ROBOT).read_text(encoding="utf-8"), False: FINE}
    for before, after in WRONG[code].items():
        is_robot, old = before.startswith("file:"), before.removeprefix("file:")
        assert old in texts[is_robot]
        texts[is_robot] = texts[is_robot].replace(old, after)
    (tmp_path / ROBOT).write_text(texts[True], encoding="utf-8")
    (tmp_path / "systems").mkdir()
    (tmp_path / "systems/system.yaml").write_text(texts[False], encoding="utf-8")
    system = compile_system("systems/system.yaml", environment={})
    assert code in {one.code for one in system.report}
    golden.check(f"{code}.txt", render_text(system.report, system.sources, False))
