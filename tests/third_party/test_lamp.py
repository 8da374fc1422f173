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

from tests.commands import SEVERAL
from tests.conftest import ROOT
from tests.third_party.places import LAMP, install
from tests.third_party.rbx_lamp import make_messages

LIGHTHOUSE = Path(__file__).parent / "lighthouse"
COMPLETE = """\
from pathlib import Path
from rbxcompose.commands.main import main
from rbxcompose.tools.lsp.completion import complete
from rbxcompose.tools.lsp.document import Document
for text, line in ((Path("robot.yaml").read_text(), 5), (Path("robot.yaml").read_text().replace("period", "per"), 6)):
    print([item.label for item in complete(Document(Path("robot.yaml"), text), line, 10 if line == 5 else 7)])
main(["schema", "robot"])
"""
IS_IMPORTED = """\
import sys
from rbxcompose.commands.main import main
for robot in ("other", "."):
    main(["check", robot])
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

    def robot(self, folder: str, old: str, new: str) -> str:
        """Write a robot, or its mission, in which some words are others; return its folder."""
        for path in LIGHTHOUSE.glob("*.yaml"):
            changed = self.folder / folder / path.name
            changed.parent.mkdir(exist_ok=True)
            changed.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
        return folder

    def do(self, *commands: list[str]) -> list[str]:
        """Run commands one after the other in the robot's folder, and return what each says in both streams."""
        return self.run("-c", SEVERAL, json.dumps(commands)).split("\f")

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


def test_its_robot_is_checked_and_its_mission_runs_to_the_end_and_its_component_again(installed: Installed) -> None:
    up = installed.run("-m", "rbxcompose", "up", "--rate", "max", "--record", "again.mcap", ".")
    assert "mission night: success" in up
    assert up.endswith("[0]"), up
    replay = ["replay", "again.mcap", "--into", "light"]
    other = ["--robot", ".", "--set", "components.light.period=1s"]
    check, again, differs, _ = installed.do(["check", "--strict", "."], replay, [*replay, *other])
    assert check.startswith("lighthouse is fine")
    assert "'light' sends the same as recorded" in again
    assert "RBX9209" in differs, differs
    assert "/lamp/light" in differs


@pytest.mark.soak  # skills of components in other processes are tried with ours
def test_its_orders_and_their_ends_go_from_one_process_to_another(installed: Installed) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    out = installed.run("-m", "rbxcompose", "up", "--set", f"bus.port={port}", ".")
    assert "in 2 processes" in out
    assert "dim 0.5: success" in out
    assert out.endswith("[0]"), out


@pytest.mark.soak  # as those of a part do in `tests/cli/test_new`
def test_its_own_tests_pass(installed: Installed) -> None:
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "--import-mode=importlib", str(LAMP / "test_lamp.py")]
    assert "6 passed" in installed.run(*words)


@pytest.mark.soak
def test_its_skills_settings_and_check_are_told_like_ours(installed: Installed) -> None:
    misspelt = installed.robot("misspelt", "cool_down: $light.flashes", "cool_down: {flahes: 3}")
    unknown = installed.robot("unknown", "period: 500 ms", "perod: 500 ms")
    fast = installed.robot("fast", "500 ms", "50 ms")
    checks = (["check", folder] for folder in (misspelt, unknown, fast))
    listed, skill, setting, check, page, _ = installed.do(["mission", "skills", "."], *checks, ["explain", "lamp01"])
    names = {line.split()[0] for line in listed.splitlines() if line.strip()}
    assert {"blink", "cool_down", "dim", "read_character"} <= names
    assert "topic /dim" in listed
    assert "- dim: " in listed
    assert "did you mean 'flashes'?" in skill
    assert "did you mean 'period'?" in setting
    assert "warning[LAMP01]: 'light' blinks every 0.05 s, which nobody sees" in check
    assert "robot.yaml:7:13" in check
    assert page.startswith("LAMP01: A lamp that blinks too fast")


@pytest.mark.soak
def test_schema_and_editor_know_it(installed: Installed) -> None:
    types, settings, schema = installed.run("-c", COMPLETE).split("\n", 2)
    assert "'lamp'" in types
    assert "'period', 'brightness'" in settings
    assert "brightness" in json.loads(schema.rpartition("[")[0])["$defs"]["component_lamp"]["properties"]


def test_its_messages_are_those_of_its_texts() -> None:
    assert (LAMP / "rbx_lamp/msgs.py").read_text(encoding="utf-8") == make_messages.text()


@pytest.mark.soak
def test_a_robot_that_does_not_use_it_does_not_import_it(installed: Installed) -> None:
    installed.robot("other", "type: lamp\n    period: 500 ms", "type: battery_sim\n    runtime: 45 s")
    out = installed.run("-c", IS_IMPORTED)
    assert 0 < out.index("left alone") < out.index("imported")
