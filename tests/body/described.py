"""The description of a robot's body, for tests of robots that have one; and a single xacro file, expanded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rbxcompose.base.findings import Finding, Span
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.body.xacro import Expanded, XacroFile, expand_all


def described(manifest: RobotManifest) -> Description:
    """Return the description of the robot's body; an AssertionError is raised if it has none."""
    found = manifest.contents.of(body)
    assert found is not None
    return found


def expand(
    path: Path, arguments: Mapping[str, str], packages: Mapping[str, Path], roots: Sequence[Path], span: Span
) -> tuple[Expanded | Finding, Sequence[Path]]:
    """Expand one xacro file."""
    return expand_all([XacroFile(path, arguments, packages, roots, span)])[0]
