"""`arbotix`: files of `arbotix_python`, the ROS driver of the ArbotiX board and of Dynamixel servos."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.findings import Report
from rbxcompose.importing.arbotix.driver import read_arbotix
from rbxcompose.importing.arbotix.manifest import ArbotixManifest
from rbxcompose.importing.arbotix.robot import merged
from rbxcompose.importing.foreign_files import ForeignFile
from rbxcompose.importing.importer import importer
from rbxcompose.importing.manifest_text import header


@importer("arbotix", "driver files of arbotix_python, and parameters of its gripper controller")
def arbotix(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the servos, joints and controllers of the files."""
    read = {file.name: read_arbotix(file, report) for file in files}
    found = {file: one for file, one in read.items() if one.drivers or one.grippers}
    sections = ArbotixManifest(merged(list(found.values()), report)).text()
    return f"{header('arbotix', found, 'Robot', name)}\n{sections}" if sections else ""
