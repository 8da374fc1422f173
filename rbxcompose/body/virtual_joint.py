"""The virtual joint of a body: in which frame outside of the URDF its root stands, or moves. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace
from typing import Literal

from rbxcompose.body.model import Body, BodyJoint, BodyLink
from rbxcompose.body.pieces import to_xml
from rbxcompose.body.xml_reader import XmlElement, read_urdf
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Related, Span, kind
from rbxcompose.geometry import Transform3
from rbxcompose.printable import plain

VirtualKind = Literal["fixed", "planar", "floating"]
MISFIT = kind("RBX2249")


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
