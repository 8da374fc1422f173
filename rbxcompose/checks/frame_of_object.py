"""A thing of the scene in a frame whose place on the robot nobody tells."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import Drives, WritesFrame
from rbxcompose.sections.scene import scene


@check("RBX2379", Severity.WARNING, closed=(WIRING, NAMES, "scene"))
def frame_of_object(robot: Robot) -> Iterator[Finding]:
    """A thing of the scene stands in a frame outside of a body that nobody places there."""
    description, written = robot.manifest.body, robot.declared(WritesFrame)
    if description is None or robot.declared(Drives):
        return  # RBX2286
    body, placed = description.body, {one.child.value for _, one in written}
    known = placed | {one.parent.value for _, one in written}
    for one in robot.manifest.contents.of(scene).objects if body.root not in placed else ():
        if one.link not in body.links and one.link in known:  # RBX2019 reports the others
            yield frame_of_object.at(
                robot.value("scene", "objects", one.name, "frame"),
                f"nobody tells where '{body.root}' is in '{one.link}'",
                help="leave 'frame' out: what stands beside the robot counts from its root",
                related=[Related(body.links[body.root].span, "the root of the body")],
            )
