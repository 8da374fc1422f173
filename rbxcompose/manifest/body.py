"""The section `body`: the file that describes what the robot is made of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rbxcompose.findings import Finding
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.limits import URDF_BYTES
from rbxcompose.manifest.models import Body, Description
from rbxcompose.manifest.reader import read_source
from rbxcompose.manifest.sections import is_empty
from rbxcompose.manifest.tree import Mapping, value_span
from rbxcompose.manifest.urdf import mistake_in_urdf
from rbxcompose.manifest.validate import validate


def read_body(root: Mapping, robot: Path, documents: Documents) -> Description | None:
    """Return the robot's description; None if it has none, or after findings."""
    node = root.get("body")
    if node is None or is_empty(node):
        return None
    body = validate(Body, node, ("body",), documents.report)
    if body is None:
        return None
    span = value_span(node, ("urdf",))
    path = resolve(body.urdf, documents.writer(span, robot), span)
    if isinstance(path, Finding):
        documents.report.add(path)
        return None
    shown = shown_name(path)
    text, findings = read_source(path, shown, documents.sources, URDF_BYTES, "a URDF file")
    if text is not None and (mistake := mistake_in_urdf(text, shown)):
        findings = [mistake]
    documents.report.extend(replace(one, span=one.span or span) for one in findings)
    return None if text is None or findings else Description(path, text)
