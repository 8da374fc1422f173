"""A head whose camera is an optical frame."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.sections.heads import heads

_OPTICAL = "_optical"  # by REP 103, such a frame is that of its camera, with the suffix `_optical`


@check("RBX2371", Severity.WARNING, closed=())
def optical_camera(robot: Robot) -> Iterator[Finding]:
    """The camera of a head is an optical frame."""
    contents, description = robot.manifest.contents, robot.manifest.body
    if description is None:
        return
    body = description.body
    for name, one in contents.of(heads).items():
        camera = one.model.camera
        if _OPTICAL in camera and camera in body.joint_above:
            plain = camera.replace(_OPTICAL, "")
            meant = plain if plain in body.links else body.joint_above[camera].parent
            yield optical_camera.at(
                robot.value("heads", name, "camera"),
                f"'{camera}' looks along its z, and a head points the x of its camera",
                help=f"write 'camera: {meant}'",
                related=[Related(body.links[camera].span, "the link")],
            )
