"""A systemd runs the unit that is exported: it is up when the robot is, a hang is noticed, and it ends at rest."""

from __future__ import annotations

import json
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.tools.exporting.shares import WATCHDOG, shares, unit, unit_name
from tests.conftest import ROOT
from tests.exporting.own_systemd import FILES, TREE, OwnSystemd
from tests.systems.namespaces import NotPermittedError

SYSTEM = """
rbx: 1
kind: System
name: alone
hosts: {{here: {{}}}}
robots: {{patroller: {{robot: {tree}/robots/turtlebot/robot.yaml}}}}
"""
PROGRAM = f'#!/bin/sh\nPYTHONPATH={TREE} exec {sys.executable} -m rbxcompose "$@"\n'
LONGEST = 40.0  # [s] for a loaded machine to start the robot


def until(holds: Callable[[], bool], within: float = LONGEST) -> None:
    deadline = time.monotonic() + within
    while not holds():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.1)


@pytest.mark.soak
@pytest.mark.timeout(200)
def test_systemd_runs_the_unit_restarts_what_hangs_and_stops_it_at_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "system.yaml").write_text(SYSTEM.format(tree=ROOT), encoding="utf-8")
    (share,) = shares(compile_system("system.yaml", environment={}))
    (tmp_path / "system.yaml").write_text(SYSTEM.format(tree=TREE), encoding="utf-8")
    (tmp_path / "rbxcompose").write_text(PROGRAM, encoding="utf-8")
    (tmp_path / "rbxcompose").chmod(0o755)
    name, run = unit_name(share), f"/run/rbxcompose-{share.name}/rbxcompose/patroller"
    try:
        systemd = OwnSystemd(tmp_path)
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with systemd:
        systemd.install(name, unit(share, program=f"{FILES}/rbxcompose", file=f"{FILES}/system.yaml", user="root"))
        started = systemd.run("systemctl", "start", name)
        assert started.returncode == 0, started.stderr
        assert systemd.property(name, "ActiveState") == "active"

        def supervisor() -> int:
            state = systemd.run("tail", "-n1", f"{run}/state.json").stdout
            return int(json.loads(state)["supervisor"]["pid"])

        hung, since = supervisor(), time.monotonic()
        assert systemd.run("kill", f"-{signal.SIGSTOP}", str(hung)).returncode == 0
        until(lambda: systemd.property(name, "NRestarts") == "1", LONGEST)
        assert time.monotonic() - since > WATCHDOG / 2
        until(lambda: systemd.property(name, "ActiveState") == "active")
        assert supervisor() != hung
        assert systemd.run("systemctl", "stop", name).returncode == 0
        assert (systemd.property(name, "Result"), systemd.property(name, "ActiveState")) == ("success", "inactive")
        log = systemd.run("cat", f"{run}/log.jsonl").stdout
        assert "mission patrol: halted" in log
        assert "rbxcompose" not in systemd.run("sh", "-c", "cat /proc/[0-9]*/cmdline").stdout
