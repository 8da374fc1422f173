"""The description of a robot's body: its files expanded, put together, read and checked."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Related, Span, kind, once
from rbxcompose.base.geometry import Transform3
from rbxcompose.base.printable import plain
from rbxcompose.domains.body.files import PACKAGE, BodyFile, MeshFault, ReadFile, mesh_mistakes, read_files
from rbxcompose.domains.body.lint import lint, orientations
from rbxcompose.domains.body.model import Body, BodyJoint, BodyLink
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, escaped, quoted, read_urdf
from rbxcompose.manifest.fields import PieceAttachment

if TYPE_CHECKING:
    from rbxcompose.domains.body.link_pairs import CollisionMatrix

NOT_ATTACHED = kind("RBX2016", is_fixable=True)
MOUNT = "mount"
"""The joint that attaches the piece `head` is `head_mount`."""
_NAMES = {"link": ("name",), "joint": ("name",), "parent": ("link",), "child": ("link",), "mimic": ("joint",),
          "material": ("name",)}  # fmt: skip
_OTHERS = ("name", "reference", "joint", "link")  # attributes of further elements that may name a link or a joint
_OF_SHAPE = ("origin", "geometry")  # what a visual has in common with a collision
MISFIT = kind("RBX2249")


@dataclass(frozen=True, slots=True)
class BodyPart:
    """A file of the body, one URDF of several, and where it is attached; the robot's own has no name."""

    name: str
    file: BodyFile
    attachment: PieceAttachment | None
    span: Span
    """The place that brings it."""
    to: Span
    """Place of the name of the link that carries it."""

    @property
    def prefix(self) -> str:
        """Return what the names of its links and joints begin with."""
        return f"{self.name}_" if self.name else ""


Piece = tuple[BodyPart, XmlElement]
"""A part with the root of its URDF."""


def assembled(name: str, pieces: Sequence[Piece]) -> XmlElement | list[Finding]:
    """Return one URDF named `name` of several, or why that is impossible."""
    parts = [part for part, _ in pieces]
    loose = [part for part in parts if part.attachment is None]
    base = next((part for part in loose if not part.name), loose[0] if loose else None)
    roots = {part.name: prefixed(root, part.prefix) for part, root in pieces}
    links = [link for root in roots.values() for link in _named(root, "link")]
    findings = [_loose(part, base) for part in loose if part is not base]
    children = [child for root in roots.values() for child in root.children]
    for piece in parts:
        if piece.attachment is None:
            continue
        first = _first_link(roots[piece.name])
        if piece.attachment.to not in links:
            message = f"'{piece.name}' is attached to a link that does not exist: '{piece.attachment.to}'"
            findings.append(NOT_ATTACHED.misspelt(piece.to, message, piece.attachment.to, links, "links"))
        elif first is None:
            findings.append(NOT_ATTACHED.at(piece.span, f"the piece '{piece.name}' has no link that could be attached"))
        else:
            children.append(_mount(piece, piece.attachment, first))
    return findings or XmlElement("robot", {"name": name}, parts[0].span, children)


def _loose(piece: BodyPart, base: BodyPart | None) -> Finding:
    also = f", and neither is '{base.name}'" if base and base.name else ""
    message = f"the piece '{piece.name}' is attached to nothing{also}"
    return NOT_ATTACHED.at(piece.span, message, help="write 'attach: {to: LINK}' beside its 'part:'")


def _mount(piece: BodyPart, attachment: PieceAttachment, child: str) -> XmlElement:
    at, span = attachment.at, piece.to
    pose = {"xyz": f"{at.x!r} {at.y!r} {at.z!r}", "rpy": f"{at.roll!r} {at.pitch!r} {at.yaw!r}"}
    ends = [XmlElement("parent", {"link": attachment.to}, span), XmlElement("child", {"link": child}, span)]
    joint = {"name": f"{piece.prefix}{MOUNT}", "type": "fixed"}
    return XmlElement("joint", joint, span, [XmlElement("origin", pose, span), *ends])


def _named(root: XmlElement, name: str) -> Iterator[str]:
    return (element.attributes["name"] for element in root.all(name) if element.attributes.get("name"))


def _first_link(root: XmlElement) -> str | None:
    """Return the link that is no joint's child; if there are several, the rest is reported when the tree is checked."""
    children = {child.attributes.get("link") for joint in root.all("joint") for child in joint.all("child")}
    return next((link for link in _named(root, "link") if link not in children), None)


def prefixed(root: XmlElement, prefix: str) -> XmlElement:
    """Return a URDF with a prefix before the names of its links, joints and materials, wherever they are used."""
    names = {*_named(root, "link"), *_named(root, "joint")}

    def own(element: XmlElement) -> XmlElement:
        changed = {key: f"{prefix}{element.attributes[key]}" for key in _NAMES.get(element.name, ())
                   if element.attributes.get(key)}  # fmt: skip
        return _changed(element, changed, element.text, own)

    def other(element: XmlElement) -> XmlElement:
        changed = {key: f"{prefix}{value}" for key in _OTHERS if (value := element.attributes.get(key)) in names}
        text = (
            element.text.replace(word, f"{prefix}{word}") if (word := element.text.strip()) in names else element.text
        )
        return _changed(element, changed, text, other)

    if not prefix:
        return root
    return replace(root, children=[own(child) if child.name in _NAMES else other(child) for child in root.children])


def _changed(
    element: XmlElement, attributes: Mapping[str, str], text: str, change: Callable[[XmlElement], XmlElement]
) -> XmlElement:
    children = [change(child) for child in element.children]
    return replace(element, attributes={**element.attributes, **attributes}, text=text, children=children)


def with_meshes(element: XmlElement, names: Mapping[str, str]) -> XmlElement:
    """Return an element with other names for its mesh files."""
    new = {"filename": names[element.attributes["filename"]]} if element.attributes.get("filename") in names else {}
    return _changed(element, new if element.name == "mesh" else {}, element.text, lambda item: with_meshes(item, names))


def to_xml(root: XmlElement) -> str:
    """Return the text of a URDF."""
    return "\n".join(['<?xml version="1.0"?>', *_lines(root, ""), ""])


def _lines(element: XmlElement, indent: str) -> Iterator[str]:
    attributes = "".join(f" {name}={quoted(value)}" for name, value in element.attributes.items())
    text = escaped(element.text.strip())
    if not element.children:
        yield f"{indent}<{element.name}{attributes}{f'>{text}</{element.name}>' if text else '/>'}"
        return
    yield f"{indent}<{element.name}{attributes}>{text}"
    for child in element.children:
        yield from _lines(child, f"{indent}  ")
    yield f"{indent}</{element.name}>"


def covering(root: XmlElement, body: Body) -> XmlElement:
    """Return the URDF of a body whose visual shapes are collision shapes, too; none that is one is there twice."""
    children = [
        replace(child, children=[*child.children, *_seen(child, body.links[child.attributes["name"]])])
        if child.name == "link"
        else child
        for child in root.children
    ]
    return replace(root, children=children)


def _seen(element: XmlElement, link: BodyLink) -> Iterator[XmlElement]:
    there = {(collision.geometry, collision.origin) for collision in link.collisions}
    for visual, shape in zip(element.all("visual"), link.visuals, strict=True):
        if (shape.geometry, shape.origin) not in there:
            there.add((shape.geometry, shape.origin))
            children = [child for child in visual.children if child.name in _OF_SHAPE]
            yield XmlElement("collision", {}, visual.span, children)


VirtualKind = Literal["fixed", "planar", "floating"]


@dataclass(frozen=True, slots=True)
class VirtualJoint:
    """A joint of a kind between a frame outside of the URDF and the root of the body."""

    name: str
    kind: VirtualKind
    frame: str
    span: Span = field(compare=False)
    """The place of its name, or of the joint as a whole."""
    frame_span: Span = field(compare=False)


def misfits(joint: VirtualJoint, body: Body) -> Iterator[Finding]:
    """Yield the names of a virtual joint that the body has already."""
    for what, name, span, there in (
        ("link", joint.frame, joint.frame_span, body.links.get(joint.frame)),
        ("joint", joint.name, joint.span, body.joints.get(joint.name)),
    ):
        if there is not None:
            message = f"the body has a {what} '{plain(name, 60)}'"
            cure = "leave the virtual joint out: a link is a frame" if what == "link" else "write another 'name'"
            yield MISFIT.at(span, message, help=cure, related=[Related(there.span, f"the {what}")])


def rooted(body: Body, joint: VirtualJoint) -> Body:
    """Return a body whose root is the frame of a fixed virtual joint."""
    fixed = BodyJoint(joint.name, "fixed", joint.frame, body.root, Transform3(), (1.0, 0.0, 0.0), joint.span)
    links = {joint.frame: BodyLink(joint.frame, joint.frame_span), **body.links}
    return replace(body, links=links, joints={joint.name: fixed, **body.joints}, frame=joint.frame)


def rooted_text(text: str, root: str, joint: VirtualJoint) -> str:
    """Return a URDF whose root is the frame of a fixed virtual joint.

    Raises:
        ValueError: if `text` is no URDF.
    """
    read, span = read_urdf(text, "urdf"), joint.span
    if isinstance(read, Finding):
        raise ValueError(read.message)
    ends = [XmlElement("parent", {"link": joint.frame}, span), XmlElement("child", {"link": root}, span)]
    link = XmlElement("link", {"name": joint.frame}, span)
    fixed = XmlElement("joint", {"name": joint.name, "type": "fixed"}, span, ends)
    return to_xml(replace(read, children=[link, fixed, *read.children]))


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


def describe(
    name: str, home: Path, parts: Sequence[BodyPart], sources: MutableMapping[str, str], *, covers_visuals: bool = False
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
    return _described(name, home, tuple(parts), tuple(files), covers_visuals)


@once  # a profile rarely changes the body
def _described(
    name: str, home: Path, parts: tuple[BodyPart, ...], files: tuple[ReadFile, ...], covers_visuals: bool
) -> tuple[Description | None, list[Finding]]:
    """Return what `describe` does, of the files of its parts as they were read."""
    notes = [note for one in files for note in one.notes]
    meshes = [part.file.meshes(one.root) for part, one in zip(parts, files, strict=True)]
    faults = {k: v for part, one in zip(parts, files, strict=True) for k, v in part.file.mesh_faults(one.root).items()}
    if len(parts) == 1 and not parts[0].name:
        return _checked(files[0].root, files[0].text, (meshes[0], faults), notes, covers_visuals=covers_visuals)
    pieces: list[Piece] = []
    there: dict[str, Path] = {}
    for part, file, found in zip(parts, files, meshes, strict=True):
        names = {one: one if one.startswith(PACKAGE) else os.path.relpath(found[one], home) for one in found}
        there |= {names[one]: found[one] for one in found}
        pieces.append((part, with_meshes(file.root, names)))
    joined = assembled(name, pieces)
    if isinstance(joined, list):
        return None, [*notes, *joined]
    return _checked(joined, to_xml(joined), (there, faults), notes, covers_visuals=covers_visuals)


def _checked(
    root: XmlElement,
    text: str,
    files: tuple[Mapping[str, Path], Mapping[str, MeshFault]],
    notes: Sequence[Finding],
    *,
    covers_visuals: bool,
) -> tuple[Description | None, list[Finding]]:
    body, findings = read_body(root)
    meshes, faults = files
    if findings:
        return None, [*notes, *findings]
    mistakes = [*notes, *lint(body, meshes, faults), *orientations(root), *mesh_mistakes(body, meshes)]
    if covers_visuals:
        covered = covering(root, body)
        text, (body, _) = to_xml(covered), read_body(covered)
    return Description(text, body, meshes, published=text), mistakes
