"""Rules for a body that is one tree: what simulators, planners and controllers would trip over. Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping
from types import MappingProxyType

from rbxcompose.body.masses import mass_mistakes
from rbxcompose.body.model import Body, BodyJoint, BodyLink, JointLimits, Shape
from rbxcompose.body.urdf import rpy_of
from rbxcompose.body.xml_reader import XmlElement
from rbxcompose.findings import DID_YOU_MEAN, Finding, Severity, kind
from rbxcompose.printable import plain

NO_MOTION = kind("RBX2011", Severity.WARNING)
NO_MESH = kind("RBX2012")
MILLIMETRES = kind("RBX2013", Severity.WARNING)
DEGREES = kind("RBX2021", Severity.WARNING)
TURNED_IN_DEGREES = kind("RBX2023", Severity.WARNING)
LARGEST = 20.0  # [m]
_WRITE = "write what the motor can do"
_UNWRITTEN = "a limit that is not written is 0; joints without limits are 'continuous', those that never move 'fixed'"
_LACKS_UNIT = "are these millimetres, or does a size lack its unit?"
_SHOWN = 60
_TURN = math.tau + 0.01  # [rad]
_WITH_ORIGINS = ("link", "joint", "visual", "collision", "inertial")


def lint(body: Body, meshes: Collection[str], meant: Mapping[str, str] = MappingProxyType({})) -> Iterator[Finding]:
    """Yield what is wrong with a body; `meshes` are the names of the mesh files that exist.

    `meant` has names of files that exist, for those that differ only in their capitals.
    """
    yield from mass_mistakes(body)
    for link in body.links.values():
        yield from _shapes(link, meshes, meant)
    for joint in body.joints.values():
        if (away := math.hypot(*joint.origin.translation)) > LARGEST:
            message = f"joint '{plain(joint.name, _SHOWN)}' is {away:g} m away from the link that carries it"
            yield MILLIMETRES.at(joint.span, message, help=_LACKS_UNIT)
        if joint.limits is not None and joint.moves:
            yield from _limits(joint, joint.limits)


def orientations(root: XmlElement) -> Iterator[Finding]:
    """Yield the orientations in a URDF that are more than a turn."""
    for child in root.children:
        if child.name == "origin" and any(abs(one) > _TURN for one in rpy_of(child)):
            right = " ".join(f"{math.radians(one):.4g}" for one in rpy_of(child))
            message = f"'rpy=\"{plain(child.attributes['rpy'], _SHOWN)}\"' is more than a turn: are these degrees?"
            help_text = f"angles in a URDF are in radians: for degrees, write 'rpy=\"{right}\"'"
            yield TURNED_IN_DEGREES.at(child.span, message, help=help_text)
        elif child.name in _WITH_ORIGINS:
            yield from orientations(child)


def _limits(joint: BodyJoint, limits: JointLimits) -> Iterator[Finding]:
    name = plain(joint.name, _SHOWN)
    if missing := [one for one in ("effort", "velocity") if getattr(limits, one) is None]:
        message = f"the limits of joint '{name}' lack the {' and the '.join(missing)}"
        yield NO_MOTION.at(limits.span, message, help="write what the motor can do; ROS refuses a URDF without it")
    elif stuck := list(_stuck(joint, limits)):
        message = f"the {' and the '.join(stuck)} of joint '{name}' {_be(stuck)} zero"
        yield NO_MOTION.at(limits.span, message, help=_UNWRITTEN if stuck == ["range"] else _WRITE)
    elif joint.kind == "revolute" and limits.may_be_degrees:
        lower, upper = (math.radians(one or 0.0) for one in (limits.lower, limits.upper))
        message = (
            f"joint '{name}' may turn from {limits.lower or 0:g} rad to {limits.upper or 0:g} rad: are these degrees?"
        )
        help_text = f'limits in a URDF are in radians: for degrees, write \'lower="{lower:.4g}" upper="{upper:.4g}"\''
        yield DEGREES.at(limits.span, message, help=help_text)


def _stuck(joint: BodyJoint, limits: JointLimits) -> Iterator[str]:
    """Yield the limits that are zero. An effort of zero alone makes a passive joint, such as that of a caster."""
    if joint.kind != "continuous" and (limits.lower or 0.0) == (limits.upper or 0.0):
        yield "range"
    if limits.velocity == 0.0 and joint.mimic is None:  # a follower is as fast as its leader
        yield "velocity"
        if limits.effort == 0.0:
            yield "effort"


def _be(words: list[str]) -> str:
    return "is" if len(words) == 1 else "are"


def _shapes(link: BodyLink, meshes: Collection[str], meant: Mapping[str, str]) -> Iterator[Finding]:
    for shape in (*link.visuals, *link.collisions):
        geometry = shape.geometry
        if geometry.kind == "mesh" and geometry.file not in meshes:
            message = f"the mesh '{plain(geometry.file)}' does not exist"
            near = meant.get(geometry.file, "")
            help_text = f"{DID_YOU_MEAN} '{near}'? Capitals count" if near else _where_meshes_are(geometry.file)
            yield NO_MESH.at(shape.size_span or shape.span, message, help=help_text)
        if largest := _extent(shape):
            message = f"a {geometry.kind} of link '{plain(link.name, _SHOWN)}' is {largest:g} m long"
            yield MILLIMETRES.at(shape.size_span or shape.span, message, help=_LACKS_UNIT)


def _where_meshes_are(file: str) -> str:
    """Return how to name the file of a mesh."""
    package = re.match(r"package://([^/]+)/", file)
    beside = "write a path from the folder of this file"
    if package is None:
        return f"{beside}, or 'package://NAME/...' with NAME below 'packages' of the 'body'"
    name = plain(package[1], _SHOWN)
    return f"give the folder of '{name}' below 'packages' of the 'body', '{name}: FOLDER', or {beside}"


def _extent(shape: Shape) -> float:
    """Return the largest extent or distance of a shape if it is absurd, else 0."""
    size = 0.0 if shape.geometry.kind == "mesh" else max(shape.geometry.size)
    largest = max(size, math.hypot(*shape.origin.translation))
    return largest if largest > LARGEST else 0.0
