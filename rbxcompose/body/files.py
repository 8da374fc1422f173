"""Files of bodies: a URDF, or a xacro that expands to one, and the meshes that they name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from dataclasses import field, replace
from pathlib import Path

from rbxcompose.body.xacro import Expanded, XacroFile, expand_all
from rbxcompose.body.xml_reader import XmlElement, read_urdf
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Span
from rbxcompose.manifest.files import project_of, shown_name
from rbxcompose.manifest.library import library_root
from rbxcompose.manifest.limits import URDF_BYTES
from rbxcompose.manifest.reader import read_source

PACKAGE = "package://"
LIBRARY = "rbxcompose"
"""The package of the shipped library, for `$(find rbxcompose)`."""


@dataclass(frozen=True, slots=True)
class BodyFile:
    """A file that describes a body. `span` is the place that names it; `arguments` are those of a xacro."""

    path: Path
    span: Span
    is_xacro: bool = False
    arguments: Mapping[str, str] = field(default_factory=dict)
    packages: Mapping[str, Path] = field(default_factory=dict)
    spans: Mapping[str, Span] = field(default_factory=dict)
    """Places of the arguments."""

    @property
    def as_xacro(self) -> XacroFile:
        """Return what is to be expanded."""
        packages = {LIBRARY: library_root(), **self.packages}
        roots = [project_of(self.path), library_root()]
        return XacroFile(self.path, self.arguments, packages, roots, self.span, self.spans)

    def meshes(self, root: XmlElement) -> dict[str, Path]:
        """Return the mesh files that exist, by their names in the URDF; they lie in the project or in a package."""
        found = {name: mesh for name in set(mesh_names(root)) if (mesh := self._mesh(name)) is not None}
        return {name: mesh for name, mesh in found.items() if self._is_ours(mesh)}

    def meant_meshes(self, root: XmlElement) -> dict[str, str]:
        """Return, for each mesh that is not there, the name of a file that differs only in its capitals."""
        missing = set(mesh_names(root)) - self.meshes(root).keys()
        return {name: near for name in missing if (near := self._in_other_letters(name))}

    def _in_other_letters(self, name: str) -> str:
        place, _, own = name.rpartition("/")
        try:
            beside = self._place(f"{place}/x" if place else "x")
            files = sorted(beside.parent.iterdir()) if beside and self._is_ours(beside) else []
        except (OSError, ValueError):
            return ""
        near = next((one.name for one in files if one.name.casefold() == own.casefold()), "")
        return f"{place}/{near}" if near and place else near

    def _is_ours(self, path: Path) -> bool:
        return any(path.is_relative_to(one) for one in (project_of(self.path), library_root(), *self.packages.values()))

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

    root: XmlElement
    text: str
    notes: tuple[Finding, ...] = ()


def read_files(files: Sequence[BodyFile], sources: MutableMapping[str, str]) -> list[ReadFile | Finding]:
    """Return the URDF of each file, or why there is none; the texts of all that were read are added to `sources`."""
    xacros = [file for file in files if file.is_xacro]
    expansions = iter(expand_all([file.as_xacro for file in xacros]) if xacros else ())
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
