"""Shapes of things in the planning scene: what their numbers mean, and which cannot be."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rbxcompose.body.model import Geometry

SIZES: Mapping[str, tuple[str, ...]] = {
    "box": ("x", "y", "z"),
    "cylinder": ("radius", "length"),
    "cone": ("radius", "length"),
    "sphere": ("radius",),
    "plane": ("a", "b", "c", "d"),
    "mesh": ("scale along x", "y", "z"),
    "octree": ("side of a cell",),
}
"""What the numbers of each shape's size mean. A plane is all that is below ax + by + cz + d = 0."""
LEAST, GREATEST = 1e-4, 100.0
"""[m] that a length may have: smaller things would slip through between examined positions, larger ones are planes."""
MOST_POINTS = 200_000
"""Corners of a mesh, or cells of an octree."""
PLANE, MESH, OCTREE = "plane", "mesh", "octree"
FIXED = (PLANE, OCTREE)
"""Shapes that no link carries."""


def mistake_in_shape(shape: Geometry) -> str:
    """Return why a shape cannot be in the scene, nothing if it can."""
    names = SIZES.get(shape.kind)
    if names is None:
        return f"'{shape.kind}' is no shape: {', '.join(SIZES)}"
    if len(shape.size) != len(names):
        return f"the size of a {shape.kind} is {', '.join(names)}"
    if not all(map(math.isfinite, (*shape.size, *shape.points))):
        return f"a number of its {shape.kind} is not finite"
    if shape.kind == PLANE:
        return "" if abs(math.hypot(*shape.size[:3]) - 1.0) <= 0.01 else "the length of its normal is not 1"
    if shape.kind in (MESH, OCTREE):
        return _mistake_in_points(shape)
    if wrong := [size for size in shape.size if not LEAST <= size <= GREATEST]:
        return f"a length of its {shape.kind} is {wrong[0]:g} m: it is at least {LEAST:g} m and at most {GREATEST:g} m"
    return ""


def _mistake_in_points(shape: Geometry) -> str:
    if shape.kind == MESH and 0.0 in shape.size:
        return "a scale of its mesh is 0"
    if shape.kind == OCTREE and not 1e-3 <= shape.size[0] <= 1.0:
        return f"a cell of its octree is {shape.size[0]:g} m wide: from 1 mm to 1 m"
    if shape.file:
        return ""
    count, rest = divmod(len(shape.points), 3)
    if not count or rest:
        return f"its {shape.kind} has no points"
    if count > MOST_POINTS:
        return f"its {shape.kind} has {count:,} points, and may have {MOST_POINTS:,}"
    if shape.kind == MESH:
        if not shape.triangles or len(shape.triangles) % 3:
            return "its mesh has no triangles"
        if not 0 <= min(shape.triangles) <= max(shape.triangles) < count:
            return "a triangle of its mesh has a corner that there is not"
    extent = max(map(abs, shape.points)) * (max(map(abs, shape.size)) if shape.kind == MESH else 1.0)
    return "" if extent <= GREATEST else f"its {shape.kind} reaches {extent:g} m far: at most {GREATEST:g} m"
