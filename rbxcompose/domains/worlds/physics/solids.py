"""The shapes of links as a physics engine takes them: solids of some thickness, meshes as their convex hulls."""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence
from itertools import product
from pathlib import Path

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Quaternion, Transform3, Vector3
from rbxcompose.domains.body.meshes import MissingLibraryError, read_mesh
from rbxcompose.domains.body.model import BodyLink, Geometry, Shape

THIN = 1e-4  # a side below this is raised to it [m]
FLAT = 1e-3  # a mesh below this has no hull, but is a box of this thickness [m]
FACINGS = 1024  # directions in which corners of a mesh are looked for
RIM = 32  # points on the rim of what is round


@dataclass(frozen=True, slots=True)
class BodyRepair:
    """What was changed in a body, or made up, so that it can be simulated."""

    link: str
    """A link, or a joint."""
    what: str
    """What was wrong and what counts instead, in words."""


BodyRepairs = MutableSequence[BodyRepair]


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalShape:
    """A solid at a place of its link."""

    kind: str
    """`box`, `cylinder`, `capsule`, `sphere`, or `hull`: the convex hull of its points."""
    size: tuple[float, ...]
    """Sides; or radius, and length without caps; none for a hull [m]."""
    origin: Transform3
    """Its frame in that of the link."""
    points: Array
    """(n, 3): its outermost points in its own frame [m]."""

    @property
    def placed(self) -> Array:
        """Return its outermost points in the frame of the link (n, 3) [m]."""
        return apply(self.origin, self.points)


def rotation_matrix(rotation: Quaternion) -> Array:
    """Return the matrix (3, 3) of a unit quaternion."""
    x, y, z, w = rotation
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


def apply(pose: Transform3, points: Array) -> Array:
    """Return points (n, 3) of the inner frame of a pose in its outer frame."""
    return np.asarray(points @ rotation_matrix(pose.rotation).T + pose.translation)


def shapes_of(link: BodyLink, shapes: tuple[Shape, ...], meshes: Mapping[str, Path], repairs: BodyRepairs) -> list[
    PhysicalShape
]:  # fmt: skip
    """Return shapes of a link as solids; what is left out or changed is added to the repairs."""
    found = []
    for shape in shapes:
        geometry = shape.geometry
        if geometry.kind == "mesh":
            solid = _hull(link.name, shape, meshes, repairs)
        else:
            least = THIN if geometry.kind == "box" else THIN / 2
            if thin := min(geometry.size, default=0.0) < least:
                repairs.append(BodyRepair(link.name, f"its {geometry.kind} has no thickness: it is made 0.1 mm thick"))
            size = tuple(max(length, least) for length in geometry.size) if thin else geometry.size
            solid = PhysicalShape(geometry.kind, size, shape.origin, outermost(geometry.kind, size))
        if solid is not None:
            found.append(solid)
    return found


def outermost(kind: str, size: tuple[float, ...]) -> Array:
    """Return the outermost points of a solid in its frame (n, 3) [m]; of what is round, some of them."""
    if kind == "box":
        return np.array(list(product(*((-side / 2, side / 2) for side in size))))
    radius, end = size[0], np.array((0.0, 0.0, size[1] / 2 if len(size) > 1 else 0.0))
    turn = np.arange(RIM) * (math.tau / RIM)
    rim = np.stack((np.cos(turn), np.sin(turn), np.zeros(RIM)), -1) * radius
    if kind == "cylinder":
        return np.concatenate((np.add(rim, end), np.subtract(rim, end)))
    up = np.array((0.0, 0.0, radius))
    tilts = (0.0, math.pi / 6, math.pi / 3, math.pi / 2)
    cap = np.concatenate([np.add(rim * math.sin(tilt), up * math.cos(tilt)) for tilt in tilts])
    return np.concatenate((np.add(cap, end), np.subtract(cap * (1.0, 1.0, -1.0), end)))


def _hull(link: str, shape: Shape, meshes: Mapping[str, Path], repairs: BodyRepairs) -> PhysicalShape | None:
    """Return the hull of a mesh; that of one without thickness is a box, and one that cannot be read is none."""
    geometry = shape.geometry
    try:
        points = _vertices(geometry, meshes)
    except (MissingLibraryError, ValueError, KeyError) as error:
        why = f"'{geometry.file}' is not there" if isinstance(error, KeyError) else str(error)
        repairs.append(BodyRepair(link, f"a mesh is left out, so nothing touches it: {why}"))
        return None
    points = extreme(points)
    name = f"the mesh '{Path(geometry.file).name}'" if geometry.file else "a mesh"
    middle = points.mean(0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    if len(axes) < 3:
        repairs.append(BodyRepair(link, f"{name} has fewer than three corners: it is left out"))
        return None
    axes[2] *= np.sign(np.linalg.det(axes))
    along = (points - middle) @ axes.T
    low, high = along.min(0), along.max(0)
    if (high - low).min() >= FLAT:
        repairs.append(BodyRepair(link, f"{name} collides as its convex hull"))
        return PhysicalShape("hull", (), shape.origin, points)
    repairs.append(BodyRepair(link, f"{name} is flat: it collides as a box around it, at least 1 mm thick"))
    x, y, z = (middle + (low + high) / 2 @ axes).tolist()
    size = tuple(np.maximum(high - low, FLAT).tolist())
    origin = shape.origin.compose(Transform3((x, y, z), quaternion_of(axes.T)))
    return PhysicalShape("box", size, origin, outermost("box", size))


def extreme(points: Array) -> Array:
    """Return points (n, 3) without those that are the farthest in none of `FACINGS` evenly spread directions.

    The directions are a Fibonacci lattice. What is lost of a hull is within (1 - cos 3 deg) of its radius.
    """
    if len(points) <= FACINGS:
        return points
    number = np.arange(FACINGS) + 0.5
    up, turn = 1 - 2 * number / FACINGS, number * (math.pi * (1 + math.sqrt(5)))
    flat = np.sqrt(1 - up**2)
    facings = np.stack((flat * np.cos(turn), flat * np.sin(turn), up))
    blocks = np.split(facings, FACINGS // 16, axis=1)
    return np.asarray(points[np.unique(np.concatenate([(points @ block).argmax(0) for block in blocks]))])


def _vertices(geometry: Geometry, meshes: Mapping[str, Path]) -> Array:
    """Return the corners of a mesh (n, 3) [m]."""
    if geometry.points:
        return np.array(geometry.points).reshape(-1, 3)
    vertices = read_mesh(meshes[geometry.file], geometry.file).vertices * (geometry.size or (1.0, 1.0, 1.0))
    if not np.isfinite(vertices).all():
        raise ValueError(f"the mesh '{geometry.file}' has corners that are no numbers")
    return np.asarray(vertices)


def quaternion_of(matrix: Array) -> Quaternion:
    """Return the unit quaternion of a rotation matrix (3, 3).

    The largest of the four components is computed first (S. W. Shepperd, Quaternion from Rotation Matrix, 1978).
    """
    m = matrix
    squares = np.array((m[0, 0], m[1, 1], m[2, 2], m.trace()))
    first = int(squares.argmax())
    if first == 3:
        found = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + m.trace())
    else:
        i, j, k = first, (first + 1) % 3, (first + 2) % 3
        parts = [0.0, 0.0, 0.0]
        parts[i], parts[j], parts[k] = 1 + 2 * m[i, i] - m.trace(), m[i, j] + m[j, i], m[i, k] + m[k, i]
        found = (*parts, m[k, j] - m[j, k])
    x, y, z, w = (np.array(found) / np.linalg.norm(found)).tolist()
    return (x, y, z, w)


def box_inertia(mass: float, low: Array, high: Array) -> tuple[Vector3, Array]:
    """Return the centre [m] of a solid box between two corners, and its inertia (3, 3) about it [kg m^2]."""
    squares = np.maximum(high - low, FLAT) ** 2
    x, y, z = ((low + high) / 2).tolist()
    return (x, y, z), np.diag(squares.sum() - squares) * (mass / 12)
