"""A package of somebody else, installed by pip: its component, its skills and its check are like ours."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.third_party.places import LAMP, install
from tests.third_party.rbx_lamp import make_messages

LIGHTHOUSE = Path(__file__).parent / "lighthouse"
ROBOT = (LIGHTHOUSE / "robot.yaml").read_text(encoding="utf-8")
COMPLETE = """\
from pathlib import Path
from rbxcompose.tools.lsp.completion import complete
from rbxcompose.tools.lsp.document import Document
for text, line in ((Path("robot.yaml").read_text(), 5), (Path("robot.yaml").read_text().replace("period", "per"), 6)):
    print([item.label for item in complete(Document(Path("robot.yaml"), text), line, 10 if line == 5 else 7)])
"""
IS_IMPORTED = """\
import sys
from rbxcompose.commands.main import main
main(["check", "."])
print("imported" if "rbx_lamp.lamp" in sys.modules else "left alone")
"""


class Installed:
    """The folder in which the package is installed, and a robot that uses it."""

    def __init__(self, work: Path) -> None:
        self.site = install(LAMP, work)
        self.folder = work / "lighthouse"
        shutil.copytree(LIGHTHOUSE, self.folder)
        self._environment = {
            **os.environ,
            "PYTHONPATH": f"{self.site}{os.pathsep}{ROOT}",
            "XDG_RUNTIME_DIR": str(work),
            "NO_COLOR": "1",
        }

    def write(self, robot: str) -> None:
        (self.folder / "robot.yaml").write_text(robot, encoding="utf-8")

    def run(self, *words: str) -> str:
        """Run Python in the robot's folder, and return what it says in both streams."""
        done = subprocess.run(
            [sys.executable, *words],
            cwd=self.folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        assert "Traceback" not in done.stdout, done.stdout
        return f"{done.stdout}[{done.returncode}]"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    return Installed(tmp_path_factory.mktemp("lamp"))


def test_its_robot_is_checked_and_its_mission_runs_to_the_end(installed: Installed) -> None:
    installed.write(ROBOT)
    assert installed.run("-m", "rbxcompose", "check", "--strict", ".").startswith("lighthouse is fine")
    out = installed.run("-m", "rbxcompose", "up", "--rate", "max", ".")
    assert "mission night: success" in out
    assert out.endswith("[0]"), out


def test_its_orders_and_their_ends_go_from_one_process_to_another(installed: Installed) -> None:
    installed.write(ROBOT)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    out = installed.run("-m", "rbxcompose", "up", "--set", f"bus.port={port}", ".")
    assert "in 2 processes" in out
    assert "dim 0.5: success" in out
    assert out.endswith("[0]"), out


def test_its_component_is_run_again_from_the_recording_of_a_run(installed: Installed) -> None:
    installed.write(ROBOT)
    out = installed.run("-m", "rbxcompose", "up", "--rate", "max", "--record", "again.mcap", ".")
    assert out.endswith("[0]"), out
    again = installed.run("-m", "rbxcompose", "replay", "again.mcap", "--into", "light")
    assert "'light' sends the same as recorded" in again
    other = ["--robot", ".", "--set", "components.light.period=1s"]
    again = installed.run("-m", "rbxcompose", "replay", "again.mcap", "--into", "light", *other)
    assert "RBX9209" in again, again
    assert "/lamp/light" in again


def test_its_own_tests_pass(installed: Installed) -> None:
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "--import-mode=importlib", str(LAMP / "test_lamp.py")]
    assert "6 passed" in installed.run(*words)


def test_its_skills_are_listed_and_their_arguments_checked(installed: Installed) -> None:
    installed.write(ROBOT)
    listed = installed.run("-m", "rbxcompose", "mission", "skills", ".")
    assert {"blink", "cool_down", "dim", "read_character"} <= {
        line.split()[0] for line in listed.splitlines() if line.strip()
    }
    assert "topic /dim" in listed
    assert "- dim: " in listed
    mission = (LIGHTHOUSE / "night.yaml").read_text(encoding="utf-8")
    night = installed.folder / "night.yaml"
    night.write_text(mission.replace("cool_down: $light.flashes", "cool_down: {flahes: 3}"), encoding="utf-8")
    assert "did you mean 'flashes'?" in installed.run("-m", "rbxcompose", "check", ".")
    night.write_text(mission, encoding="utf-8")


def test_its_check_is_told_with_its_place_and_has_a_page(installed: Installed) -> None:
    installed.write(ROBOT.replace("500 ms", "50 ms"))
    out = installed.run("-m", "rbxcompose", "check", ".")
    assert "warning[LAMP01]: 'light' blinks every 0.05 s, which nobody sees" in out
    assert "robot.yaml:7:13" in out
    page = installed.run("-m", "rbxcompose", "explain", "lamp01")
    assert page.startswith("LAMP01: A lamp that blinks too fast")


def test_its_settings_are_checked_like_ours(installed: Installed) -> None:
    installed.write(ROBOT.replace("period: 500 ms", "perod: 500 ms"))
    assert "did you mean 'period'?" in installed.run("-m", "rbxcompose", "check", ".")


def test_schema_and_editor_know_it(installed: Installed) -> None:
    installed.write(ROBOT)
    schema = json.loads(installed.run("-m", "rbxcompose", "schema", "robot").rpartition("[")[0])
    assert "brightness" in schema["$defs"]["component_lamp"]["properties"]
    types, settings, *_ = installed.run("-c", COMPLETE).splitlines()
    assert "'lamp'" in types
    assert "'period', 'brightness'" in settings


def test_its_messages_are_those_of_its_texts() -> None:
    assert (LAMP / "rbx_lamp/msgs.py").read_text(encoding="utf-8") == make_messages.text()


def test_a_robot_that_does_not_use_it_does_not_import_it(installed: Installed) -> None:
    installed.write(ROBOT.replace("type: lamp\n    period: 500 ms", "type: battery_sim\n    runtime: 45 s"))
    assert "left alone" in installed.run("-c", IS_IMPORTED)
    installed.write(ROBOT)
    assert "imported" in installed.run("-c", IS_IMPORTED)
