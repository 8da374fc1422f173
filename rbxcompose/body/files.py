"""Files of bodies: a URDF, or a xacro that expands to one, and the meshes that they name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rbxcompose.body.xacro import expand
from rbxcompose.body.xml_reader import XmlElement, read_urdf
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

    def read(self, sources: MutableMapping[str, str]) -> tuple[XmlElement, str] | Finding:
        """Return the root and the text of the URDF; every file that was read is added to `sources`."""
        found = self._expanded(sources) if self.is_xacro else self._text(sources)
        if isinstance(found, Finding):
            return found
        text, located = found
        root = read_urdf(located, shown_name(self.path))
        return root if isinstance(root, Finding) else (root, text)

    def _text(self, sources: MutableMapping[str, str]) -> tuple[str, str] | Finding:
        text, findings = read_source(self.path, shown_name(self.path), sources, URDF_BYTES, "a URDF file")
        if text is None or findings:
            return replace(findings[0], span=findings[0].span or self.span)
        return text, text

    def _expanded(self, sources: MutableMapping[str, str]) -> tuple[str, str] | Finding:
        packages = {LIBRARY: library_root(), **self.packages}
        roots = [project_of(self.path), library_root()]
        expanded, files = expand(self.path, self.arguments, packages, roots, self.span)
        for file in files:  # so that findings can show their lines
            read_source(file, shown_name(file), sources, URDF_BYTES, "a xacro file")
        return expanded if isinstance(expanded, Finding) else (expanded.text, expanded.located)

    def meshes(self, root: XmlElement) -> dict[str, Path]:
        """Return the mesh files that exist, by their names in the URDF; they lie in the project or in a package."""
        roots = [project_of(self.path), library_root(), *self.packages.values()]
        found = {name: mesh for name in set(mesh_names(root)) if (mesh := self._mesh(name)) is not None}
        return {name: mesh for name, mesh in found.items() if any(mesh.is_relative_to(one) for one in roots)}

    def _mesh(self, name: str) -> Path | None:
        package, _, inside = name.removeprefix(PACKAGE).partition("/")
        is_packaged = name.startswith(PACKAGE)
        folder = {LIBRARY: library_root(), **self.packages}.get(package) if is_packaged else self.path.parent
        try:
            path = (folder / (inside if is_packaged else name.removeprefix("file://"))).resolve() if folder else None
            return path if path is not None and path.is_file() else None
        except (OSError, ValueError):  # a name too long for the system, a zero byte
            return None


def mesh_names(element: XmlElement) -> Iterator[str]:
    """Yield the file name of every mesh below an element."""
    if element.name == "mesh":
        yield element.attributes.get("filename", "")
    for child in element.children:
        yield from mesh_names(child)
