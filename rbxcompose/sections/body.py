"""The section `body`: the file that describes the robot's body."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import Field, model_validator

from rbxcompose.body.lint import lint
from rbxcompose.body.model import Body
from rbxcompose.body.urdf import read_body
from rbxcompose.body.xacro import expand
from rbxcompose.body.xml_reader import read_urdf
from rbxcompose.config import Config
from rbxcompose.findings import Finding, Span
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.files import project_of, resolve, shown_name
from rbxcompose.manifest.library import library_root
from rbxcompose.manifest.limits import URDF_BYTES
from rbxcompose.manifest.reader import UNREADABLE, read_source
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.manifest.tree import TreeNode, value_span
from rbxcompose.manifest.wanted_components import WantedComponent, Wiring
from rbxcompose.printable import plain

DESCRIPTION = "robot_description"
"""The component that a robot with a body runs."""
PACKAGE = "package://"
LIBRARY = "rbxcompose"  # the package of the shipped library, for `$(find rbxcompose)`


class BodyModel(Config):
    """What the robot looks like and how it moves: a URDF, or a xacro file that expands to one."""

    urdf: FileName | None = None
    """The URDF file, relative to this one; it is published unchanged on `robot_description`."""
    xacro: FileName | None = None
    """The xacro file, relative to this one; its expansion is published."""
    with_: dict[str, Any] = Field({}, alias="with")
    """Values of the xacro's arguments: texts, flags, and numbers in SI units."""
    packages: dict[str, str] = {}
    """Folders by the names of ROS packages, for `$(find NAME)` and `package://NAME`, relative to this file."""

    @model_validator(mode="after")
    def _one_file(self) -> BodyModel:
        if (self.urdf is None) == (self.xacro is None):
            raise ValueError("a body has either 'urdf' or 'xacro'")
        return self


@dataclass(frozen=True, slots=True)
class Description:
    """The description of the robot's body: its file, its URDF as text, and the links and joints in that."""

    path: Path
    text: str
    body: Body
    key: str  # `urdf` or `xacro`
    meshes: Mapping[str, Path]  # the mesh files that exist, by their names in the URDF


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that publishes the description."""
    if found := contents.of(body):
        yield WantedComponent(DESCRIPTION, DESCRIPTION, {"urdf": found.text}, ("body", found.key))


@section("body", BodyModel, order=30, brings=(DESCRIPTION,), components=_components)
def body(reading: Reading[BodyModel]) -> Description | None:
    """What the robot looks like and how it moves: links and joints, published for viewers and other programs.

    Example:
        body:
          urdf: robot.urdf                # beside this file, or a path from here
    """
    read, report = reading.whole(), reading.report
    if read is None or reading.node is None:
        return None
    packages = _packages(reading, reading.node, read)
    if isinstance(packages, Finding):
        report.add(packages)
        return None
    found = _urdf(reading, reading.node, read) if read.urdf else _xacro(reading, reading.node, read, packages)
    if isinstance(found, Finding):
        report.add(found)
        return None
    path, text, located, shown = found
    root = read_urdf(located, shown)
    if isinstance(root, Finding):
        report.add(root)
        return None
    made, findings = read_body(root)
    report.extend(findings)
    if findings:
        return None
    meshes = _meshes(made, path, packages)
    report.extend(lint(made, meshes))
    return Description(path, text, made, "urdf" if read.urdf else "xacro", meshes)


def _meshes(body: Body, file: Path, packages: Mapping[str, Path]) -> dict[str, Path]:
    """Return the mesh files that exist, by their names in the URDF; they lie in the project or in a package."""
    shapes = [shape for link in body.links.values() for shape in (*link.visuals, *link.collisions)]
    names = {shape.geometry.file for shape in shapes if shape.geometry.kind == "mesh"}
    roots = [project_of(file), *packages.values()]
    found = {name: mesh for name in names if (mesh := _mesh(name, file, packages)) is not None}
    return {name: mesh for name, mesh in found.items() if any(mesh.is_relative_to(root) for root in roots)}


def _mesh(name: str, file: Path, packages: Mapping[str, Path]) -> Path | None:
    package, _, inside = name.removeprefix(PACKAGE).partition("/")
    is_packaged = name.startswith(PACKAGE)
    folder = packages.get(package) if is_packaged else file.parent
    try:
        path = (folder / (inside if is_packaged else name.removeprefix("file://"))).resolve() if folder else None
        return path if path is not None and path.is_file() else None
    except (OSError, ValueError):  # a name too long for the system, a zero byte
        return None


_Found = tuple[Path, str, str, str]  # the file, its URDF, that with places, and the file's name in findings


def _file(reading: Reading[BodyModel], node: TreeNode, key: str, written: str) -> tuple[Path, Span, Path] | Finding:
    """Return the file that a key names, the place of the key's value, and the file that was written in."""
    span = value_span(node, (key,))
    writer = reading.contents.documents.writer(span, reading.contents.file)
    path = resolve(written, writer, span)
    return path if isinstance(path, Finding) else (path, span, writer)


def _urdf(reading: Reading[BodyModel], node: TreeNode, read: BodyModel) -> _Found | Finding:
    named = _file(reading, node, "urdf", read.urdf or "")
    if isinstance(named, Finding):
        return named
    path, span, _ = named
    shown = shown_name(path)
    text, findings = read_source(path, shown, reading.contents.documents.sources, URDF_BYTES, "a URDF file")
    if text is None or findings:
        return replace(findings[0], span=findings[0].span or span)
    return path, text, text, shown


def _xacro(
    reading: Reading[BodyModel], node: TreeNode, read: BodyModel, packages: Mapping[str, Path]
) -> _Found | Finding:
    named = _file(reading, node, "xacro", read.xacro or "")
    if isinstance(named, Finding):
        return named
    path, span, _ = named
    arguments = {name: _as_text(value) for name, value in read.with_.items()}
    expanded, files = expand(path, arguments, packages, [project_of(path), library_root()], span)
    for file in files:  # so that findings can show their lines
        read_source(file, shown_name(file), reading.contents.documents.sources, URDF_BYTES, "a xacro file")
    return expanded if isinstance(expanded, Finding) else (path, expanded.text, expanded.located, shown_name(path))


def _packages(reading: Reading[BodyModel], node: TreeNode, read: BodyModel) -> Mapping[str, Path] | Finding:
    found = {LIBRARY: library_root()}
    for name, written in read.packages.items():
        writer = reading.contents.documents.writer(value_span(node, ("packages", name)), reading.contents.file)
        folder = _folder(written, writer)
        if folder is None or not folder.is_relative_to(project_of(writer)):
            message = f"the folder of package '{plain(name, 60)}' is not in the project: '{plain(written)}'"
            return UNREADABLE.at(value_span(node, ("packages", name)), message)
        found[name] = folder
    return found


def _folder(written: str, writer: Path) -> Path | None:
    """Return the folder that a manifest names, None if there is none."""
    try:
        folder = (writer.resolve().parent / written).resolve()
        return folder if folder.is_dir() else None
    except (OSError, ValueError, RuntimeError):  # a name too long for the system, a zero byte, a circle of links
        return None


def _as_text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
