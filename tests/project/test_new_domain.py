"""A new domain is one folder: nothing else of the package changes, and its plug-ins are found."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent

import pytest

import rbxcompose

PACKAGE = Path(rbxcompose.__file__).parent
DOMAIN = {
    "__init__.py": '"""Lights that blink."""\n',
    "blinking.py": '''\
        """When a beacon is on."""


        def is_on(time: float, period: float) -> bool:
            """Return whether it is on at a time [s]: in the first half of each period [s]."""
            return time % period < period / 2
        ''',
    "sections/__init__.py": '"""The section of beacons."""\n',
    "sections/beacons.py": '''\
        """The section `beacons`: lights that blink."""

        from collections.abc import Iterator

        from rbxcompose.base.config import Config, Time
        from rbxcompose.manifest.registry import section
        from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring


        class BeaconModel(Config):
            """One beacon."""

            period: Time = 1.0
            """From one flash to the next."""


        def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
            for name, one in contents.of(beacons).items():
                yield WantedComponent(name, "beacon", {"period": one.period}, ("beacons", name))


        @section("beacons", BeaconModel, names="beacon", runs=True, entry="beacon", components=_components)
        def beacons(reading: Reading[BeaconModel]) -> dict[str, BeaconModel]:
            """Lights that blink.

            Example:
                beacons:
                  roof: {period: 2 s}
            """
            return reading.readable_entries()
        ''',
    "components/__init__.py": '"""The component of beacons."""\n',
    "components/beacon.py": '''\
        """A light that blinks."""

        from rbxcompose.base.config import Time
        from rbxcompose.domains.beacons.blinking import is_on
        from rbxcompose.msgs.std_msgs import Bool
        from rbxcompose.sdk import Component, Config, Out, component


        class BeaconConfig(Config):
            """What can be set."""

            period: Time = 1.0
            """From one flash to the next."""


        @component("beacon")
        class Beacon(Component[BeaconConfig]):
            """Blinks.

            Example:
                roof: {type: beacon}
            """

            rate = 10.0
            light = Out(Bool, "light")

            def configure(self) -> None:
                """Say that it is there."""
                self.info(f"blinks every {self.config.period:g} s")

            def step(self, dt: float) -> None:
                """Publish whether it is on."""
                self.light(Bool(data=is_on(self.now, self.config.period)))
        ''',
    "checks.py": '''\
        """Rules about beacons."""

        from collections.abc import Iterator

        from rbxcompose.base.findings import Finding
        from rbxcompose.compiler.check_runner import check
        from rbxcompose.compiler.model.robot import Robot
        from rbxcompose.domains.beacons.sections.beacons import beacons


        @check("BEACON1")
        def dazzling(robot: Robot) -> Iterator[Finding]:
            """A beacon blinks too fast."""
            for name, beacon in robot.manifest.contents.of(beacons).items():
                if beacon.period < 0.1:
                    span = robot.value("beacons", name, "period")
                    yield dazzling.at(span, f"'{name}' dazzles", help="write '1 s'")
        ''',
    "commands/__init__.py": '"""The verb of beacons."""\n',
    "commands/beacon.py": '''\
        """Tell when a beacon is on."""

        import argparse

        from rbxcompose.commands.console import tell
        from rbxcompose.domains.beacons.blinking import is_on


        def add_arguments(parser: argparse.ArgumentParser) -> None:
            """Declare the arguments."""
            parser.add_argument("time", type=float)


        def run(arguments: argparse.Namespace) -> int:
            """Tell it."""
            tell("on" if is_on(arguments.time, 1.0) else "off")
            return 0
        ''',
}
ROBOT = """\
rbx: 1
kind: Robot
name: lighthouse
beacons:
  roof: {period: 2 s}
"""

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Run a command of a package that has one more domain; everything else in it is the repository's."""
    domains = tmp_path / "tree/rbxcompose/domains"
    domains.mkdir(parents=True)
    for there, here in ((PACKAGE, domains.parent), (PACKAGE / "domains", domains)):
        for entry in there.iterdir():
            if entry.name not in ("domains", "__pycache__"):
                (here / entry.name).symlink_to(entry)
    for name, text in DOMAIN.items():
        file = domains / "beacons" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(dedent(text))
    (tmp_path / "robot.yaml").write_text(ROBOT)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "tree"), "XDG_RUNTIME_DIR": str(tmp_path)}

    def started(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "rbxcompose", *words]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60)

    return started


@pytest.mark.timeout(120)
def test_a_new_domain_is_one_folder(run: Run) -> None:
    right = run("check", "robot.yaml")
    assert right.returncode == 0, right.stderr
    wrong = run("check", "robot.yaml", "--set", "beacons.roof.period=0.01 s")
    assert (wrong.returncode, "error[BEACON1]: 'roof' dazzles" in wrong.stderr + wrong.stdout) == (1, True), wrong
    up = run("up", "robot.yaml", "--rate", "max", "--for", "3s")
    assert up.returncode == 0, up
    assert "blinks every 2 s" in up.stdout
    assert "  beacon " in run("help").stdout
    assert run("beacon", "0.7").stdout == "off\n"
