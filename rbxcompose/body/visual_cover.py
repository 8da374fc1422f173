"""Shapes that are seen, among those that nothing may be within. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.body.model import Body, BodyLink
from rbxcompose.body.xml_reader import XmlElement

_OF_SHAPE = ("origin", "geometry")  # what a visual has in common with a collision


def covering(root: XmlElement, body: Body) -> XmlElement:
    """Return the URDF of a body whose visual shapes are collision shapes, too; none that is one is there twice."""
    children = [
        replace(one, children=[*one.children, *_seen(one, body.links[one.attributes["name"]])])
        if one.name == "link"
        else one
        for one in root.children
    ]
    return replace(root, children=children)


def _seen(element: XmlElement, link: BodyLink) -> Iterator[XmlElement]:
    there = {(one.geometry, one.origin) for one in link.collisions}
    for visual, shape in zip(element.all("visual"), link.visuals, strict=True):
        if (shape.geometry, shape.origin) not in there:
            there.add((shape.geometry, shape.origin))
            children = [one for one in visual.children if one.name in _OF_SHAPE]
            yield XmlElement("collision", {}, visual.span, children)
