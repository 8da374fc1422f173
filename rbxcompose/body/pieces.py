"""Pieces of a body, each a URDF of its own, put together: prefixed names, and joints that attach them. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from rbxcompose.body.attachment import PieceAttachment
from rbxcompose.body.xml_reader import XmlElement
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Span, kind

NOT_ATTACHED = kind("RBX2016", is_fixable=True)
MOUNT = "mount"
"""The joint that attaches the piece `head` is `head_mount`."""
_NAMES = {"link": ("name",), "joint": ("name",), "parent": ("link",), "child": ("link",), "mimic": ("joint",),
          "material": ("name",)}  # fmt: skip
_OTHERS = ("name", "reference", "joint", "link")  # attributes of further elements that may name a link or a joint


@dataclass(frozen=True, slots=True)
class PieceOfBody:
    """One URDF of several; `span` is the place that brings it, an empty `name` is that of the robot's own body."""

    name: str
    root: XmlElement
    attachment: PieceAttachment | None
    span: Span
    to: Span
    """Place of the name of the link that carries it."""

    @property
    def prefix(self) -> str:
        """Return what the names of its links and joints begin with."""
        return f"{self.name}_" if self.name else ""


def assembled(name: str, pieces: Sequence[PieceOfBody]) -> XmlElement | list[Finding]:
    """Return one URDF named `name` of several, or why that is impossible."""
    loose = [one for one in pieces if one.attachment is None]
    base = next((one for one in loose if not one.name), loose[0] if loose else None)
    roots = {one.name: prefixed(one.root, one.prefix) for one in pieces}
    links = [link for root in roots.values() for link in _named(root, "link")]
    findings = [_loose(one, base) for one in loose if one is not base]
    children = [child for root in roots.values() for child in root.children]
    for one in pieces:
        if one.attachment is None:
            continue
        first = _first_link(roots[one.name])
        if one.attachment.to not in links:
            message = f"'{one.name}' is attached to a link that does not exist: '{one.attachment.to}'"
            findings.append(NOT_ATTACHED.misspelt(one.to, message, one.attachment.to, links, "links"))
        elif first is None:
            findings.append(NOT_ATTACHED.at(one.span, f"the piece '{one.name}' has no link that could be attached"))
        else:
            children.append(_mount(one, one.attachment, first))
    return findings or XmlElement("robot", {"name": name}, pieces[0].span, children)


def _loose(piece: PieceOfBody, base: PieceOfBody | None) -> Finding:
    also = f", and neither is '{base.name}'" if base and base.name else ""
    message = f"the piece '{piece.name}' is attached to nothing{also}"
    return NOT_ATTACHED.at(piece.span, message, help="write 'attach: {to: LINK}' beside its 'part:'")


def _mount(piece: PieceOfBody, attachment: PieceAttachment, child: str) -> XmlElement:
    at, span = attachment.at, piece.to
    pose = {"xyz": f"{at.x!r} {at.y!r} {at.z!r}", "rpy": f"{at.roll!r} {at.pitch!r} {at.yaw!r}"}
    ends = [XmlElement("parent", {"link": attachment.to}, span), XmlElement("child", {"link": child}, span)]
    joint = {"name": f"{piece.prefix}{MOUNT}", "type": "fixed"}
    return XmlElement("joint", joint, span, [XmlElement("origin", pose, span), *ends])


def _named(root: XmlElement, name: str) -> Iterator[str]:
    return (one.attributes["name"] for one in root.all(name) if one.attributes.get("name"))


def _first_link(root: XmlElement) -> str | None:
    """Return the link that is no joint's child; if there are several, the rest is told when the tree is checked."""
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
    return replace(root, children=[own(one) if one.name in _NAMES else other(one) for one in root.children])


def _changed(
    element: XmlElement, attributes: Mapping[str, str], text: str, change: Callable[[XmlElement], XmlElement]
) -> XmlElement:
    children = [change(child) for child in element.children]
    return replace(element, attributes={**element.attributes, **attributes}, text=text, children=children)


def with_meshes(element: XmlElement, names: Mapping[str, str]) -> XmlElement:
    """Return an element with other names for its mesh files."""
    new = {"filename": names[element.attributes["filename"]]} if element.attributes.get("filename") in names else {}
    return _changed(element, new if element.name == "mesh" else {}, element.text, lambda one: with_meshes(one, names))


def to_xml(root: XmlElement) -> str:
    """Return the text of a URDF."""
    return "\n".join(['<?xml version="1.0"?>', *_lines(root, ""), ""])


def _lines(element: XmlElement, indent: str) -> Iterator[str]:
    from xml.sax.saxutils import escape, quoteattr  # imports much of the network's modules; most bodies are one text

    attributes = "".join(f" {name}={quoteattr(value)}" for name, value in element.attributes.items())
    text = escape(element.text.strip())
    if not element.children:
        yield f"{indent}<{element.name}{attributes}{f'>{text}</{element.name}>' if text else '/>'}"
        return
    yield f"{indent}<{element.name}{attributes}>{text}"
    for child in element.children:
        yield from _lines(child, f"{indent}  ")
    yield f"{indent}</{element.name}>"
