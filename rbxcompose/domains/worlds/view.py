"""What a camera sees of a world: its things as flat faces, and these as colours, tags and depths."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import cv2

from rbxcompose.base.arrays import Array, Bools, Bytes, Indices, Ints32, Singles, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.worlds.grid_map import GridMap, wall_rectangles
from rbxcompose.domains.worlds.optics import Intrinsics
from rbxcompose.domains.worlds.physics.conversion import WALL
from rbxcompose.domains.worlds.physics.looks import WALLS, DepthPicture, colour_of
from rbxcompose.domains.worlds.physics.solids import rotation_matrix
from rbxcompose.domains.worlds.shapes import (
    WorldBox,
    WorldCylinder,
    WorldHull,
    WorldLight,
    WorldMesh,
    WorldShape,
    WorldTag,
)
from rbxcompose.domains.worlds.tag_pictures import tag_picture, tag_square
from rbxcompose.domains.worlds.world import SimulatedWorld

NEAR = 0.02  # nothing is seen nearer than this [m]
FRACTION = 4  # bits of a fraction of a pixel in outlines
SKY, GROUND, HOLE = (200, 215, 230), (0.49, 0.46, 0.43), (0.08, 0.08, 0.08)
DARKEST = 0.5  # of a face on which no light falls; without lamps, light comes from the camera
FLOOR = 100.0  # half the side of the ground [m]
ROUND = 24  # sides of a cylinder
TEXELS = 16  # pixels of a cell in the picture of a tag
FINEST, FINE = 4, 2  # points along a side of a pixel of which its grey is the mean, if a tag is small or large
SMALL = 150**2  # [px]
_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
BOX_SIDES: Mapping[str, tuple[int, int, int, int]] = {
    "front": (5, 4, 6, 7),
    "back": (3, 2, 0, 1),
    "left": (7, 6, 2, 3),
    "right": (1, 0, 4, 5),
    "top": (7, 3, 1, 5),
    "bottom": (6, 4, 0, 2),
}
"""The corners of each side of a box that looks along x: for who looks at it, from the top left one on to the left."""
_SIDES = np.array(list(BOX_SIDES.values()))


@dataclass(frozen=True, eq=False)
class WorldFaces:
    """Flat quads, seen from one side; a triangle repeats a corner."""

    corners: Array
    """In `map` (n, 4, 3) [m]; who sees a face sees them turn left."""
    colours: Bytes
    """Red, green and blue of each (n, 3)."""
    pictures: Mapping[int, Bytes] = field(default_factory=dict)
    """What is on a face besides its colour, by its number: from the first corner down to the second one."""

    @classmethod
    def joined(cls, parts: Sequence[WorldFaces]) -> WorldFaces:
        """Return the faces of several."""
        begins = np.cumsum([0, *(len(part.corners) for part in parts[:-1])]).tolist()
        return cls(
            np.concatenate([part.corners for part in parts]),
            np.concatenate([part.colours for part in parts]),
            {
                before + number: picture
                for part, before in zip(parts, begins, strict=True)
                for number, picture in part.pictures.items()
            },
        )


class WorldView:
    """A world for cameras: what stands still becomes faces once."""

    def __init__(self, world: SimulatedWorld) -> None:
        self._world = world
        self._colours = dict(zip((shape.name for shape in world.shapes), world.colours, strict=False))
        self._pictures: dict[tuple[int, str], Bytes] = {}  # of tags
        still = [shape for shape in world.shapes if shape.path is None]
        parts = [_ground(world), _walls(world.grid), *(self._faces_of(shape) for shape in still)]
        self._still = WorldFaces.joined(parts)

    def seen(
        self, pose: Transform3, camera: Intrinsics, time: float, most: float, robots: Sequence[WorldShape] = ()
    ) -> DepthPicture:
        """Return what a camera at `pose`, of its optical frame in `map`, sees at a time [s] up to `most` [m] away.

        Distortion is left out. Other `robots` are where they are given.
        """
        moving = [self._faces_of(shape.at(time)) for shape in self._world.shapes if shape.path is not None]
        moving += [_painted(_corners_of(robot), colour_of("")[:3]) for robot in robots]
        return draw(WorldFaces.joined([self._still, *moving]), pose, camera, most, self._world.lights)

    def _faces_of(self, shape: WorldShape) -> WorldFaces:
        colour = colour_of(self._colours.get(shape.name, ""))[:3]
        tags = (self._tag(tag, shape) for tag in shape.tags)
        return WorldFaces.joined([_painted(_corners_of(shape), colour), *tags])

    def _tag(self, tag: WorldTag, shape: WorldShape) -> WorldFaces:
        """Return a tag on a shape, just above its side."""
        if (key := (tag.number, tag.family)) not in self._pictures:
            self._pictures[key] = tag_picture(*key, module=TEXELS)
        corners = _turned(tag_square(tag)[None], shape.pose.x, shape.pose.y, shape.pose.heading, shape.z)
        face = _painted(corners, (1.0, 1.0, 1.0))
        return replace(face, pictures={0: self._pictures[key]})


def _painted(corners: Array, colour: Sequence[float]) -> WorldFaces:
    """Return faces of one colour, from 0 to 1."""
    return WorldFaces(corners, np.tile(np.round(np.array(colour) * 255).astype(np.uint8), (len(corners), 1)))


def _ground(world: SimulatedWorld) -> WorldFaces:
    """Return the ground, and holes just above it."""
    x, y = world.start.x, world.start.y
    whole = [(x + a * FLOOR, y + b * FLOOR, 0.0) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    parts = [_painted(np.array([whole]), GROUND)]
    for hole in world.holes:
        edge = np.array([(*corner, 1e-3) for corner in hole.corners], float)
        fan = [(edge[0], edge[i], edge[i + 1], edge[i + 1]) for i in range(1, len(edge) - 1)]
        parts += [_painted(np.array(way), HOLE) for way in (fan, [each[::-1] for each in fan])]
    return WorldFaces.joined(parts)


def _walls(grid: GridMap) -> WorldFaces:
    """Return the sides of what is occupied in a map."""
    rectangles = wall_rectangles(grid)
    low, high = rectangles[:, :2] * grid.resolution, rectangles[:, 2:] * grid.resolution
    sizes = np.column_stack((high - low, np.full(len(low), WALL)))
    middles = np.column_stack(((low + high) / 2, np.zeros(len(low))))
    corners = (middles[:, None] + _CORNERS * sizes[:, None])[:, _SIDES].reshape(-1, 4, 3)
    return _painted(_turned(corners, grid.origin.x, grid.origin.y, grid.origin.heading), WALLS)


def _corners_of(shape: WorldShape) -> Array:
    """Return the faces of a shape in `map` (n, 4, 3) [m]."""
    corners: Array
    match shape.solid:
        case WorldBox(size=size):
            corners = (_CORNERS * size)[_SIDES]
        case WorldCylinder(radius=radius, height=height):
            angles = np.arange(ROUND + 1) * (math.tau / ROUND)
            rim = np.column_stack((np.cos(angles), np.sin(angles))) * radius
            low, high = (np.column_stack((rim, np.full(len(rim), z))) for z in (0.0, height))
            sides = np.stack((high[:-1], low[:-1], low[1:], high[1:]), 1)
            middle = np.broadcast_to((0.0, 0.0, height), (ROUND // 2, 3))
            top = np.stack((middle, high[:-2:2], high[1:-1:2], high[2::2]), 1)
            corners = np.concatenate((sides, top))
        case WorldHull(corners=points, triangles=triangles):
            corners = np.array(points)[np.array(triangles)[:, (0, 1, 2, 2)]]
        case WorldMesh():
            return np.concatenate([_corners_of(part) for part in shape.convex])
    return _turned(corners, shape.pose.x, shape.pose.y, shape.pose.heading, shape.z)


def _turned(corners: Array, x: float, y: float, heading: float, z: float = 0.0) -> Array:
    cos, sin = math.cos(heading), math.sin(heading)
    return np.asarray(corners @ np.array([(cos, sin, 0), (-sin, cos, 0), (0, 0, 1)]) + (x, y, z))


def draw(
    faces: WorldFaces, pose: Transform3, camera: Intrinsics, most: float, lights: Sequence[WorldLight] = ()
) -> DepthPicture:
    """Return what a camera at `pose`, of its optical frame in `map`, sees of faces up to `most` [m] away.

    Of a flat face, 1 / depth is linear in the pixels of a picture; each pixel shows the face where that is greatest.
    """
    height, width = camera.height, camera.width
    turn = rotation_matrix(pose.rotation)
    points = (faces.corners - np.array(pose.translation)) @ turn
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    offsets = np.einsum("ij,ij->i", normals, points[:, 0])
    nearness = np.full((height, width), 1.0 / most, np.float32)
    shown = np.full((height, width), -1, np.int32)
    for index in _may_be_seen(points, offsets, camera).tolist():
        outline = points[index] if points[index][:, 2].min() >= NEAR else _ahead(points[index])
        pixels = outline[:, :2] / outline[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
        left, top = np.clip(np.floor(pixels.min(0)), 0, (width, height)).astype(int).tolist()
        right, bottom = np.clip(np.ceil(pixels.max(0)) + 1, 0, (width, height)).astype(int).tolist()
        if left >= right or top >= bottom:
            continue
        inside = np.zeros((bottom - top, right - left), np.uint8)
        drawn = np.clip(np.round((pixels - (left, top)) * (1 << FRACTION)), -(1 << 24), 1 << 24)
        cv2.fillConvexPoly(inside, drawn.astype(np.int32), 1, cv2.LINE_8, FRACTION)
        a, b, c = normals[index] / offsets[index]
        across = ((np.arange(left, right) - camera.cx) * (a / camera.fx) + c).astype(np.float32)
        down = ((np.arange(top, bottom) - camera.cy) * (b / camera.fy)).astype(np.float32)
        near = across[None, :] + down[:, None]
        place = np.s_[top:bottom, left:right]
        wins = inside.view(bool)
        wins &= near > nearness[place]
        np.copyto(nearness[place], near, where=wins)
        np.copyto(shown[place], index, where=wins)
    depths = np.where(shown >= 0, 1.0 / nearness, np.float32(math.inf))
    bright = np.full((len(points), 3), DARKEST)
    for lamp in lights:
        at = (np.array(lamp.at) - pose.translation) @ turn
        bright += _facing(points - at, normals)[:, None] * lamp.strength * colour_of(lamp.colour or "white")[:3]
    if not lights:
        bright += (1 - DARKEST) * _facing(points, normals)[:, None]
    colours = _coloured(faces, bright, shown)
    for index, picture in faces.pictures.items():
        _paint(colours, shown == index, picture, points[index], camera, bright[index])
    return DepthPicture(colours, depths)


def _may_be_seen(points: Array, offsets: Array, camera: Intrinsics) -> Indices:
    """Return which faces look at a camera and are not wholly behind it, or beside its picture."""
    sides = np.array(
        [
            (camera.fx, 0, camera.cx + 0.5),
            (-camera.fx, 0, camera.width - camera.cx - 0.5),
            (0, camera.fy, camera.cy + 0.5),
            (0, -camera.fy, camera.height - camera.cy - 0.5),
        ]
    )
    is_beside = ((points @ sides.T).max(1) <= 0).any(1)
    return np.flatnonzero((offsets < 0) & (points[:, :, 2].max(1) > NEAR) & ~is_beside)


def _ahead(outline: Array) -> Array:
    """Return the part of a polygon (n, 3) that is before the camera; some of it is."""
    found = []
    for before, here in zip(np.roll(outline, 1, 0), outline, strict=True):
        if (before[2] < NEAR) != (here[2] < NEAR):
            found.append(before + (NEAR - before[2]) / (here[2] - before[2]) * (here - before))
        if here[2] >= NEAR:
            found.append(here)
    return np.array(found)


def _facing(points: Array, normals: Array) -> Array:
    """Return the cosine of the angle between the normal of each face and its direction to the origin (n,), 0 from
    behind: how bright light from there makes it."""
    middles = points.mean(1)
    lengths = np.linalg.norm(middles, axis=1) * np.linalg.norm(normals, axis=1)
    return np.asarray(np.maximum(0.0, -np.einsum("ij,ij->i", middles, normals) / np.maximum(lengths, 1e-12)))


def _coloured(faces: WorldFaces, bright: Array, shown: Ints32) -> Bytes:
    """Return the colour of each pixel (h, w, 3), by the face that it shows and how bright each face is (n, 3)."""
    palette = np.zeros((len(bright) + 1, 4), np.uint8)  # as whole numbers, which are looked up at once
    palette[:-1, :3] = faces.colours * np.minimum(bright, 1.0)
    palette[-1, :3] = SKY
    found = np.take(palette.view(np.uint32).ravel(), shown, mode="wrap").view(np.uint8)
    return np.asarray(cv2.cvtColor(found.reshape(*shown.shape, 4), cv2.COLOR_BGRA2BGR), np.uint8)


def _paint(colours: Bytes, where: Bools, picture: Bytes, corners: Array, camera: Intrinsics, bright: Array) -> None:
    """Paint a picture on a face with corners (4, 3) in the optical frame [m], in the pixels that show it (h, w)."""
    rows, columns = np.flatnonzero(where.any(1)), np.flatnonzero(where.any(0))
    if not len(rows):
        return
    place = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    height, width = rows[-1] + 1 - rows[0], columns[-1] + 1 - columns[0]
    fine = FINEST if height * width <= SMALL else FINE
    # From points of the picture to those of the face, then to pixels, and then to finer ones of the part that is seen.
    side = len(picture)
    of_picture = np.array([(1 / side, 0, 0.5 / side), (0, 1 / side, 0.5 / side), (0, 0, 1)])
    of_face = np.column_stack((corners[3] - corners[0], corners[1] - corners[0], corners[0]))
    of_part = np.array([(fine, 0, (0.5 - columns[0]) * fine - 0.5), (0, fine, (0.5 - rows[0]) * fine - 0.5), (0, 0, 1)])
    whole = of_part @ camera.matrix @ of_face @ of_picture
    seen = cv2.warpPerspective(
        picture,
        whole,
        (int(width * fine), int(height * fine)),
        flags=cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_REPLICATE,
    )
    greys = cv2.resize(seen, (int(width), int(height)), interpolation=cv2.INTER_AREA)
    np.copyto(
        colours[place], (greys[..., None] * np.minimum(bright, 1.0)).astype(np.uint8), where=where[place][..., None]
    )


class Lens:
    """Bends pictures as a camera with distortion does."""

    def __init__(self, camera: Intrinsics) -> None:
        self.camera = camera
        straight = camera.unbent
        x, y = (np.ascontiguousarray(camera.rays[:, :, axis], np.float32) for axis in (0, 1))
        places = x * np.float32(straight.fx) + straight.cx, y * np.float32(straight.fy) + straight.cy
        self._map = None if straight is camera else tuple(each.astype(np.float32) for each in places)

    def bent(self, colours: Bytes, depths: Singles) -> tuple[Bytes, Singles]:
        """Return the picture and the depths of a camera, which were drawn for `camera.unbent`."""
        if self._map is None:
            return colours, depths
        columns, rows = self._map
        bent = cv2.remap(colours, columns, rows, cv2.INTER_LINEAR)
        return np.asarray(bent, np.uint8), depths[np.rint(rows).astype(np.intp), np.rint(columns).astype(np.intp)]
