"""The description of a robot's body: its files expanded, put together, read and checked."""

from __future__ import annotations

import os
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rbxcompose.body.attachment import PieceAttachment
from rbxcompose.body.files import PACKAGE, BodyFile
from rbxcompose.body.lint import lint
from rbxcompose.body.model import Body
from rbxcompose.body.pieces import PieceOfBody, assembled, to_xml, with_meshes
from rbxcompose.body.urdf import read_body
from rbxcompose.body.xml_reader import XmlElement
from rbxcompose.findings import Finding, Span


@dataclass(frozen=True, slots=True)
class Description:
    """The body of a robot: its URDF as text, and the links and joints in that."""

    text: str
    body: Body
    meshes: Mapping[str, Path] = field(default_factory=dict)  # the files that exist, by their names in the URDF


@dataclass(frozen=True, slots=True)
class BodyPart:
    """A file of the body, and where it is attached; the robot's own has no name."""

    name: str
    file: BodyFile
    attachment: PieceAttachment | None
    span: Span
    to: Span


def describe(
    name: str, home: Path, parts: Sequence[BodyPart], sources: MutableMapping[str, str]
) -> tuple[Description | None, list[Finding]]:
    """Return the body that files make together, None if there are errors; and what is wrong with it.

    `name` is that of the robot; the names of its meshes are relative to the folder `home`. The text of a single file
    that is not a piece stays as it is.
    """
    read = [part.file.read(sources) for part in parts]
    if findings := [one for one in read if isinstance(one, Finding)]:
        return None, findings
    found = [one for one in read if not isinstance(one, Finding)]
    meshes = [part.file.meshes(root) for part, (root, _) in zip(parts, found, strict=True)]
    if len(parts) == 1 and not parts[0].name:
        [(whole, text)], [there] = found, meshes
        return _checked(whole, text, there)
    pieces, there = [], {}
    for part, (root, _), files in zip(parts, found, meshes, strict=True):
        names = {one: one if one.startswith(PACKAGE) else os.path.relpath(files[one], home) for one in files}
        there |= {names[one]: files[one] for one in files}
        pieces.append(PieceOfBody(part.name, with_meshes(root, names), part.attachment, part.span, part.to))
    joined = assembled(name, pieces)
    return (None, joined) if isinstance(joined, list) else _checked(joined, to_xml(joined), there)


def _checked(root: XmlElement, text: str, meshes: Mapping[str, Path]) -> tuple[Description | None, list[Finding]]:
    body, findings = read_body(root)
    if findings:
        return None, findings
    return Description(text, body, meshes), list(lint(body, meshes))
