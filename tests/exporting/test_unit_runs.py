"""A unit does what systemd expects of it: says that it is ready and alive, and ends in time and with a code it knows.

systemd itself does not run in containers. So this starts the unit as systemd.service(5) says, but without its sandbox.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.runtime.supervision.supervisor import ALIVE, READY
from rbxcompose.tools.exporting.shares import WATCHDOG, shares, unit
from tests.conftest import ROOT
from tests.systems.sshd import wrapper

NAME = f"unit_{os.getpid()}"
SYSTEM = f"""
rbx: 1
kind: System
name: alone
hosts: {{here: {{}}}}
robots: {{{NAME}: {{robot: robots/turtlebot/robot.yaml}}}}
"""
LONGEST = 30.0  # [s] for a loaded machine to start the robot


def test_a_unit_is_ready_and_alive_and_ends_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("robots/turtlebot", "missions"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    path = tmp_path / "system.yaml"
    path.write_text(SYSTEM, encoding="utf-8")
    (share,) = shares(compile_system("system.yaml", environment={}))
    text = unit(share, program=str(wrapper(tmp_path)), file=str(path), user="pi")
    options = dict(re.findall(r"^(\w+)=(.*)$", text, re.MULTILINE))
    given = dict(word.split("=", 1) for word in options["Environment"].split())
    assert given["XDG_RUNTIME_DIR"] == f"/run/{options['RuntimeDirectory']}"
    assert given["XDG_STATE_HOME"] == f"/var/lib/{options['StateDirectory']}"
    (runtime := tmp_path / "run").mkdir(mode=int(options["RuntimeDirectoryMode"], 8))
    told = str(tmp_path / "notify")
    environment = {"NOTIFY_SOCKET": told, "WATCHDOG_USEC": f"{WATCHDOG}000000", "XDG_RUNTIME_DIR": str(runtime)}
    environment["XDG_STATE_HOME"] = str(tmp_path / "state")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(told)
        manager.settimeout(LONGEST)
        words = shlex.split(options["ExecStart"].replace("%%", "%"))
        process = subprocess.Popen(words, cwd="/", env={**os.environ, **given, **environment})
        try:
            heard = manager.recv(100)
            while heard != READY:
                assert heard == ALIVE, "it waits, and lives"
                heard = manager.recv(100)
            manager.settimeout(WATCHDOG / 2)
            assert manager.recv(100) == ALIVE
        finally:
            process.terminate()
            code = process.wait(float(options["TimeoutStopSec"]))
    assert str(code) in {"0", *options["SuccessExitStatus"].split()}
    assert str(code) not in options["RestartPreventExitStatus"].split()
