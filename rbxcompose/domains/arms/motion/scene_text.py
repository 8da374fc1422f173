"""Scenes as text files: the format `.scene` of MoveIt, of ROS 1 and ROS 2, read and written.

Behind the line with its name, a scene has objects, and a point at its end. An object is `* NAME`, its pose (the older
variant has none), the number of its shapes, each with its numbers, pose and colour, and the number of its subframes
(the older variant has none). Poses are `x y z`, and a quaternion `x y z w`; an object without a colour has `0 0 0 0`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Span, kind
from rbxcompose.base.geometry import Transform3
from rbxcompose.base.printable import plain
from rbxcompose.domains.arms.motion import scene
from rbxcompose.domains.body.model import Geometry

NO_SCENE = kind("RBX2351")
LARGEST = 20_000_000  # [bytes] of a file
_OLD_NAME = "(noname)"
_WORD = re.compile(r"\S+")
_KINDS = tuple(size for size in scene.SIZES if size != scene.OCTREE)


@dataclass(frozen=True, slots=True)
class SceneFile:
    """A scene: its name, and its objects; their link is not in the text, and stands for the frame of the scene."""

    name: str
    objects: tuple[scene.PlacedObject, ...]


class _WrongError(Exception):
    """Raised where a text is wrong."""

    def __init__(self, word: _Word, message: str) -> None:
        super().__init__(message)
        self.word = word


@dataclass(frozen=True, slots=True)
class _Word:
    text: str
    line: int
    column: int
    rest: str = ""
    """What follows it in its line."""


def read_scene(text: str, file: str) -> SceneFile | Finding:
    """Return the scene of a text, or what is wrong with it; `file` is its name in the finding."""
    lines = text.split("\n")
    reader = _Reader(lines)
    try:
        return SceneFile(lines[0].strip(), tuple(reader.objects()))
    except _WrongError as error:
        word = error.word
        end = max(word.column + len(word.text), word.column + 1)
        return NO_SCENE.at(Span(file, word.line, word.column, word.line, end), str(error))


class _Reader:
    def __init__(self, lines: list[str]) -> None:
        self._words = (
            _Word(found[0], number, found.start() + 1, line[found.end() :].strip())
            for number, line in enumerate(lines[1:], 2)
            for found in _WORD.finditer(line)
        )
        self._last = _Word("", len(lines), 1)
        first = next((index for index, line in enumerate(lines[1:], 1) if line.startswith("*")), len(lines))
        self._has_poses = len("".join(lines[first + 1 : first + 2]).split()) > 1

    def objects(self) -> Iterator[scene.PlacedObject]:
        names: set[str] = set()
        while (word := self._next("'*' or '.'")).text != ".":
            if word.text != "*":
                raise _WrongError(word, f"'{plain(word.text)}' is neither '*', which begins an object, nor '.'")
            if word.rest in names or not word.rest:
                reason = f"'{plain(word.rest)}' is there twice" if word.rest else "the object has no name"
                raise _WrongError(word, reason)
            if len(names) == scene.MOST_SHAPES:
                raise _WrongError(word, f"there are more than {scene.MOST_SHAPES:,} objects")
            names.add(word.rest)
            for _ in word.rest.split():
                self._next("a name")
            yield self._object(word)

    def _object(self, head: _Word) -> scene.PlacedObject:
        pose = self._pose() if self._has_poses else Transform3()
        count = self._count("number of shapes", scene.MOST_SHAPES)
        if not count:
            raise _WrongError(head, f"'{plain(head.rest)}' has no shapes")
        pieces, colour = [], None
        for _ in range(count):
            shape, own = self._shape(), self._pose()
            pieces.append(scene.ScenePiece(shape, own))
            colour = self._colour() or colour
        for _ in range(self._count("number of subframes", scene.MOST_SHAPES) if self._has_poses else 0):
            self._next("a subframe")
            self._pose()
        return scene.PlacedObject.of(head.rest, "", pose, pieces, colour=colour)

    def _shape(self) -> Geometry:
        word = self._next("a shape")
        if word.text not in _KINDS:
            raise _WrongError(word, f"'{plain(word.text)}' is no shape: {', '.join(_KINDS)}")
        if word.text == scene.MESH:
            points, triangles = (
                self._count("number of corners", scene.MOST_POINTS),
                self._count("number", scene.MOST_POINTS * 4),
            )
            corners = tuple(self._number("a corner") for _ in range(3 * points))
            faces = tuple(self._count("corner of a triangle", points - 1) for _ in range(3 * triangles))
            shape = Geometry(scene.MESH, (1.0, 1.0, 1.0), points=corners, triangles=faces)
        else:
            shape = Geometry(
                word.text, tuple(self._number(f"{one} of a {word.text}") for one in scene.SIZES[word.text])
            )
        if wrong := scene.mistake_in_shape(shape):
            raise _WrongError(word, wrong)
        return shape

    def _pose(self) -> Transform3:
        x, y, z, qx, qy, qz, qw = (self._number("a pose") for _ in range(7))
        length = math.hypot(qx, qy, qz, qw)
        if abs(length - 1.0) > 0.01:
            raise _WrongError(self._last, f"the length of this quaternion is {length:g}, not 1")
        return Transform3((x, y, z), (qx, qy, qz, qw))

    def _colour(self) -> scene.Colour | None:
        red, green, blue, alpha = (self._number("a colour") for _ in range(4))
        if not all(0.0 <= share <= 1.0 for share in (red, green, blue, alpha)):
            raise _WrongError(self._last, "the parts of a colour are from 0 to 1")
        return (red, green, blue, alpha) if any((red, green, blue, alpha)) else None

    def _count(self, what: str, most: int) -> int:
        word = self._next(what)
        if not word.text.isascii() or not word.text.isdigit() or len(word.text) > 9 or int(word.text) > most:
            raise _WrongError(word, f"'{plain(word.text)}' is no {what}: 0 to {most:,}")
        return int(word.text)

    def _number(self, what: str) -> float:
        word = self._next(what)
        try:
            found = float(word.text)
        except ValueError:
            found = math.nan
        if not math.isfinite(found):
            raise _WrongError(word, f"'{plain(word.text)}' is no number, but {what} belongs here")
        return found

    def _next(self, what: str) -> _Word:
        word = next(self._words, None)
        if word is None:
            raise _WrongError(self._last, f"the file ends where {what} belongs")
        self._last = word
        return word


def written_scene(name: str, objects: Iterable[scene.PlacedObject]) -> str:
    """Return a scene as text, in the newer variant; meshes have their triangles here, and there are no octrees."""
    lines = [name or _OLD_NAME]
    for thing in objects:
        lines += [f"* {thing.name}", *_pose_lines(thing.pose), str(len(thing.own_pieces))]
        for piece in thing.own_pieces:
            lines += [*_shape_lines(piece.shape), *_pose_lines(piece.pose), _row(thing.colour or (0, 0, 0, 0))]
        lines.append("0")
    return "\n".join([*lines, ".", ""])


def _shape_lines(shape: Geometry) -> Iterator[str]:
    yield shape.kind
    if shape.kind != scene.MESH:
        yield _row(shape.size)
        return
    points = [value * shape.size[index % 3] for index, value in enumerate(shape.points)]
    yield f"{len(points) // 3} {len(shape.triangles) // 3}"
    for numbers in (points, shape.triangles):
        yield from (_row(numbers[index : index + 3]) for index in range(0, len(numbers), 3))


def _pose_lines(pose: Transform3) -> tuple[str, str]:
    return _row(pose.translation), _row(pose.rotation)


def _row(numbers: Iterable[float]) -> str:
    return " ".join(str(int(number)) if number == int(number) else repr(float(number)) for number in numbers)
