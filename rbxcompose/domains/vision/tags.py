"""Square tags: where they are in a picture, and before the camera."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rbxcompose.base.arrays import Array, Bytes, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.worlds.optics import Intrinsics
from rbxcompose.domains.worlds.physics.solids import quaternion_of, rotation_matrix
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, dictionary

PIXEL_NOISE = 0.3  # standard deviation of a corner after its refinement [px]
FAR_OFF = 3.0  # a tag whose corners miss its pose by more is none, or is bent [px]


@dataclass(frozen=True)
class SeenTag:
    """A tag in a picture."""

    number: int
    corners: Array
    """In pixels (4, 2): top left, top right, bottom right, bottom left, as the tag is printed."""
    pose: Transform3 | None = None
    """In the optical frame of the camera: x to the right of the tag, y up, z out of it. None if its size is unknown."""
    covariance: Array | None = None
    """Of the pose (6, 6): position in the optical frame [m^2], then rotation about its axes [rad^2]."""
    miss: float = 0.0
    """How far the corners are from where the pose has them, root mean square [px]."""
    doubt: float = 0.0
    """From 0 to 1: how well the mirrored pose explains the corners, compared with this one. Above 0.5, do not trust
    its rotation."""


class TagFinder:
    """Finds the tags of a family in pictures; sizes are those of the black squares [m]."""

    def __init__(
        self, family: str = DEFAULT_FAMILY, size: float | None = None, sizes: Mapping[int, float] | None = None
    ) -> None:
        import cv2

        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        settings.relativeCornerRefinmentWinSize = 0.4  # of a cell: a larger window reaches into other corners
        # One threshold finds as many as OpenCV's three do, from 10 to 300 pixels, in two fifths of the time.
        settings.adaptiveThreshWinSizeMin = settings.adaptiveThreshWinSizeMax = 13
        settings.minMarkerPerimeterRate = 0.02  # of the longer side of the picture
        settings.errorCorrectionRate = 0.4  # of the bits that the family could correct: false tags are worse than none
        self._detector = cv2.aruco.ArucoDetector(dictionary(family), settings)
        self._size, self._sizes = size, dict(sizes or {})

    def find(self, picture: Bytes, camera: Intrinsics | None = None) -> list[SeenTag]:
        """Return the tags of a picture in grey (h, w), by number and then from left to right.

        Poses need a camera and the size of the tag.
        """
        found, numbers, _ = self._detector.detectMarkers(picture)
        if not found:
            return []
        seen = []
        for number, corners in zip(map(int, np.ravel(numbers)), found, strict=True):
            points = np.asarray(corners, float).reshape(4, 2)
            size = self._sizes.get(number, self._size)
            tag = SeenTag(number, points) if camera is None or size is None else _posed(number, points, size, camera)
            if tag is not None:
                seen.append(tag)
        return sorted(seen, key=lambda tag: (tag.number, tag.corners[:, 0].mean()))


def square(size: float) -> Array:
    """Return the corners of a tag in its frame (4, 3) [m], in the order of `SeenTag.corners`."""
    half = size / 2
    return np.array([(-half, half, 0), (half, half, 0), (half, -half, 0), (-half, -half, 0)], float)


def _posed(number: int, corners: Array, size: float, camera: Intrinsics) -> SeenTag | None:
    """Return a tag with its pose; None if no pose in front of the camera explains it.

    A square has two poses that look nearly alike, mirrored at the line of sight: T. Collins and A. Bartoli,
    Infinitesimal Plane-Based Pose Estimation, 2014.
    """
    import cv2

    points = square(size)
    ways: list[tuple[float, Array, Array]] = []
    # The first fails for a square that the camera faces exactly, where there is no second pose either.
    for method in (cv2.SOLVEPNP_IPPE_SQUARE, cv2.SOLVEPNP_ITERATIVE):
        try:
            _, turns, shifts, misses = cv2.solvePnPGeneric(
                points, corners, camera.matrix, camera.coefficients, flags=method
            )
        except cv2.error:  # the square is too small for its arithmetic
            continue
        # A pose that it could not compute has no error.
        for off, turn, shift in zip(np.ravel(misses), turns, shifts, strict=False):
            if shift[2, 0] > 0 and np.isfinite(turn).all():
                ways.append((float(off), np.asarray(turn, float), np.asarray(shift, float)))
        ways.sort(key=lambda way: way[0])
        if ways and ways[0][0] <= FAR_OFF:
            break
    else:
        return None
    miss, turn, shift = ways[0]
    doubt = (miss + PIXEL_NOISE / 10) / (ways[1][0] + PIXEL_NOISE / 10) if len(ways) > 1 else 0.0
    turn, shift = _refined(points, corners, turn, shift, camera)
    return SeenTag(number, corners, pose_from(turn, shift), spread(points, turn, shift, camera), miss, doubt)


def board_pose(
    tags: Sequence[SeenTag], places: Mapping[int, Transform3], sizes: Mapping[int, float], camera: Intrinsics
) -> tuple[Transform3, Array] | None:
    """Return where a board with tags at `places` in its frame is in the optical frame, with the covariance (6, 6).

    All corners that are seen count together, so that a board is steadier than its tags. None without a tag of it, or
    if no pose explains them.
    """
    import cv2

    mine = [tag for tag in tags if tag.number in places]
    if not mine:
        return None
    points = np.concatenate([placed_square(places[tag.number], sizes[tag.number]) for tag in mine])
    corners = np.concatenate([tag.corners for tag in mine])
    best = min(mine, key=lambda tag: (tag.doubt > 0.5, -cv2.contourArea(tag.corners.astype(np.float32))))
    if best.pose is None:
        return None
    first = best.pose.compose(places[best.number].inverse())
    start = np.asarray(cv2.Rodrigues(rotation_matrix(first.rotation))[0], float)
    turn, shift = _refined(points, corners, start, np.array(first.translation).reshape(3, 1), camera)
    seen, _ = cv2.projectPoints(points, turn, shift, camera.matrix, camera.coefficients)
    if not shift[2, 0] > 0 or math.sqrt(float(np.mean(np.sum((seen.reshape(-1, 2) - corners) ** 2, 1)))) > FAR_OFF:
        return None
    return pose_from(turn, shift), spread(points, turn, shift, camera)


def _refined(points: Array, corners: Array, turn: Array, shift: Array, camera: Intrinsics) -> list[Array]:
    """Return the rotation vector and the translation (3, 1) that explain corners best, near given ones."""
    import cv2

    found = cv2.solvePnPRefineLM(points, corners, camera.matrix, camera.coefficients, turn, shift)
    return [np.asarray(one, float) for one in found]


def placed_square(place: Transform3, size: float) -> Array:
    """Return the corners of a tag that is at a place (4, 3) [m]."""
    return np.array([place.apply((x, y, z)) for x, y, z in square(size).tolist()])


def spread(points: Array, turn: Array, shift: Array, camera: Intrinsics) -> Array:
    """Return the covariance of a pose (6, 6), by corners that are off by `PIXEL_NOISE`, to the first order."""
    import cv2

    _, slopes = cv2.projectPoints(points, turn, shift, camera.matrix, camera.coefficients)
    rotated = points @ cv2.Rodrigues(turn)[0].T
    by_shift = slopes[:, 3:6]
    # A small turn w about the axes of the camera moves a point p of the tag by w x p.
    crossed = np.zeros((len(points), 3, 3))
    crossed[:, [1, 2, 0], [2, 0, 1]] = -rotated[:, [0, 1, 2]]
    crossed[:, [2, 0, 1], [1, 2, 0]] = rotated[:, [0, 1, 2]]
    by_turn = np.einsum("nij,njk->nik", by_shift.reshape(-1, 2, 3), -crossed).reshape(-1, 3)
    both = np.hstack((by_shift, by_turn))
    return np.asarray(np.linalg.pinv(both.T @ both) * PIXEL_NOISE**2)


def pose_from(turn: Array, shift: Array) -> Transform3:
    """Return a rotation vector (3, 1) and a translation (3, 1) as a transform."""
    import cv2

    x, y, z = shift.ravel().tolist()
    return Transform3((x, y, z), quaternion_of(np.asarray(cv2.Rodrigues(turn)[0], float)))
