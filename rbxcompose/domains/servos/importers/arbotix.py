"""`arbotix`: files of `arbotix_python`, the ROS driver of the ArbotiX board and of Dynamixel servos."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.base.findings import Report
from rbxcompose.commands.importing.foreign_files import ForeignFile
from rbxcompose.commands.importing.importer import importer
from rbxcompose.commands.importing.manifest_text import header
from rbxcompose.domains.servos.arbotix import ArbotixManifest, merged, read_arbotix


@importer("arbotix", "driver files of arbotix_python, and parameters of its gripper controller")
def arbotix(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with the servos, joints and controllers of the files."""
    read = {file.name: read_arbotix(file, report) for file in files}
    found = {file: item for file, item in read.items() if item.drivers or item.grippers}
    sections = ArbotixManifest(merged(list(found.values()), report)).text()
    return f"{header('arbotix', found, 'Robot', name)}\n{sections}" if sections else ""
