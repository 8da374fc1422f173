"""Random objects of planning scenes."""

from __future__ import annotations

import math

from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy
from rbxcompose.domains.arms.motion.scene import PlacedObject, ScenePiece
from rbxcompose.domains.body.model import Geometry

TETRAHEDRON = (0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.2)
FACES = (0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2)
MESH = Geometry("mesh", (1.0, 1.0, 1.0), points=TETRAHEDRON, triangles=FACES)
FLOOR = Geometry("plane", (0.0, 0.0, 1.0, 0.0))
OCTREE = Geometry("octree", (0.05,), points=(0.0, 0.0, 0.0, 0.05, 0.0, 0.0))

lengths = st.floats(0.01, 0.4)
angles = st.floats(-math.pi, math.pi)
poses = st.builds(
    lambda x, y, z, roll, pitch, yaw: Transform3((x, y, z), quaternion_from_rpy(roll, pitch, yaw)),
    *[st.floats(-1.0, 1.0)] * 3,
    *[angles] * 3,
)
solids = st.one_of(
    st.builds(lambda *size: Geometry("box", size), lengths, lengths, lengths),
    st.builds(lambda *size: Geometry("cylinder", size), lengths, lengths),
    st.builds(lambda *size: Geometry("cone", size), lengths, lengths),
    st.builds(lambda size: Geometry("sphere", (size,)), lengths),
    st.just(MESH),
)
shapes = st.one_of(solids, st.just(FLOOR))
names = st.text("abcdefgh é_-.0", min_size=1, max_size=12).map(str.strip).filter(bool)
colours = st.none() | st.tuples(*[st.floats(0.0, 1.0)] * 3, st.floats(0.1, 1.0))


@st.composite
def objects(draw: st.DrawFn, name: str, shapes: st.SearchStrategy[Geometry] = shapes) -> PlacedObject:
    """Return an object in the frame of the link `ground`."""
    pieces = draw(st.lists(st.builds(ScenePiece, shapes, poses), max_size=2))
    return PlacedObject(
        name, draw(shapes), "ground", draw(poses), pieces=tuple(pieces), colour=draw(colours), shape_pose=draw(poses)
    )
