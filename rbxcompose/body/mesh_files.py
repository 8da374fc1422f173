"""Files of meshes: whether one can be what its name says. Only its size and its first bytes are read."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path

from rbxcompose.body.model import Body
from rbxcompose.findings import Finding, kind
from rbxcompose.printable import plain
from rbxcompose.regular_files import open_regular

BAD_MESH = kind("RBX2015")
LARGEST = 64_000_000  # [bytes]
_HEAD = 8_192  # [bytes] that are read
_SHOWN = 200
_TEXT = {7, 8, 9, 10, 12, 13, 27, *range(32, 256)}
_ELEMENTS = re.compile(rb"^element\s+\w+\s+(\d{1,20})\s*$", re.MULTILINE)


def mesh_mistakes(body: Body, meshes: Mapping[str, Path]) -> Iterator[Finding]:
    """Yield the shapes whose mesh cannot be read; `meshes` are the files that exist, by their names in the URDF."""
    problem = cache(mesh_problem)
    for link in body.links.values():
        for shape in (*link.visuals, *link.collisions):
            path = meshes.get(shape.geometry.file)
            if path is not None and (words := problem(path)):
                yield BAD_MESH.at(
                    shape.size_span or shape.span, f"the mesh '{plain(shape.geometry.file, _SHOWN)}' {words}"
                )


def mesh_problem(path: Path, most: int = LARGEST) -> str:
    """Return why a file can be no mesh of the format that its name says; nothing if it may be one."""
    try:
        size = path.stat().st_size
        with open_regular(path) as file:
            head = file.read(_HEAD)
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    if size > most:
        return f"is larger than {most:,} bytes"
    if size == 0:
        return "is empty"
    look = _FORMATS.get(path.suffix.lower())
    return look(head, size) if look else ""


def _stl(head: bytes, size: int) -> str:
    count = struct.unpack_from("<I", head, 80)[0] if size >= 84 else 0
    if count and size >= 84 + 50 * count:
        return ""
    if head.lstrip().lower().startswith(b"solid"):
        return "" if b"facet" in head else "has no triangles"
    if size < 84:
        return "is no STL file"
    return f"is no STL file: it has {size:,} bytes and claims {count:,} triangles" if count else "has no triangles"


def _collada(head: bytes, size: int) -> str:
    before, root, _ = head.partition(b"<COLLADA")
    return "" if root and b"<!DOCTYPE" not in before else "is no COLLADA file, or has a DOCTYPE"


def _obj(head: bytes, size: int) -> str:
    return "" if set(head) <= _TEXT else "is no OBJ file: it is not text"


def _ply(head: bytes, size: int) -> str:
    if not head.startswith(b"ply") or b"end_header" not in head:
        return "is no PLY file"
    claimed = sum(map(int, _ELEMENTS.findall(head)))
    return "" if claimed <= size else f"is no PLY file: it has {size:,} bytes and claims {claimed:,} elements"


def _glb(head: bytes, size: int) -> str:
    return "" if head.startswith(b"glTF") else "is no GLB file"


_FORMATS: Mapping[str, Callable[[bytes, int], str]] = {
    ".stl": _stl,
    ".dae": _collada,
    ".obj": _obj,
    ".ply": _ply,
    ".glb": _glb,
}
"""What looks at the beginning and the size of a file, by the ending of its name."""
FORMATS = (*_FORMATS,)
