"""Rules for the masses of a body; what fixed joints hold together is one rigid body, as in physics engines. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from rbxcompose.body.inertia import Tensor, about, added, principal_moments
from rbxcompose.body.model import Body, BodyLink, Geometry, Inertial
from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.printable import plain

NO_MASS = kind("RBX2009", Severity.WARNING)
NO_INERTIA = kind("RBX2010", Severity.WARNING)
TOO_DENSE = kind("RBX2022", Severity.WARNING)
_DENSEST = 100_000.0  # [kg/m^3]: four times osmium, since shapes may leave something out
_TOLERANCE = 1e-6  # relative, of moments that were rounded when they were written
_THIN = 1e-6  # [m]: a mass that is nearer than this to an axis has no moment about it
_SHOWN = 60


def mass_mistakes(body: Body) -> Iterator[Finding]:
    """Yield links that lack a mass, and masses and inertias that nothing has."""
    for link in body.links.values():
        if link.inertial is not None and (problem := _impossible(link.inertial)):
            one, is_mass = link.inertial, link.inertial.mass < 0.0
            span = (one.mass_span if is_mass else one.inertia_span) or one.span
            help_text = "a mass is above 0 kg" if is_mass else ""
            yield NO_INERTIA.at(span, f"link '{plain(link.name, _SHOWN)}' {problem}", help=help_text)
        elif link.inertial is not None and (volume := _volume(link)) and link.inertial.mass > _DENSEST * volume:
            one = link.inertial
            size = f"{1000.0 * volume:.2g} litres"
            message = f"link '{plain(link.name, _SHOWN)}' has a mass of {one.mass:g} kg in {size}"
            yield TOO_DENSE.at(one.mass_span or one.span, message, help="masses in a URDF are in kilograms")
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
    if any(_impossible(one) for one in parts) or not all(_is_thin(one.mass, _tensor(one)) for one in parts):
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
    rest = [one for one in moments if one != name]
    sum_of_rest = sum(moments[one] for one in rest)
    if moments[name] > sum_of_rest:
        together = f"{' + '.join(rest)} = {sum_of_rest:.4g}"
        return f"has a moment of inertia larger than the two others together: {name} = {moments[name]:.4g}, {together}"
    return f"has a moment of inertia larger than the two others together, about its own axes: {most:.4g}, {others:.4g}"


def _volume(link: BodyLink) -> float:
    """Return the volume of the shapes of a link [m^3], those that are seen or those that collide; 0 with meshes."""
    shapes = [[one.geometry for one in own] for own in (link.visuals, link.collisions)]
    return (
        0.0
        if any(one.kind == "mesh" for own in shapes for one in own)
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
    places = [(poses[name].compose(one.origin), one) for name, one in parts]
    mass = sum(one.mass for _, one in places)
    x, y, z = (sum(one.mass * at.translation[axis] for at, one in places) / mass for axis in range(3))
    return mass, added([about((x, y, z), at, one.mass, _tensor(one)) for at, one in places])
