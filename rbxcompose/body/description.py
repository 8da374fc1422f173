"""The description of a robot's body: its files expanded, put together, read and checked."""

from __future__ import annotations

import os
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import field, replace
from pathlib import Path

from rbxcompose.body.attachment import PieceAttachment
from rbxcompose.body.files import PACKAGE, BodyFile, ReadFile, read_files
from rbxcompose.body.link_pairs import CollisionMatrix
from rbxcompose.body.lint import lint, orientations
from rbxcompose.body.mesh_files import mesh_mistakes
from rbxcompose.body.model import Body
from rbxcompose.body.pieces import PieceOfBody, assembled, to_xml, with_meshes
from rbxcompose.body.urdf import read_body
from rbxcompose.body.virtual_joint import VirtualJoint, rooted, rooted_text
from rbxcompose.body.visual_cover import covering
from rbxcompose.body.xml_reader import XmlElement
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Span


@dataclass(frozen=True, slots=True)
class Description:
    """The body of a robot: its URDF as text, and the links and joints in that."""

    text: str
    body: Body
    meshes: Mapping[str, Path] = field(default_factory=dict)  # the files that exist, by their names in the URDF
    matrix: CollisionMatrix | None = None  # which pairs of links need not be watched, if that is known for this body
    virtual: VirtualJoint | None = None
    published: str = ""  # the URDF for other programs, without the frame of a virtual joint

    def with_virtual(self, joint: VirtualJoint) -> Description:
        """Return the same with a virtual joint; the frame of a fixed one is the root from now on."""
        if joint.kind != "fixed":
            return replace(self, virtual=joint)
        text = rooted_text(self.text, self.body.root, joint)
        return replace(self, text=text, body=rooted(self.body, joint), virtual=joint)


@dataclass(frozen=True, slots=True)
class BodyPart:
    """A file of the body, and where it is attached; the robot's own has no name."""

    name: str
    file: BodyFile
    attachment: PieceAttachment | None
    span: Span
    to: Span


def describe(
    name: str,
    home: Path,
    parts: Sequence[BodyPart],
    sources: MutableMapping[str, str],
    *,
    covers_visuals: bool = False,
) -> tuple[Description | None, list[Finding]]:
    """Return the body that files make together, None if there are errors; and what is wrong with it.

    `name` is that of the robot; the names of its meshes are relative to the folder `home`. The text of a single file
    that is not a piece stays as it is. With `covers_visuals`, visual shapes are collision shapes, too, in the text as
    well.
    """
    read = read_files([part.file for part in parts], sources)
    if findings := [one for one in read if isinstance(one, Finding)]:
        return None, findings
    files = [one for one in read if isinstance(one, ReadFile)]
    notes = [note for one in files for note in one.notes]
    meshes = [part.file.meshes(one.root) for part, one in zip(parts, files, strict=True)]
    meant = {k: v for part, one in zip(parts, files, strict=True) for k, v in part.file.meant_meshes(one.root).items()}
    if len(parts) == 1 and not parts[0].name:
        return _checked(files[0].root, files[0].text, (meshes[0], meant), notes, covers_visuals=covers_visuals)
    pieces: list[PieceOfBody] = []
    there: dict[str, Path] = {}
    for part, file, found in zip(parts, files, meshes, strict=True):
        names = {one: one if one.startswith(PACKAGE) else os.path.relpath(found[one], home) for one in found}
        there |= {names[one]: found[one] for one in found}
        pieces.append(PieceOfBody(part.name, with_meshes(file.root, names), part.attachment, part.span, part.to))
    joined = assembled(name, pieces)
    if isinstance(joined, list):
        return None, [*notes, *joined]
    return _checked(joined, to_xml(joined), (there, meant), notes, covers_visuals=covers_visuals)


def _checked(
    root: XmlElement,
    text: str,
    files: tuple[Mapping[str, Path], Mapping[str, str]],
    notes: Sequence[Finding],
    *,
    covers_visuals: bool,
) -> tuple[Description | None, list[Finding]]:
    body, findings = read_body(root)
    meshes, meant = files
    if findings:
        return None, [*notes, *findings]
    mistakes = [*notes, *lint(body, meshes, meant), *orientations(root), *mesh_mistakes(body, meshes)]
    if covers_visuals:
        covered = covering(root, body)
        text, (body, _) = to_xml(covered), read_body(covered)
    return Description(text, body, meshes, published=text), mistakes
