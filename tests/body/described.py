"""The description of a robot's body, for tests of robots that have one."""

from __future__ import annotations

from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.sections.body import body


def described(manifest: RobotManifest) -> Description:
    """Return the description of the robot's body; an AssertionError is raised if it has none."""
    found = manifest.contents.of(body)
    assert found is not None
    return found
