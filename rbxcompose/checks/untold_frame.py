"""A virtual joint that moves, although nobody tells where the robot is in its frame."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES, WIRING
from rbxcompose.sdk.capabilities import WritesFrame


@check("RBX2352", Severity.WARNING, closed=(WIRING, NAMES))
def untold_frame(robot: Robot) -> Iterator[Finding]:
    """Nobody tells where the robot is in the frame of its virtual joint."""
    description = robot.manifest.body
    if description is None or description.virtual is None or description.virtual.kind == "fixed":
        return
    joint, root = description.virtual, description.body.root
    above = {frame.child.value: frame.parent.value for _, frame in robot.declared(WritesFrame)}
    told, link = dict[str, None](), root
    while (link := above.get(link, "")) and link not in told:
        told[link] = None
    if joint.frame not in told:
        names = " or ".join(f"'frame: {name}'" for name in told)
        yield untold_frame.at(
            joint.frame_span,
            f"nobody tells where '{root}' is in '{joint.frame}'",
            help=f"write {names}" if told else "write 'type: fixed' if it stands still, or add what localises it",
            related=[Related(description.body.links[root].span, "the root of the body")],
        )
