"""The section `body`: the file that describes the robot's body."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from rbxcompose.config import Config
from rbxcompose.findings import Finding
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.limits import URDF_BYTES
from rbxcompose.manifest.reader import read_source
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.manifest.tree import value_span
from rbxcompose.manifest.urdf import mistake_in_urdf
from rbxcompose.manifest.wanted_components import WantedComponent, Wiring

DESCRIPTION = "robot_description"
"""The component that a robot with a body runs."""


class Body(Config):
    """What the robot looks like and how it moves."""

    urdf: FileName
    """The URDF file, relative to this one; it is published unchanged on `robot_description`."""


@dataclass(frozen=True, slots=True)
class Description:
    """The description of the robot's body: a URDF file and its text, which was read without mistakes."""

    path: Path
    text: str


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that publishes the description."""
    if found := contents.of(body):
        yield WantedComponent(DESCRIPTION, DESCRIPTION, {"urdf": found.text}, ("body", "urdf"))


@section("body", Body, order=30, brings=(DESCRIPTION,), components=_components)
def body(reading: Reading[Body]) -> Description | None:
    """What the robot looks like and how it moves: its URDF file, published for viewers and other programs.

    Example:
        body:
          urdf: robot.urdf                # beside this file, or a path from here
    """
    read, report = reading.whole(), reading.report
    if read is None or reading.node is None:
        return None
    documents, span = reading.contents.documents, value_span(reading.node, ("urdf",))
    path = resolve(read.urdf, documents.writer(span, reading.contents.file), span)
    if isinstance(path, Finding):
        report.add(path)
        return None
    shown = shown_name(path)
    text, findings = read_source(path, shown, documents.sources, URDF_BYTES, "a URDF file")
    if text is not None and (mistake := mistake_in_urdf(text, shown)):
        findings = [mistake]
    report.extend(replace(one, span=one.span or span) for one in findings)
    return None if text is None or findings else Description(path, text)
