"""Files of bodies: a URDF, or a xacro that expands to one, and the meshes that they name."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import open_regular
from rbxcompose.base.findings import DID_YOU_MEAN, Finding, Related, Span, kind, need
from rbxcompose.base.printable import plain
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from rbxcompose.manifest.files import library_root, project_of, shown_name
from rbxcompose.manifest.reader import read_source
from rbxcompose.manifest.tree import URDF_BYTES

if TYPE_CHECKING:
    from rbxcompose.domains.body.xacro import Expanded, XacroFile

BAD_MESH = kind("RBX2015")
LARGEST = 64_000_000  # [bytes]
_HEAD = 8_192  # [bytes] that are read
_SHOWN = 200
_MOST_PLACES = 8
_TEXT = {7, 8, 9, 10, 12, 13, 27, *range(32, 256)}
_ELEMENTS = re.compile(rb"^element\s+\w+\s+(\d{1,20})\s*$", re.MULTILINE)
PACKAGE = "package://"
LIBRARY = "rbxcompose"
"""The package of the shipped library, for `$(find rbxcompose)`."""


def mesh_mistakes(body: Body, meshes: Mapping[str, Path]) -> Iterator[Finding]:
    """Yield the meshes that cannot be read; `meshes` are the files that exist, by their names in the URDF."""
    for name, (first, *others) in mesh_places(body).items():
        if name in meshes and (words := mesh_problem(meshes[name])):
            yield BAD_MESH.at(first, f"the mesh '{plain(name, _SHOWN)}' {words}", related=named_also(others))


def mesh_places(body: Body) -> dict[str, list[Span]]:
    """Return the places that name each mesh, once each, in the order of the body."""
    found: dict[str, dict[Span, None]] = {}
    for link in body.links.values():
        for shape in (*link.visuals, *link.collisions):
            if shape.geometry.kind == "mesh":
                found.setdefault(shape.geometry.file, {})[shape.size_span or shape.span] = None
    return {name: [*spans] for name, spans in found.items()}


def named_also(places: Sequence[Span]) -> list[Related]:
    """Return the other places that name a mesh: the first of them, if there are many."""
    rest = len(places) - _MOST_PLACES
    related = [Related(span, "and here") for span in places[:_MOST_PLACES]]
    return related if rest <= 0 else [*related[:-1], Related(related[-1].span, f"and here, and {rest} more")]


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


MeshFault = tuple[str, str]
"""What is wrong with a mesh, as words that follow its name, and what to do."""


@dataclass(frozen=True, slots=True)
class BodyFile:
    """A file that describes a body. `span` is the place that names it; `arguments` are those of a xacro."""

    path: Path
    span: Span
    is_xacro: bool = False
    arguments: Mapping[str, str] = field(default_factory=dict, hash=False)
    packages: Mapping[str, Path] = field(default_factory=dict, hash=False)
    spans: Mapping[str, Span] = field(default_factory=dict, hash=False)
    """Places of the arguments."""

    @property
    def as_xacro(self) -> XacroFile:
        """Return what is to be expanded."""
        from rbxcompose.domains.body.xacro import XacroFile

        packages = {LIBRARY: library_root(), **self.packages}
        roots = [project_of(self.path), library_root()]
        return XacroFile(self.path, self.arguments, packages, roots, self.span, self.spans)

    def meshes(self, root: XmlElement) -> dict[str, Path]:
        """Return the mesh files that exist, by their names in the URDF; they lie in the project or in a package."""
        found = {name: mesh for name in set(mesh_names(root)) if (mesh := self._mesh(name)) is not None}
        ours = {name: mesh for name, mesh in found.items() if self._is_ours(mesh)}
        for name, mesh in ours.items():
            need(str(self.path.parent), str(mesh) if name.startswith(PACKAGE) else name.removeprefix("file://"))
        return ours

    def mesh_faults(self, root: XmlElement) -> dict[str, MeshFault]:
        """Return why meshes cannot be used, by name, of those for which more is known than that they do not exist."""
        missing = set(mesh_names(root)) - self.meshes(root).keys()
        return {name: fault for name in missing if (fault := self._fault(name))}

    def _fault(self, name: str) -> MeshFault | None:
        if (path := self._mesh(name)) is not None and not self._is_ours(path):
            return "is outside the project", f"put a copy into '{plain(shown_name(project_of(self.path)))}'"
        near = self._in_other_letters(name)
        return ("does not exist", f"{DID_YOU_MEAN} '{near}'? Capitals count") if near else None

    def _in_other_letters(self, name: str) -> str:
        place, _, own = name.rpartition("/")
        try:
            beside = self._place(f"{place}/x" if place else "x")
            files = sorted(beside.parent.iterdir()) if beside and self._is_ours(beside) else []
        except (OSError, ValueError):
            return ""
        near = next((file.name for file in files if file.name.casefold() == own.casefold()), "")
        return f"{place}/{near}" if near and place else near

    def _is_ours(self, path: Path) -> bool:
        return any(
            path.is_relative_to(package) for package in (project_of(self.path), library_root(), *self.packages.values())
        )

    def _mesh(self, name: str) -> Path | None:
        try:
            path = self._place(name)
            return path if path is not None and path.is_file() else None
        except (OSError, ValueError):  # a name too long for the system, a zero byte
            return None

    def _place(self, name: str) -> Path | None:
        package, _, inside = name.removeprefix(PACKAGE).partition("/")
        is_packaged = name.startswith(PACKAGE)
        folder = {LIBRARY: library_root(), **self.packages}.get(package) if is_packaged else self.path.parent
        return (folder / (inside if is_packaged else name.removeprefix("file://"))).resolve() if folder else None


@dataclass(frozen=True, slots=True)
class ReadFile:
    """The root and the text of a URDF, and what is to be said about the files that it was made of."""

    root: XmlElement = field(hash=False)
    text: str
    notes: tuple[Finding, ...] = field(default=(), hash=False)


def read_files(files: Sequence[BodyFile], sources: MutableMapping[str, str]) -> list[ReadFile | Finding]:
    """Return the URDF of each file, or why there is none; the texts of all that were read are added to `sources`."""
    expansions: Iterator[tuple[Expanded | Finding, Sequence[Path]]] = iter(())
    if xacros := [file.as_xacro for file in files if file.is_xacro]:
        from rbxcompose.domains.body.xacro import expand_all  # which few robots need

        expansions = iter(expand_all(xacros))
    return [_expanded(file, *next(expansions), sources) if file.is_xacro else _plain(file, sources) for file in files]


def _plain(file: BodyFile, sources: MutableMapping[str, str]) -> ReadFile | Finding:
    text, findings = read_source(file.path, shown_name(file.path), sources, URDF_BYTES, "a URDF file")
    if text is None or findings:
        return replace(findings[0], span=findings[0].span or file.span)
    root = read_urdf(text, shown_name(file.path))
    return root if isinstance(root, Finding) else ReadFile(root, text)


def _expanded(
    file: BodyFile, expanded: Expanded | Finding, used: Sequence[Path], sources: MutableMapping[str, str]
) -> ReadFile | Finding:
    for path in used:  # so that findings can show their lines
        read_source(path, shown_name(path), sources, URDF_BYTES, "a xacro file")
        need(str(file.path.parent), str(path))
    if isinstance(expanded, Finding):
        return expanded
    root = read_urdf(expanded.located, shown_name(file.path))
    return root if isinstance(root, Finding) else ReadFile(root, expanded.text, expanded.notes)


def mesh_names(element: XmlElement) -> Iterator[str]:
    """Yield the file name of every mesh below an element."""
    if element.name == "mesh":
        yield element.attributes.get("filename", "")
    for child in element.children:
        yield from mesh_names(child)
