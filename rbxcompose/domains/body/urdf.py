"""URDF elements to the body, with every mistake in them as a finding."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from functools import lru_cache, partial
from typing import TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import MOST_COMPARED, Finding, Related, Span, kind
from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.base.printable import plain
from rbxcompose.domains.body import model
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf

NO_LINK = kind("RBX2005")
NO_TREE = kind("RBX2006")
_SHOWN = 60
WRONG_VALUE = kind("RBX2003")
TWICE = kind("RBX2004")
_SIZES = {"sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}
_GEOMETRIES = ("box", *_SIZES, "mesh")
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
LARGEST = 1e100  # so that sums and squares of numbers stay finite


def tree_mistakes(body: model.Body, whole: Span) -> Iterator[Finding]:
    """Yield what keeps a body from being one tree; unknown names come first, since the rest would follow from them."""
    if unknown := [*_unknown_links(body), *_wrong_mimics(body)]:
        yield from unknown
    elif not body.links:
        yield NO_TREE.at(whole, "this robot has no links", help="was its xacro expanded without calling its macros?")
    else:
        yield from _shape_mistakes(body)


def _unknown_links(body: model.Body) -> Iterator[Finding]:
    for joint in body.joints.values():
        spans = joint.link_spans or (joint.span, joint.span)
        for role, link, span in zip(("parent", "child"), (joint.parent, joint.child), spans, strict=True):
            if link not in body.links:
                message = f"the {role} of joint '{plain(joint.name, _SHOWN)}' does not exist: '{plain(link, _SHOWN)}'"
                yield NO_LINK.misspelt(span, message, link, _that_may_be(body, joint, role), "links")


def _that_may_be(body: model.Body, joint: model.BodyJoint, role: str) -> dict[str, model.BodyLink]:
    """Return the links that a joint may name: none of those below it as its parent, none with a parent as its child."""
    if len(body.joints) > MOST_COMPARED:
        return dict(body.links)
    if role == "child":
        taken = {joint.parent, *(body_joint.child for body_joint in body.joints.values() if body_joint is not joint)}
    else:
        taken, below = set(), [joint.child]
        while below:
            taken.add(link := below.pop())
            below += [item.child for item in body.joints.values() if item.parent == link and item.child not in taken]
    return {name: link for name, link in body.links.items() if name not in taken} or dict(body.links)


def _wrong_mimics(body: model.Body) -> Iterator[Finding]:
    moving = [body_joint.name for body_joint in body.moving]
    for joint in body.joints.values():
        if joint.mimic is None:
            continue
        other = body.joints.get(joint.mimic.joint)
        if other is None:
            words = f"joint '{plain(joint.name, _SHOWN)}' mimics a joint that does not exist"
            message = f"{words}: '{plain(joint.mimic.joint, _SHOWN)}'"
            yield NO_LINK.misspelt(joint.mimic.span, message, joint.mimic.joint, moving, "joints that move")
        elif other.mimic is not None or not other.moves:
            does = "mimics another joint itself" if other.mimic else "does not move"
            message = f"joint '{plain(joint.name, _SHOWN)}' mimics '{plain(other.name, _SHOWN)}', which {does}"
            yield NO_LINK.at(joint.mimic.span, message, related=[Related(other.span, "the joint that is mimicked")])


def _shape_mistakes(body: model.Body) -> Iterator[Finding]:
    above: dict[str, model.BodyJoint] = {}
    for joint in body.joints.values():
        if joint.child in above:
            message = f"link '{plain(joint.child, _SHOWN)}' is the child of two joints"
            yield NO_TREE.at(joint.span, message, related=[Related(above[joint.child].span, "the first")])
        above.setdefault(joint.child, joint)
    roots = [link for name, link in body.links.items() if name not in above]
    if not roots:
        first = next(iter(body.joints.values()))
        yield NO_TREE.at(first.span, "each link is the child of a joint: the joints form a circle")
        return
    for other in roots[1:]:
        message = f"link '{plain(other.name, _SHOWN)}' is connected to nothing above it, like '{roots[0].name}'"
        related = [Related(roots[0].span, "the first root")]
        yield NO_TREE.at(other.span, message, help="add a joint that has it as its child", related=related)
    if len(roots) == 1 and len(above) == len(body.joints):
        yield from _circle(body)


def _circle(body: model.Body) -> Iterator[Finding]:
    reached = {name for name, _ in body.walk()}
    lost = next((link for name, link in body.links.items() if name not in reached), None)
    if lost is not None:
        joint = body.joint_above[lost.name]
        message = f"link '{plain(lost.name, _SHOWN)}' cannot be reached from '{body.root}': its joints form a circle"
        yield NO_TREE.at(joint.span, message)


Colour = tuple[float, float, float, float]
T = TypeVar("T")
N = TypeVar("N", model.BodyLink, model.BodyJoint)


def read_body(root: XmlElement) -> tuple[model.Body, list[Finding]]:
    """Return the body that a URDF describes, and what is wrong with it; with findings, the body may not be a tree."""
    reader = _BodyReader()
    body = reader.body(root)
    return body, reader.findings or list(tree_mistakes(body, root.span))


@lru_cache(maxsize=4)  # components are asked for their ports many times, which follow from the body
def read_text(urdf: str) -> tuple[model.Body, list[Finding]]:
    """Return the body that the text of a URDF describes, and what is wrong with it, see `read_body`.

    Raises:
        ValueError: if it is not XML.
    """
    root = read_urdf(urdf, "urdf")
    if not isinstance(root, XmlElement):
        raise ValueError(root.message)
    return read_body(root)


def body_of(urdf: str) -> model.Body:
    """Return the body that a URDF of a plan describes.

    Raises:
        ValueError: if it is not XML.
    """
    return read_text(urdf)[0]


class _MistakeError(Exception):
    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


@dataclass
class _BodyReader:
    findings: list[Finding] = field(default_factory=list)
    materials: dict[str, Colour] = field(default_factory=dict)

    def body(self, root: XmlElement) -> model.Body:
        for material in root.all("material"):
            if (colour := material.first("color")) is not None and "name" in material.attributes:
                self.guarded(material, partial(self._remember, colour))
        links = self._named(root, "link", self._link)
        joints = self._named(root, "joint", self._joint)
        return model.Body(root.attributes.get("name", ""), links, model.led(joints))

    def _remember(self, colour: XmlElement, material: XmlElement) -> None:
        red, green, blue, opacity = numbers(colour, "rgba", 4)
        self.materials[material.attributes["name"]] = (red, green, blue, opacity)

    def _named(self, root: XmlElement, name: str, read: Callable[[XmlElement], N]) -> Mapping[str, N]:
        found: dict[str, N] = {}
        for element in root.all(name):
            one = self.guarded(element, read)
            if one is None:
                continue
            if one.name in found:
                related = [Related(found[one.name].span, "the first")]
                self.findings.append(
                    TWICE.at(one.span, f"two {name}s are named '{plain(one.name, _SHOWN)}'", related=related)
                )
                continue
            found[one.name] = one
        return found

    def guarded(self, element: XmlElement, read: Callable[[XmlElement], T]) -> T | None:
        try:
            return read(element)
        except _MistakeError as mistake:
            self.findings.append(mistake.finding)
            return None

    def _link(self, element: XmlElement) -> model.BodyLink:
        inertial = element.first("inertial")
        return model.BodyLink(
            text(element, "name"),
            element.span,
            _inertial(inertial) if inertial else None,
            tuple(self._shape(xml_element) for xml_element in element.all("visual")),
            tuple(self._shape(xml_element) for xml_element in element.all("collision")),
        )

    def _shape(self, element: XmlElement) -> model.Shape:
        geometry = needed(element, "geometry")
        size = next((child.span for child in geometry.children if child.name in _GEOMETRIES), None)
        return model.Shape(_geometry(geometry), _origin(element), element.span, self._colour(element), size)

    def _colour(self, element: XmlElement) -> Colour | None:
        material = element.first("material")
        if material is None:
            return None
        if (colour := material.first("color")) is not None:
            red, green, blue, opacity = numbers(colour, "rgba", 4)
            return (red, green, blue, opacity)
        return self.materials.get(material.attributes.get("name", ""))

    def _joint(self, element: XmlElement) -> model.BodyJoint:
        name, kind_ = text(element, "name"), text(element, "type")
        if kind_ not in model.KINDS:
            words = f"a joint cannot be of type '{plain(kind_, _SHOWN)}'"
            raise _MistakeError(WRONG_VALUE.misspelt(element.span, words, kind_, model.KINDS, "types of joints"))
        parent, child = needed(element, "parent"), needed(element, "child")
        limit, mimic, axis = element.first("limit"), element.first("mimic"), element.first("axis")
        if kind_ in ("revolute", "prismatic") and limit is None:
            message = f"joint '{plain(name, _SHOWN)}' is {kind_} and needs '<limit>'"
            raise _MistakeError(WRONG_VALUE.at(element.span, message, help="or make it 'continuous'"))
        if kind_ in ("fixed", "floating"):
            axis = None  # exporters write zeros, since nothing uses it
        return model.BodyJoint(
            name,
            kind_,
            text(parent, "link"),
            text(child, "link"),
            _origin(element),
            _unit(axis) if axis is not None else (1.0, 0.0, 0.0),
            element.span,
            _limits(limit, name) if limit is not None else None,
            _mimic(mimic) if mimic is not None else None,
            (parent.span, child.span),
            axis.span if axis is not None else None,
        )


def _inertial(element: XmlElement) -> model.Inertial:
    mass, inertia = needed(element, "mass"), needed(element, "inertia")
    moments = tuple(number(inertia, name) for name in _INERTIA)
    return model.Inertial(number(mass, "value"), _origin(element), moments, element.span, mass.span, inertia.span)


def _geometry(element: XmlElement) -> model.Geometry:
    shape = next((child for child in element.children if child.name in _GEOMETRIES), None)
    if shape is None:
        raise _MistakeError(WRONG_VALUE.at(element.span, f"a geometry is one of {', '.join(_GEOMETRIES)}"))
    match shape.name:
        case "mesh":
            scale = numbers(shape, "scale", 3) if "scale" in shape.attributes else (1.0, 1.0, 1.0)
            return model.Geometry("mesh", scale, text(shape, "filename"))
        case "box":
            size = numbers(shape, "size", 3)
        case name:
            size = tuple(number(shape, one) for one in _SIZES[name])
    if min(size) <= 0:
        raise _MistakeError(WRONG_VALUE.at(shape.span, f"the size of a {shape.name} must be positive"))
    return model.Geometry(shape.name, size)


def _origin(element: XmlElement) -> Transform3:
    origin = element.first("origin")
    if origin is None:
        return Transform3()
    x, y, z = numbers(origin, "xyz", 3) if "xyz" in origin.attributes else (0.0, 0.0, 0.0)
    return Transform3((x, y, z), quaternion_from_rpy(*rpy_of(origin)))


def rpy_of(origin: XmlElement) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of an origin [rad]."""
    roll, pitch, yaw = numbers(origin, "rpy", 3) if "rpy" in origin.attributes else (0.0, 0.0, 0.0)
    return roll, pitch, yaw


def _unit(element: XmlElement) -> tuple[float, float, float]:
    x, y, z = numbers(element, "xyz", 3)
    length = math.hypot(x, y, z)
    if length == 0.0:
        raise _MistakeError(WRONG_VALUE.at(element.span, "the axis of a joint has length zero"))
    return (x / length, y / length, z / length)


def _limits(element: XmlElement, joint: str) -> model.JointLimits:
    lower, upper, effort, velocity = (
        number(element, name) if name in element.attributes else None
        for name in ("lower", "upper", "effort", "velocity")
    )
    if lower is not None and upper is not None and lower > upper:
        message = f"the lower limit of joint '{plain(joint, _SHOWN)}' is above its upper one"
        raise _MistakeError(WRONG_VALUE.at(element.span, message))
    for name, value in (("velocity", velocity), ("effort", effort)):
        if value is not None and value < 0.0:
            message = f"the {name} limit of joint '{plain(joint, _SHOWN)}' is negative: {value:g}"
            help_text = "a limit holds for both directions: write it without a sign"
            raise _MistakeError(WRONG_VALUE.at(element.span, message, help=help_text))
    return model.JointLimits(lower, upper, effort, velocity, element.span)


def _mimic(element: XmlElement) -> model.Mimic:
    multiplier = number(element, "multiplier") if "multiplier" in element.attributes else 1.0
    offset = number(element, "offset") if "offset" in element.attributes else 0.0
    return model.Mimic(text(element, "joint"), multiplier, offset, element.span)


def needed(element: XmlElement, name: str) -> XmlElement:
    """Return a child that must be there."""
    found = element.first(name)
    if found is None:
        raise _MistakeError(WRONG_VALUE.at(element.span, f"'<{element.name}>'{_called(element)} needs '<{name}>'"))
    return found


def text(element: XmlElement, name: str) -> str:
    """Return an attribute that must be there and not be empty."""
    found = element.attributes.get(name, "")
    if not found:
        message = f"'<{element.name}>'{_called(element)} needs the attribute '{name}'"
        raise _MistakeError(WRONG_VALUE.at(element.span, message))
    return found


def number(element: XmlElement, name: str) -> float:
    """Return an attribute that is one finite number."""
    return numbers(element, name, 1)[0]


def numbers(element: XmlElement, name: str, count: int) -> tuple[float, ...]:
    """Return an attribute that is `count` finite numbers."""
    written = text(element, name)
    found = tuple(_numbers_in(written)) if len(written) < 1000 else ()
    if len(found) != count or not all(abs(one) <= LARGEST for one in found):
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        what += f" up to {LARGEST:g}" if all(map(math.isfinite, found)) and len(found) == count else ""
        message = f"'{name}' of '<{element.name}>' must be {what}, not '{plain(written, _SHOWN)}'"
        raise _MistakeError(WRONG_VALUE.at(element.span, message, help=_cure(name, written, count)))
    return found


def _cure(name: str, written: str, count: int) -> str:
    """Return what to write instead of numbers in another form."""
    spaced = " ".join(re.split(r"[\s,;]+", written.strip("[]() ")))
    if (found := [*_numbers_in(spaced)]) and len(found) == count and all(map(math.isfinite, found)):
        return f"numbers have spaces between them: write '{name}=\"{plain(spaced, _SHOWN)}\"'"
    is_measured = re.fullmatch(r"[-+.\deE]+\s*[a-zA-Z%]+", written) is not None
    return "values in a URDF have no unit: they are in metres, radians and kilograms" if is_measured else ""


def _numbers_in(written: str) -> Iterator[float]:
    for word in written.split():
        try:
            yield float(word)
        except ValueError:
            yield math.nan


def _called(element: XmlElement) -> str:
    name = element.attributes.get("name")
    return f" '{plain(name, _SHOWN)}'" if name else ""
