"""Rules for a body that is one tree: what simulators, planners and controllers would trip over. Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator

from rbxcompose.body.masses import mass_mistakes
from rbxcompose.body.model import Body, BodyJoint, BodyLink, JointLimits, Shape
from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.printable import plain

NO_MOTION = kind(
    "RBX2011",
    """The limits of a joint let it do nothing

Its range has no length, or its greatest speed is zero. Some programs never move such a joint, others take a speed of
zero for no limit.

Bad:
```xml
<link name="base"/>
<link name="head"/>
<joint name="pan" type="revolute">
  <parent link="base"/>
  <child link="head"/>
  <limit lower="-1" upper="1" effort="1" velocity="0"/>
</joint>
```
Good:
```xml
<link name="base"/>
<link name="head"/>
<joint name="pan" type="revolute">
  <parent link="base"/>
  <child link="head"/>
  <limit lower="-1" upper="1" effort="1" velocity="1.5"/>
</joint>
```
""",
    Severity.WARNING,
)
NO_MESH = kind(
    "RBX2012",
    """The file of a mesh does not exist

A mesh is a file beside the URDF, or `package://NAME/...` with the folder of NAME under `packages:` of the `body`.

Bad:
```xml
<link name="base">
  <visual><geometry><mesh filename="package://cart/meshes/base.stl"/></geometry></visual>
</link>
```
Good:
```xml
<link name="base">
  <visual><geometry><box size="0.3 0.3 0.1"/></geometry></visual>
</link>
```
""",
)
MILLIMETRES = kind(
    "RBX2013",
    """A part of the body is larger than a house

URDF counts in metres. A size of hundreds often comes from a drawing in millimetres.

Bad:
```xml
<link name="base">
  <visual><geometry><box size="300 300 120"/></geometry></visual>
</link>
```
Good:
```xml
<link name="base">
  <visual><geometry><box size="0.3 0.3 0.12"/></geometry></visual>
</link>
```
""",
    Severity.WARNING,
)
LARGEST = 20.0  # [m]
_WRITE = "write what the motor can do"
_UNWRITTEN = "a limit that is not written is 0; joints without limits are 'continuous', those that never move 'fixed'"
_SHOWN = 60


def lint(body: Body, meshes: Collection[str]) -> Iterator[Finding]:
    """Yield what is wrong with a body; `meshes` are the names of the mesh files that exist."""
    yield from mass_mistakes(body)
    for link in body.links.values():
        yield from _shapes(link, meshes)
    for joint in body.joints.values():
        if joint.limits is not None and joint.moves:
            yield from _limits(joint, joint.limits)


def _limits(joint: BodyJoint, limits: JointLimits) -> Iterator[Finding]:
    name = plain(joint.name, _SHOWN)
    if missing := [one for one in ("effort", "velocity") if getattr(limits, one) is None]:
        message = f"the limits of joint '{name}' lack the {' and the '.join(missing)}"
        yield NO_MOTION.at(limits.span, message, help="write what the motor can do; ROS refuses a URDF without it")
    elif stuck := list(_stuck(joint, limits)):
        message = f"the {' and the '.join(stuck)} of joint '{name}' {_be(stuck)} zero"
        yield NO_MOTION.at(limits.span, message, help=_UNWRITTEN if stuck == ["range"] else _WRITE)


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


def _shapes(link: BodyLink, meshes: Collection[str]) -> Iterator[Finding]:
    for shape in (*link.visuals, *link.collisions):
        geometry = shape.geometry
        if geometry.kind == "mesh" and geometry.file not in meshes:
            message = f"the mesh '{plain(geometry.file)}' does not exist"
            yield NO_MESH.at(shape.span, message, help=_where_meshes_are(geometry.file))
        if largest := _extent(shape):
            message = f"a {geometry.kind} of link '{plain(link.name, _SHOWN)}' is {largest:g} m long"
            yield MILLIMETRES.at(shape.span, message, help="are these millimetres, or does a size lack its unit?")


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
