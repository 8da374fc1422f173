"""How square tags look, and where they are on things of a world."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

from rbxcompose.base.arrays import Array, Bytes, np
from rbxcompose.base.geometry import Transform3, quaternion_from_yaw
from rbxcompose.domains.worlds.shapes import ConvexSolid, WorldBox, WorldCylinder, WorldMesh, WorldTag

DEFAULT_FAMILY = "tag36h11"
ABOVE = 1e-3  # [m]
FILLS = 0.8  # of the shorter side of a face: a tag whose size is not said


class TagFamily(NamedTuple):
    """Tags of one kind."""

    opencv: str
    """What OpenCV calls them."""
    total: int
    """They are numbered from 0 to one less."""
    cells: int
    """Along a side of the black square."""


FAMILIES: Mapping[str, TagFamily] = {
    "tag36h11": TagFamily("DICT_APRILTAG_36h11", 587, 8),
    "tag36h10": TagFamily("DICT_APRILTAG_36h10", 2320, 8),
    "tag25h9": TagFamily("DICT_APRILTAG_25h9", 35, 7),
    "tag16h5": TagFamily("DICT_APRILTAG_16h5", 30, 6),
    "aruco_original": TagFamily("DICT_ARUCO_ORIGINAL", 1024, 7),
    **{
        f"aruco_{n}x{n}_{count}": TagFamily(f"DICT_{n}X{n}_{count}", count, n + 2)
        for n in (4, 5, 6, 7)
        for count in (50, 100, 250, 1000)
    },
}
TAG_FAMILIES: TypeAlias = Literal[tuple(FAMILIES)]  # type: ignore[valid-type]

TagSide: TypeAlias = Literal["front", "back", "left", "right", "top"]
_UPRIGHT = (0.5, 0.5, 0.5, 0.5)  # x of the tag along y of the thing, y along z, z along x
_LYING = quaternion_from_yaw(-math.pi / 2)
_TURNS = {"front": 0.0, "left": math.pi / 2, "back": math.pi, "right": -math.pi / 2}


def dictionary(family: str) -> Any:
    """Return a family as OpenCV knows it.

    Raises:
        KeyError: if there is no such family.
    """
    import cv2

    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, FAMILIES[family].opencv))


def tag_picture(number: int, family: str = DEFAULT_FAMILY, module: int = 1, margin: int = 1) -> Bytes:
    """Return a tag in black and white (n, n), `module` pixels for each of its cells and a white margin of cells.

    Raises:
        KeyError: if there is no such family.
        ValueError: if it has no such tag.
    """
    import cv2

    if why := no_tag(number, family):
        raise ValueError(why)
    cells = cv2.aruco.generateImageMarker(dictionary(family), number, FAMILIES[family].cells)
    framed = np.pad(cells, margin, constant_values=255)
    return np.asarray(np.kron(framed, np.ones((module, module), np.uint8)), np.uint8)


def no_tag(number: int, family: str) -> str:
    """Return why a family has no tag of this number, or nothing."""
    total = FAMILIES[family].total
    return "" if 0 <= number < total else f"{family} has the tags 0 to {total - 1}, and no {number}"


def with_margin(size: float, family: str) -> float:
    """Return the side of a tag with its margin, which is a cell wide, by that of its black square."""
    return size * (1 + 2 / FAMILIES[family].cells)


def tag_square(tag: WorldTag) -> Array:
    """Return the corners of a tag with its margin in the frame of its thing (4, 3) [m], from the top left one down and
    around; they are just above the side that it is on, so that they are what is seen."""
    half = with_margin(tag.size, tag.family) / 2
    corners = [(-half, half, ABOVE), (-half, -half, ABOVE), (half, -half, ABOVE), (half, half, ABOVE)]
    return np.array([tag.place.apply(corner) for corner in corners])


def tag_on(
    solid: ConvexSolid | WorldMesh,
    side: str,
    number: int,
    family: str = DEFAULT_FAMILY,
    size: float | None = None,
    at: tuple[float, float] = (0.0, 0.0),
) -> WorldTag:
    """Return a tag on a side of a box or a cylinder that looks along x; on a cylinder, it touches that.

    `at` is where its middle is beside that of the side [m], to the right and up for who looks at it.

    Raises:
        ValueError: if there is no such tag, or if it does not fit there.
    """
    if why := no_tag(number, family):
        raise ValueError(why)
    match solid:
        case WorldBox(size=(x, y, z)):
            wide, high = {"top": (y, x), "front": (y, z), "back": (y, z)}.get(side, (x, z))
            out = (y if side in ("left", "right") else x) / 2
        case WorldCylinder(radius=radius, height=z):
            wide, high = 2 * radius, 2 * radius if side == "top" else z
            out = radius
        case _:
            raise ValueError("tags are on boxes, cylinders and people: a mesh has no flat sides")
    size = min(wide, high) * FILLS if size is None else size
    right, up = at
    whole = with_margin(size, family)
    if abs(right) + whole / 2 > wide / 2 + 1e-9 or abs(up) + whole / 2 > high / 2 + 1e-9:
        room = f"{100 * wide:.3g} x {100 * high:.3g} cm"
        raise ValueError(
            f"the tag {number}, {100 * whole:.3g} cm wide with its margin, does not fit on '{side}', {room}"
        )
    if side == "top":
        place = Transform3((up, -right, z), _LYING)
    else:
        turned = Transform3((0.0, 0.0, z / 2), quaternion_from_yaw(_TURNS[side]))
        place = turned.compose(Transform3((out, right, up), _UPRIGHT))
    return WorldTag(number, family, size, place)
