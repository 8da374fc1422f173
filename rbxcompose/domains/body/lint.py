"""Rules for a body that is one tree: what simulators, planners and controllers would trip over."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from types import MappingProxyType

from rbxcompose.base.findings import Finding, Related, Severity, kind
from rbxcompose.base.geometry import Transform3, Vector3, rotate
from rbxcompose.base.printable import plain
from rbxcompose.domains.body.files import MeshFault, mesh_places, named_also
from rbxcompose.domains.body.model import FLOATING, Body, BodyJoint, BodyLink, Geometry, Inertial, JointLimits, Shape
from rbxcompose.domains.body.urdf import rpy_of
from rbxcompose.domains.body.xml_reader import XmlElement

Tensor = tuple[Vector3, Vector3, Vector3]
"""A symmetric matrix [kg m^2], row by row."""
_SWEEPS = 12  # half of them suffice: each squares what is left beside the diagonal
_PLANES = ((0, 1, 2), (0, 2, 1), (1, 2, 0))  # two axes, and the one that they turn about
NO_MASS = kind("RBX2009", Severity.WARNING)
NO_INERTIA = kind("RBX2010", Severity.WARNING)
TOO_DENSE = kind("RBX2022", Severity.WARNING)
_DENSEST = 100_000.0  # [kg/m^3]: four times osmium, since shapes may leave something out
_TOLERANCE = 1e-6  # relative, of moments that were rounded when they were written
_THIN = 1e-6  # [m]: a mass that is nearer than this to an axis has no moment about it
_SHOWN = 60
NO_MOTION = kind("RBX2011", Severity.WARNING)
NO_MESH = kind("RBX2012")
MILLIMETRES = kind("RBX2013", Severity.WARNING)
DEGREES = kind("RBX2021", Severity.WARNING)
AT_REST = kind("RBX2024", Severity.WARNING)
ENDLESS = kind("RBX2025", Severity.WARNING)
TURNED_IN_DEGREES = kind("RBX2023", Severity.WARNING)
LARGEST = 20.0  # [m]
_WRITE = "write what the motor can do"
_UNWRITTEN = "a limit that is not written is 0; joints without limits are 'continuous', those that never move 'fixed'"
_LACKS_UNIT = "are these millimetres, or does a size lack its unit?"
_SHORT_OF_A_TURN = 0.01  # [rad]: programs write a whole turn where no limits are meant
TURN = math.tau + 0.01  # [rad] beyond which an angle may be one in degrees
_WITH_ORIGINS = ("link", "joint", "visual", "collision", "inertial")


def principal_moments(tensor: Tensor) -> tuple[float, float, float]:
    """Return the moments about the principal axes, the smallest first: the eigenvalues, by Jacobi's rotations.

    As those of a library, they are exact but for the rounding of the largest one.
    """
    rows = [list(row) for row in tensor]
    for _ in range(_SWEEPS):
        for first, second, other in _PLANES:
            if rows[first][second]:
                _turn(rows, first, second, other)
    least, middle, most = sorted(rows[axis][axis] for axis in range(3))
    return least, middle, most


def _turn(rows: list[list[float]], first: int, second: int, other: int) -> None:
    """Turn two axes about the third so that nothing remains beside the diagonal between them."""
    beside = rows[first][second]
    half = (rows[second][second] - rows[first][first]) / (2.0 * beside)
    tangent = math.copysign(1.0, half) / (abs(half) + math.hypot(half, 1.0))
    cosine = 1.0 / math.hypot(tangent, 1.0)
    sine = tangent * cosine
    rows[first][first] -= tangent * beside
    rows[second][second] += tangent * beside
    rows[first][second] = rows[second][first] = 0.0
    value, two = rows[first][other], rows[second][other]
    rows[first][other] = rows[other][first] = cosine * value - sine * two
    rows[second][other] = rows[other][second] = sine * value + cosine * two


def about(point: Vector3, at: Transform3, mass: float, own: Tensor) -> Tensor:
    """Return the inertia about a point [m], by the parallel axis theorem; `own` is that about the centre of mass."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = _turned(own, at)
    x, y, z = (place - origin for place, origin in zip(at.translation, point, strict=True))
    xy, xz, yz = xy - mass * x * y, xz - mass * x * z, yz - mass * y * z
    xx, yy, zz = xx + mass * (y * y + z * z), yy + mass * (x * x + z * z), zz + mass * (x * x + y * y)
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def _turned(tensor: Tensor, at: Transform3) -> Tensor:
    """Return a tensor along the axes of the frame in which its own frame is turned as `at` says."""
    a, b, c = (rotate(at.rotation, row) for row in tensor)
    first, second, third = (rotate(at.rotation, row) for row in zip(a, b, c, strict=True))
    return first, second, third


def added(tensors: list[Tensor]) -> Tensor:
    """Return the inertia of several bodies together, of tensors about one point."""
    first, second, third = (_sum([tensor[row] for tensor in tensors]) for row in range(3))
    return first, second, third


def _sum(rows: list[Vector3]) -> Vector3:
    x, y, z = map(sum, zip(*rows, strict=True))
    return x, y, z


def mass_mistakes(body: Body) -> Iterator[Finding]:
    """Yield links that lack a mass, and masses and inertias that nothing has."""
    for link in body.links.values():
        if link.inertial is not None and (problem := _impossible(link.inertial)):
            inertial, is_mass = link.inertial, link.inertial.mass < 0.0
            span = (inertial.mass_span if is_mass else inertial.inertia_span) or inertial.span
            help_text = "a mass is above 0 kg" if is_mass else ""
            yield NO_INERTIA.at(span, f"link '{plain(link.name, _SHOWN)}' {problem}", help=help_text)
        elif link.inertial is not None and (volume := _volume(link)) and link.inertial.mass > _DENSEST * volume:
            inertial = link.inertial
            size = f"{1000.0 * volume:.2g} litres"
            message = f"link '{plain(link.name, _SHOWN)}' has a mass of {inertial.mass:g} kg in {size}"
            yield TOO_DENSE.at(inertial.mass_span or inertial.span, message, help="masses in a URDF are in kilograms")
    for links in _rigid_bodies(body):
        yield from _mistakes_of_one(body, links)


def _rigid_bodies(body: Body) -> list[list[BodyLink]]:
    """Return the links that fixed joints hold together; the first link of each carries the others."""
    found: dict[str, list[BodyLink]] = {}
    for name, _ in body.walk():
        joint = body.joint_above.get(name)
        found[name] = found[joint.parent] if joint is not None and joint.kind == "fixed" else []
        found[name].append(body.links[name])
    return [links for name, links in found.items() if links[0].name == name]


def _mistakes_of_one(body: Body, links: Sequence[BodyLink]) -> Iterator[Finding]:
    first = links[0]
    heavy = [link for link in links if link.inertial is not None and link.inertial.mass > 0.0]
    is_light = not any(link.inertial is not None and link.inertial.mass != 0.0 for link in links)
    if is_light and first.name in body.joint_above and any(link.visuals or link.collisions for link in links):
        yield NO_MASS.at(first.span, f"link '{plain(first.name, _SHOWN)}' moves and has no mass")
    parts = [link.inertial for link in heavy if link.inertial is not None]
    if any(_impossible(inertial) for inertial in parts) or not all(
        _is_thin(inertial.mass, _tensor(inertial)) for inertial in parts
    ):
        return
    if heavy and _is_thin(*_together(body, heavy)):
        others = " and what is fixed to it have" if len(links) > 1 else " has"
        message = f"link '{plain(heavy[0].name, _SHOWN)}'{others} a mass and no moment of inertia about an axis"
        yield NO_INERTIA.at(parts[0].span, message)


def _impossible(inertial: Inertial) -> str:
    """Return why no rigid body has this mass and inertia, or nothing. Zeros alone are those of a frame."""
    if inertial.mass < 0.0:
        return f"has the mass {inertial.mass:g} kg"
    if inertial.mass == 0.0:
        return "has a moment of inertia and no mass" if any(inertial.inertia) else ""
    least, middle, most = principal_moments(_tensor(inertial))
    slack = inertial.mass * _THIN**2 + most * _TOLERANCE
    if least < -slack:
        return "has a negative moment of inertia"
    if most > least + middle + slack:
        return _too_large(inertial, most, least + middle)
    return ""


def _too_large(inertial: Inertial, most: float, others: float) -> str:
    """Return which moment is larger than the two others together: by its name if the inertia has that one."""
    ixx, _, _, iyy, _, izz = inertial.inertia
    moments = {"ixx": ixx, "iyy": iyy, "izz": izz}
    name = max(moments, key=lambda one: moments[one])
    rest = [other for other in moments if other != name]
    sum_of_rest = sum(moments[moment] for moment in rest)
    if moments[name] > sum_of_rest:
        together = f"{' + '.join(rest)} = {sum_of_rest:.4g}"
        return f"has a moment of inertia larger than the two others together: {name} = {moments[name]:.4g}, {together}"
    return f"has a moment of inertia larger than the two others together, about its own axes: {most:.4g}, {others:.4g}"


def _volume(link: BodyLink) -> float:
    """Return the volume of the shapes of a link [m^3], those that are seen or those that collide; 0 with meshes."""
    shapes = [[shape.geometry for shape in own] for own in (link.visuals, link.collisions)]
    return (
        0.0
        if any(geometry.kind == "mesh" for own in shapes for geometry in own)
        else max(sum(map(_of_shape, own)) for own in shapes)
    )


def _of_shape(geometry: Geometry) -> float:
    match geometry.kind, geometry.size:
        case "box", (x, y, z):
            return x * y * z
        case "sphere", (radius,):
            return math.pi * radius**3 * 4.0 / 3.0
        case "cylinder" | "capsule", (radius, length):
            return math.pi * radius**2 * (length + (radius * 4.0 / 3.0 if geometry.kind == "capsule" else 0.0))
    return 0.0


def _tensor(inertial: Inertial) -> Tensor:
    ixx, ixy, ixz, iyy, iyz, izz = inertial.inertia
    return (ixx, ixy, ixz), (ixy, iyy, iyz), (ixz, iyz, izz)


def _is_thin(mass: float, tensor: Tensor) -> bool:
    return principal_moments(tensor)[0] <= mass * _THIN**2


def _together(body: Body, links: Sequence[BodyLink]) -> tuple[float, Tensor]:
    """Return the mass of links that are fixed to each other, and their inertia about the centre of mass."""
    poses, parts = body.poses({}), [(link.name, link.inertial) for link in links if link.inertial is not None]
    places = [(poses[name].compose(inertial.origin), inertial) for name, inertial in parts]
    mass = sum(inertial.mass for _, inertial in places)
    x, y, z = (sum(inertial.mass * at.translation[axis] for at, inertial in places) / mass for axis in range(3))
    return mass, added([about((x, y, z), at, inertial.mass, _tensor(inertial)) for at, inertial in places])


def lint(
    body: Body, meshes: Collection[str], faults: Mapping[str, MeshFault] = MappingProxyType({})
) -> Iterator[Finding]:
    """Yield what is wrong with a body; `meshes` are the names of the mesh files that it may use.

    `faults` has what is known of others; of those without any, that they do not exist.
    """
    yield from mass_mistakes(body)
    for name, (first, *others) in mesh_places(body).items():
        if name not in meshes:
            words, help_text = faults.get(name) or ("does not exist", _where_meshes_are(name))
            yield NO_MESH.at(first, f"the mesh '{plain(name)}' {words}", help=help_text, related=named_also(others))
    for link in body.links.values():
        yield from _shapes(link)
    for joint in body.joints.values():
        if (away := math.hypot(*joint.origin.translation)) > LARGEST:
            message = f"joint '{plain(joint.name, _SHOWN)}' is {away:g} m away from the link that carries it"
            yield MILLIMETRES.at(joint.span, message, help=_LACKS_UNIT)
        if joint.kind in FLOATING:
            message = f"joint '{plain(joint.name, _SHOWN)}' is {joint.kind}, and is taken to be at rest"
            yield AT_REST.at(joint.span, message, help="write 'fixed'; if it places the robot, leave it out")
        if joint.limits is not None and joint.moves:
            yield from _limits(joint, joint.limits)
            yield from _leading(joint, body)


def orientations(root: XmlElement) -> Iterator[Finding]:
    """Yield the orientations in a URDF that are more than a turn."""
    for child in root.children:
        if child.name == "origin" and any(abs(value) > TURN for value in rpy_of(child)):
            right = " ".join(f"{math.radians(value):.4g}" for value in rpy_of(child))
            message = f"'rpy=\"{plain(child.attributes['rpy'], _SHOWN)}\"' is more than a turn: are these degrees?"
            help_text = f"angles in a URDF are in radians: for degrees, write 'rpy=\"{right}\"'"
            yield TURNED_IN_DEGREES.at(child.span, message, help=help_text)
        elif child.name in _WITH_ORIGINS:
            yield from orientations(child)


def _limits(joint: BodyJoint, limits: JointLimits) -> Iterator[Finding]:
    name = plain(joint.name, _SHOWN)
    lower, upper = limits.lower or 0.0, limits.upper or 0.0
    if joint.kind == "continuous" and 0.0 < upper - lower < math.tau - _SHORT_OF_A_TURN:
        message = f"'lower' and 'upper' of joint '{name}' do not count: it is 'continuous', and turns on and on"
        help_text = "make it 'revolute'; if it may turn on and on, leave out 'lower' and 'upper'"
        yield ENDLESS.at(limits.span, message, help=help_text)
    if missing := [text for text in ("effort", "velocity") if getattr(limits, text) is None]:
        message = f"the limits of joint '{name}' lack the {' and the '.join(missing)}"
        yield NO_MOTION.at(limits.span, message, help="write what the motor can do; ROS refuses a URDF without it")
    elif stuck := list(_stuck(joint, limits)):
        message = f"the {' and the '.join(stuck)} of joint '{name}' {('is' if len(stuck) == 1 else 'are')} zero"
        yield NO_MOTION.at(limits.span, message, help=_UNWRITTEN if stuck == ["range"] else _WRITE)
    elif joint.kind == "revolute" and limits.may_be_degrees:
        lower, upper = (math.radians(value or 0.0) for value in (limits.lower, limits.upper))
        message = (
            f"joint '{name}' may turn from {limits.lower or 0:g} rad to {limits.upper or 0:g} rad: are these degrees?"
        )
        help_text = f'limits in a URDF are in radians: for degrees, write \'lower="{lower:.4g}" upper="{upper:.4g}"\''
        yield DEGREES.at(limits.span, message, help=help_text)


def _leading(joint: BodyJoint, body: Body) -> Iterator[Finding]:
    """Yield that a joint and the one that it mimics are never both within their limits."""
    leader = body.joints[joint.mimic.joint] if joint.mimic is not None else None
    if leader is None or leader.limits is None or joint.limits is None or leader.kind == "continuous":
        return
    (least, greatest), own = joint.led_within, leader.limits.range
    if max(least, own[0]) >= min(greatest, own[1]) and least < greatest and own[0] < own[1]:
        names = f"'{plain(joint.name, _SHOWN)}' leave nothing of those of '{plain(leader.name, _SHOWN)}'"
        help_text = "'multiplier' and 'offset' of '<mimic>' tell where it is"
        related = [Related(leader.limits.span, "the limits of the joint that it mimics")]
        yield NO_MOTION.at(joint.limits.span, f"the limits of joint {names}", help=help_text, related=related)


def _stuck(joint: BodyJoint, limits: JointLimits) -> Iterator[str]:
    """Yield the limits that are zero. An effort of zero alone makes a passive joint, such as that of a caster."""
    if joint.kind != "continuous" and (limits.lower or 0.0) == (limits.upper or 0.0):
        yield "range"
    if limits.velocity == 0.0 and joint.mimic is None:  # a follower is as fast as its leader
        yield "velocity"
        if limits.effort == 0.0:
            yield "effort"


def _shapes(link: BodyLink) -> Iterator[Finding]:
    for shape in (*link.visuals, *link.collisions):
        if largest := _extent(shape):
            message = f"a {shape.geometry.kind} of link '{plain(link.name, _SHOWN)}' is {largest:g} m long"
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
