"""Rules for a body that is one tree: what simulators, planners and controllers would trip over. Pure."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

import numpy as np

from rbxcompose.body.model import Body, BodyLink, Inertial, Shape
from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.printable import plain

NO_MASS = kind(
    "RBX2009",
    """A link that moves has no mass

Physics engines cannot move a link without mass, and the dynamics of an arm would be wrong. Links without shapes are
frames and need none.

Bad:
```xml
<link name="base"/>
<link name="wheel">
  <visual><geometry><sphere radius="0.05"/></geometry></visual>
</link>
<joint name="turn" type="continuous">
  <parent link="base"/>
  <child link="wheel"/>
</joint>
```
Good:
```xml
<link name="base"/>
<link name="wheel">
  <visual><geometry><sphere radius="0.05"/></geometry></visual>
  <inertial>
    <mass value="0.1"/>
    <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/>
  </inertial>
</link>
<joint name="turn" type="continuous">
  <parent link="base"/>
  <child link="wheel"/>
</joint>
```
""",
    Severity.WARNING,
)
NO_INERTIA = kind(
    "RBX2010",
    """No rigid body has this inertia

A mass is positive. The principal moments of inertia are positive, and none is larger than the sum of the two others.

Bad:
```xml
<link name="base">
  <inertial>
    <mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
  </inertial>
</link>
```
Good:
```xml
<link name="base">
  <inertial>
    <mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
  </inertial>
</link>
```
""",
    Severity.WARNING,
)
NO_MOTION = kind(
    "RBX2011",
    """The limits of a joint let it do nothing

Its range has no length, or its greatest speed or effort is zero. Planners and controllers would never move it.

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
_TOLERANCE = 1e-6  # relative, of moments that were rounded when they were written
_SHOWN = 60


def lint(body: Body, meshes: Collection[str]) -> Iterator[Finding]:
    """Yield what is wrong with a body; `meshes` are the names of the mesh files that exist."""
    moved = _moved(body)
    for link in body.links.values():
        if link.name in moved and link.inertial is None and (link.visuals or link.collisions):
            yield NO_MASS.at(link.span, f"link '{plain(link.name, _SHOWN)}' moves and has no mass")
        if link.inertial is not None and (problem := _impossible(link.inertial)):
            yield NO_INERTIA.at(link.inertial.span, f"link '{plain(link.name, _SHOWN)}' {problem}")
        yield from _shapes(link, meshes)
    for joint in body.joints.values():
        if joint.limits is None or not joint.moves:
            continue
        limits, stuck = joint.limits, [name for name in ("effort", "velocity") if getattr(joint.limits, name) == 0.0]
        if joint.kind != "continuous" and limits.lower == limits.upper:
            stuck.insert(0, "range")
        if stuck:
            message = f"the {' and the '.join(stuck)} of joint '{plain(joint.name, _SHOWN)}' {_be(stuck)} zero"
            yield NO_MOTION.at(limits.span, message, help="write what the motor can do")


def _be(words: list[str]) -> str:
    return "is" if len(words) == 1 else "are"


def _moved(body: Body) -> set[str]:
    """Return the links below any joint that moves."""
    found: set[str] = set()
    for name, _ in body.walk():
        for joint in body.joints_below[name]:
            if joint.moves or name in found:
                found.add(joint.child)
    return found


def _impossible(inertial: Inertial) -> str:
    """Return why no rigid body has this mass and inertia, or nothing."""
    if inertial.mass <= 0.0:
        return f"has the mass {inertial.mass:g} kg"
    ixx, ixy, ixz, iyy, iyz, izz = inertial.inertia
    least, middle, most = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    if least <= 0.0:
        return "has a moment of inertia that is not positive"
    if most > (least + middle) * (1 + _TOLERANCE):
        return "has a moment of inertia larger than the two others together"
    return ""


def _shapes(link: BodyLink, meshes: Collection[str]) -> Iterator[Finding]:
    for shape in (*link.visuals, *link.collisions):
        geometry = shape.geometry
        if geometry.kind == "mesh" and geometry.file not in meshes:
            yield NO_MESH.at(shape.span, f"the mesh '{plain(geometry.file)}' does not exist")
        if largest := _extent(shape):
            message = f"a {geometry.kind} of link '{plain(link.name, _SHOWN)}' is {largest:g} m long"
            yield MILLIMETRES.at(shape.span, message, help="are these millimetres?")


def _extent(shape: Shape) -> float:
    """Return the largest extent or distance of a shape if it is absurd, else 0."""
    size = 0.0 if shape.geometry.kind == "mesh" else max(shape.geometry.size)
    largest = max(size, math.hypot(*shape.origin.translation))
    return largest if largest > LARGEST else 0.0
