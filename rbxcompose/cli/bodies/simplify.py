"""`body simplify`."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from rbxcompose.atomic_files import replace_file
from rbxcompose.body.description import Description
from rbxcompose.body.extra import MissingLibraryError
from rbxcompose.body.mesh_files import FORMATS
from rbxcompose.body.simplification import LEAST_FACES, Scale, SimplifiedMesh, simplify
from rbxcompose.cli.bodies.actions import UNKNOWN, Actions, read, used
from rbxcompose.cli.bodies.mesh_names import UNSCALED, file_names, scales_of
from rbxcompose.cli.bodies.source import add_source_options, given_options
from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import misused, refuse, tell
from rbxcompose.findings import Finding, kind
from rbxcompose.manifest.files import find, shown_name
from rbxcompose.printable import plain

WOULD_REPLACE = kind("RBX2017")
_HEAD = ("mesh", "triangles", "bytes", "largest error", "mean error", "file")
_ABOUT = "write meshes with fewer triangles, as binary STL files, and tell how far they are from the originals"
_MORE = """The error is the distance from points of the original surface to the nearest point of the simplified one:
10,000 points, spread evenly with a fixed seed, for the mean, and also up to 10,000 of its corners for the largest. It
is in millimetres by the scale in the URDF; lengths of a bare STL or OBJ file count as metres. A mesh with many
borders may keep more triangles than are wanted; the table says so."""
_RATIO = 0.2


def add(actions: Actions) -> None:
    """Declare the action."""
    parser = actions.add_parser("simplify", help=_ABOUT, description=f"{_ABOUT[:1].upper()}{_ABOUT[1:]}.\n\n{_MORE}")
    add_source_options(parser, "; or a mesh: .stl, .obj or .dae")
    amount = parser.add_mutually_exclusive_group()
    words = f"how many of the triangles are left, at most 1 (default: {_RATIO}); each mesh keeps at least {LEAST_FACES}"
    amount.add_argument("--ratio", type=_ratio, default=_RATIO, metavar="R", help=words)
    amount.add_argument("--faces", type=_faces, metavar="N", help="how many triangles each mesh has at most")
    parser.add_argument("--mesh", action="append", default=[], metavar="NAME", help="only this mesh of the body")
    parser.add_argument("--out", required=True, metavar="DIR", help="the folder for the files")
    parser.add_argument("--force", action="store_true", help="replace files that exist")
    parser.set_defaults(do=_run)


def _ratio(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= 1.0:
        raise argparse.ArgumentTypeError(f"must be above 0 and at most 1, not '{text}'")
    return value


def _faces(text: str) -> int:
    if not text.isdecimal() or int(text) < LEAST_FACES:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least {LEAST_FACES}, not '{text}'")
    return int(text)


def _run(arguments: argparse.Namespace) -> int:
    """Simplify a bare mesh, or those of a body."""
    if arguments.path is not None and arguments.path.lower().endswith(FORMATS):
        path = find(arguments.path)
        if isinstance(path, Finding):
            return refuse(path)
        if option := next(given_options(arguments), "--mesh" if arguments.mesh else ""):
            return misused("body", f"{option} is for bodies: PATH is a mesh itself")
        return _written(arguments, {shown_name(path): path}, {shown_name(path): {UNSCALED}})
    return read(arguments, lambda same, found: used(same, found, _meshes_of))


def _meshes_of(arguments: argparse.Namespace, description: Description) -> int:
    chosen: dict[str, Path] = {}
    for wanted in arguments.mesh or description.meshes:
        found = {name: path for name, path in description.meshes.items() if wanted in (name, path.name)}
        if not found:
            message = f"the body has no mesh '{plain(wanted)}'"
            return refuse(UNKNOWN.misspelt(None, message, wanted, [*description.meshes], "meshes"))
        chosen |= found
    if not chosen:
        return misused("body", "the body has no meshes to simplify")
    return _written(arguments, chosen, scales_of(description.body, chosen))


def _written(arguments: argparse.Namespace, meshes: Mapping[str, Path], scales: Mapping[str, set[Scale]]) -> int:
    """Simplify the meshes, and write all or, if one of them is not possible, none; return the exit code."""
    folder = Path(arguments.out)
    files = {path: folder / name for path, name in file_names(sorted(set(meshes.values()))).items()}
    if not arguments.force and (there := [file for file in files.values() if file.exists()]):
        named = ", ".join(f"'{plain(shown_name(file.absolute()))}'" for file in there)
        return refuse(
            WOULD_REPLACE.at(None, f"there already is {named}", help="choose another folder, or say '--force'")
        )
    try:
        made = {
            name: simplify(path, name, scales[name], arguments.faces, arguments.ratio)
            for name, path in sorted(meshes.items())
        }
    except MissingLibraryError as error:
        return refuse(error.finding)
    except ValueError as error:
        return misused("body", str(error))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, mesh in made.items():
            replace_file(files[meshes[name]].resolve(), mesh.data)
    except OSError as error:
        return misused("body", f"'{folder}' cannot be written: {error.strerror}")
    tell(table([_HEAD, *(_row(name, mesh, files[meshes[name]]) for name, mesh in made.items())]))
    return 0


def _row(name: str, mesh: SimplifiedMesh, file: Path) -> Sequence[str]:
    sizes = f"{mesh.bytes[0]} -> {mesh.bytes[1]}"
    return name, counted(mesh), sizes, _millimetres(mesh.largest), _millimetres(mesh.mean), str(file)


def counted(mesh: SimplifiedMesh) -> str:
    """Return how many triangles there were and are, and whether that is not what was wanted."""
    before, after = mesh.triangles
    if mesh.wanted >= before:
        return f"{before}, copied"
    return f"{before} -> {after}{f', not {mesh.wanted}' if after > mesh.wanted else ''}"


def _millimetres(metres: float) -> str:
    return f"{metres * 1000:.3g} mm"
