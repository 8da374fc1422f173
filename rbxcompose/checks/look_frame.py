"""A point to look at, in a frame that the head does not know."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, suggest
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.model.robot import Robot
from rbxcompose.sections.heads import heads
from rbxcompose.sections.scene import scene


@check("RBX2377", closed=("heads", "scene"))
def look_frame(robot: Robot) -> Iterator[Finding]:
    """A head is to look at a point in a frame that it does not know."""
    contents, description = robot.manifest.contents, robot.manifest.body
    found = contents.of(heads)
    if description is None:
        return
    skills = {"look_at" if len(found) == 1 else f"look_at_{name}": name for name in found}
    for node in (node for mission in robot.missions.values() for node in mission.program.nodes if node.skill in skills):
        head, written = skills[node.skill], next((one for one in node.step.arguments if one.name == "frame"), None)
        frames = (*found[head].model.frames, *contents.of(scene).frames)
        if written is None or not isinstance(written.value, ScalarNode) or "$" in written.value.text:
            continue
        frame = written.value.text
        if frame and frame not in description.body.links and frame not in frames:
            near = suggest(frame, (*frames, *description.body.links), "its links")
            listed = ", ".join((*found[head].model.frames, frame))
            yield look_frame.at(
                written.value.span,
                f"'{head}' knows no frame '{frame}'",
                help=f"write 'frames: [{listed}]' below it" if frame in ("map", "odom") else near,
                related=[Related(robot.key("heads", head), "the head")],
            )
