"""A project of files that a test writes down, and the robot among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import dedent

from rbxcompose.base.findings import Finding
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.manifest.tree import at
from rbxcompose.manifest.validate import to_plain
from rbxcompose.testing.manifests import Checked, check_text

BATTERY = """\
rbx: 1
kind: Part
name: battery
args:
  runtime: {type: time, default: 45 s}
  dock: {type: place, default: dock}
components:
  battery: {type: battery_sim, runtime: "${args.runtime}"}
  charger: {type: charger, dock: "${args.dock}"}
"""


class Project:
    """The folder of a project; the robot's file is `robots/one/robot.yaml`, parts lie in `parts/`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.checked: Checked | None = None

    def check(
        self,
        robot: str,
        parts: Mapping[str, str] | None = None,
        *,
        files: Mapping[str, str] | None = None,
        profiles: Sequence[str] = (),
        overlays: Sequence[str] = (),
        sets: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
    ) -> Checked:
        written = {f"../../parts/{name}.yaml": part(text, name) for name, text in (parts or {}).items()}
        others = {**written, **{f"../../{name}": dedent(text) for name, text in (files or {}).items()}}
        self.checked = check_text(
            "rbx: 1\nkind: Robot\nname: one\n" + dedent(robot),
            self.folder / "robots/one",
            others=others,
            profiles=profiles,
            overlays=[str(self.folder / overlay) for overlay in overlays],
            sets=sets,
            environment=environment,
        )
        return self.checked

    @property
    def manifest(self) -> RobotManifest:
        assert self.checked
        robot = self.checked.compilation.robot
        assert robot, self.checked.text
        return robot.manifest

    @property
    def findings(self) -> list[Finding]:
        assert self.checked
        return list(self.checked.compilation.report)

    @property
    def text(self) -> str:
        assert self.checked
        return self.checked.text

    def value(self, *path: str | int) -> object:
        """Return the value at a path of the composed robot as plain data."""
        node = at(self.manifest.root, path)
        return to_plain(node) if node else None


def part(text: str, name: str = "part") -> str:
    """Return a part's file; one that has no header gets it."""
    return text if text.startswith("rbx:") else f"rbx: 1\nkind: Part\nname: {name}\n{dedent(text)}"
