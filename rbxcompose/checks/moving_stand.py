"""A frame in which seen things are to stand, and that joints move."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.body.model import Body
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import PutsThings


@check("RBX2378", Severity.WARNING, closed=())
def moving_stand(robot: Robot) -> Iterator[Finding]:
    """Seen things are to stand in a frame that a joint moves."""
    description = robot.manifest.body
    for component, puts in robot.declared(PutsThings) if description else ():
        body = description.body if description else Body("")
        link, mover = puts.stands_in.value, None
        while link in body.joint_above and mover is None:
            above = body.joint_above[link]
            link, mover = above.parent, above if above.moves else None
        if mover is not None and component.is_sound:
            yield moving_stand.at(
                robot.value(*component.place(puts.stands_in.field)),
                f"'{mover.name}' moves '{puts.stands_in.value}', and with it all things that were seen",
                help=f"write a link that it does not move, such as '{body.root}'",
                related=[Related(mover.span, "the joint")],
            )
