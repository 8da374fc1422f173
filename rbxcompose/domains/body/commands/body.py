"""Show, check, draw and pose the body of a robot, or of a URDF or xacro file.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Finding, Report, Severity, Sources, kind
from rbxcompose.base.geometry import Vector3
from rbxcompose.base.printable import plain
from rbxcompose.commands import options
from rbxcompose.commands.console import FINDINGS, emit, has_colour, misused, refuse, table, write_report
from rbxcompose.commands.formats.json_ import as_data
from rbxcompose.commands.formats.text import render_text
from rbxcompose.commands.layout import graphviz
from rbxcompose.commands.lookup import add_bus_options
from rbxcompose.domains.body import source as bodies
from rbxcompose.domains.body.command_pose import sliders_of
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.files import FORMATS as MESHES
from rbxcompose.domains.body.meshes import LEAST_FACES, MissingLibraryError, Scale, SimplifiedMesh, simplify
from rbxcompose.domains.body.model import FLOATING, Body, BodyJoint, BodyLink
from rbxcompose.domains.body.picture import draw
from rbxcompose.manifest.files import find, shown_name

GROUP = "bodies and arms"
TEXT, PDF = "text", "pdf"
_FAMILY = "RBX20"  # codes of findings about bodies
WOULD_REPLACE = kind("RBX2017")
_HEAD = ("mesh", "triangles", "bytes", "largest error", "mean error", "file")
_SIMPLIFY = "write meshes with fewer triangles, as binary STL files, and report how far they are from the originals"
_SIMPLIFY_MORE = """\
The error is the distance from points of the original surface to the nearest point of the simplified one:
10,000 points, spread evenly with a fixed seed, for the mean, and also up to 10,000 of its corners for the largest. It
is in millimetres by the scale in the URDF; lengths of a bare STL or OBJ file count as metres. A mesh with many
borders may keep more triangles than are wanted; the table says so."""
_RATIO = 0.2
UNSCALED: Scale = (1.0, 1.0, 1.0)
_POSE = "move the joints of a running robot, by sliders in the terminal or with --joint"
_POSE_MORE = """\
It reads `robot_description` from the bus; it publishes `joint_states` ten times a second and at each change.

Sliders: up and down select a joint. Left and right move it by 1 deg or 1 cm, with shift, or page up and down, by ten
of these. 0, c and r move it to zero, to the centre of its range, or anywhere; Z, C and R do so with all. q quits."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    out = options.out_option("write it to this file")
    words = "lines, or a picture as a graph"
    form = options.argument("--format", choices=(TEXT, *FORMATS), default=TEXT, help=words)
    words = "write it to this file (default of a PDF: NAME.pdf)"
    out_or_pdf = options.out_option(words)
    picture = options.out_option("the picture (default: NAME.png)")
    words = "a joint's position, such as '35 deg'; a bare number is in rad or m"
    joint = options.argument("--joint", action="append", default=[], metavar="NAME=POSITION", help=words)
    tree = "show which link hangs on which, by which joint"
    check = "report what is wrong with the body alone: findings RBX20.., or the errors that keep it from being read"
    source = bodies.add_source_options
    table: tuple[tuple[str, str, bodies.Do, tuple[options.Declare, ...]], ...] = (
        ("show", "list links and joints with masses and limits", bodies.using(_show), (source,)),
        ("tree", tree, bodies.using(_tree), (source, form, out_or_pdf)),
        ("check", check, bodies.reading(_check), (source, options.add_json_option)),
        ("expand", "print the URDF, with nothing of xacro left", bodies.using(_expand), (source, out)),
        ("picture", "draw it as a PNG", bodies.using(_picture), (source, picture, joint)),
        ("simplify", _SIMPLIFY, _run, (_add_simplify_options,)),
        ("pose", _POSE, _pose, (_add_pose_options,)),
    )
    more = {"simplify": _SIMPLIFY_MORE, "pose": _POSE_MORE}
    options.add_actions(
        parser,
        (
            options.Subcommand(
                name, words, do, own, f"{words[:1].upper()}{words[1:]}.\n\n{more[name]}" if name in more else words
            )
            for name, words, do, own in table
        ),
    )


run = options.run_action


def _show(arguments: argparse.Namespace, description: Description) -> int:
    body = description.body
    emit(f"{extent_of(body)}\n")
    emit(table([LINKS, *links_of(body)]))
    emit("")
    emit(table([JOINTS, *joints_of(body)]))
    return 0


def _tree(arguments: argparse.Namespace, description: Description) -> int:
    content = _drawn(arguments.format, description)
    if arguments.out is not None:
        return bodies.write(Path(arguments.out), content)
    if arguments.format == PDF:
        return bodies.write(bodies.file_of(arguments, description, ".pdf"), content)
    emit(content.decode().rstrip("\n"))
    return 0


def _drawn(form: str, description: Description) -> bytes:
    if form == TEXT:
        return "".join(f"{line}\n" for line in tree_of(description.body)).encode()
    return draw_graph(description.body, form)


def _check(arguments: argparse.Namespace, found: bodies.DescribedBody) -> int:
    report = about_body(found, arguments.path)
    if found.description is None:
        return _refused(report, found.sources, arguments.json)
    body = found.description.body
    if arguments.json:
        emit(json.dumps(_data(body, report, found.sources), ensure_ascii=False))
    else:
        emit(f"{_findings(report, found.sources)}{summary_of(body, report)}")
    return FINDINGS if report.has_errors else 0


def about_body(found: bodies.DescribedBody, path: str) -> Report:
    """Return the findings about the body; if it could not be read for another reason, all errors."""
    own = Report([finding for finding in found.report if finding.code.startswith(_FAMILY)])
    if found.description is None and not own.has_errors:
        own.extend(finding for finding in found.report if finding.severity is Severity.ERROR)
        if not own.has_errors:
            own.add(bodies.no_body(path))
    return own


def summary_of(body: Body, report: Report) -> str:
    """Return a line: how large the body is, and how many errors and warnings it has."""
    errors, warnings = _counts(report)
    counted = f"{errors} error{'' if errors == 1 else 's'}, {warnings} warning{'' if warnings == 1 else 's'}"
    return f"{extent_of(body)}: {counted}"


def _findings(report: Report, sources: Sources) -> str:
    """Return the findings as `check` writes them, without its last line: the summary counts them, too."""
    text = render_text(report, sources, has_colour(sys.stdout))
    return "".join(text.splitlines(keepends=True)[:-1])


def _refused(report: Report, sources: Sources, as_json: bool) -> int:
    """Tell why there is no body; the document for JSON is written as for any command that fails."""
    if as_json:
        write_report(report, sources)
    else:
        emit(render_text(report, sources, has_colour(sys.stdout)).rstrip("\n"))
    return FINDINGS


def _data(body: Body, report: Report, sources: Sources) -> dict[str, object]:
    errors, warnings = _counts(report)
    return {
        "links": len(body.links),
        "joints": len(body.moving),
        "mass": mass_of(body),
        "errors": errors,
        "warnings": warnings,
        "findings": [as_data(finding, sources) for finding in report],
    }


def _counts(report: Report) -> tuple[int, int]:
    errors = sum(finding.severity is Severity.ERROR for finding in report)
    return errors, sum(1 for _ in report) - errors


def _expand(arguments: argparse.Namespace, description: Description) -> int:
    if arguments.out is None:
        emit(description.published.rstrip("\n"))
        return 0
    return bodies.write(Path(arguments.out), description.published.encode())


def _picture(arguments: argparse.Namespace, description: Description) -> int:
    body = description.body
    try:
        positions = dict(_position(body, written) for written in arguments.joint)
        picture = draw(body, positions, description.meshes)
    except ValueError as error:
        return misused("body", str(error))
    except MissingLibraryError as error:
        return refuse(error.finding)
    return bodies.write(bodies.file_of(arguments, description, ".png"), picture)


def _position(body: Body, written: str) -> tuple[str, float]:
    name, _, value = written.partition("=")
    slider = next((candidate for candidate in sliders_of(body) if candidate.name == name), None)
    if slider is None:
        raise ValueError(f"there is no moving joint '{name}': {', '.join(joint.name for joint in body.moving)}")
    return name, slider.read(value)


def _add_simplify_options(parser: argparse.ArgumentParser) -> None:
    bodies.add_source_options(parser, "; or a mesh: .stl, .obj or .dae")
    amount = parser.add_mutually_exclusive_group()
    words = f"how many of the triangles are left, at most 1 (default: {_RATIO}); each mesh keeps at least {LEAST_FACES}"
    amount.add_argument("--ratio", type=_ratio, default=_RATIO, metavar="R", help=words)
    amount.add_argument("--faces", type=_faces, metavar="N", help="how many triangles each mesh has at most")
    parser.add_argument("--mesh", action="append", default=[], metavar="NAME", help="only this mesh of the body")
    options.out_option("the folder for the files", metavar="DIR", required=True)(parser)
    parser.add_argument("--force", action="store_true", help="replace files that exist")


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
    if arguments.path is not None and arguments.path.lower().endswith(MESHES):
        path = find(arguments.path)
        if isinstance(path, Finding):
            return refuse(path)
        if option := next(bodies.given_options(arguments), "--mesh" if arguments.mesh else ""):
            return misused("body", f"{option} is for bodies: PATH is a mesh itself")
        return _written(arguments, {shown_name(path): path}, {shown_name(path): {UNSCALED}})
    return bodies.read(arguments, lambda same, found: bodies.used(same, found, _meshes_of))


def _meshes_of(arguments: argparse.Namespace, description: Description) -> int:
    chosen: dict[str, Path] = {}
    for wanted in arguments.mesh or description.meshes:
        found = {name: path for name, path in description.meshes.items() if wanted in (name, path.name)}
        if not found:
            message = f"the body has no mesh '{plain(wanted)}'"
            return refuse(bodies.UNKNOWN.misspelt(None, message, wanted, [*description.meshes], "meshes"))
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
    emit(table([_HEAD, *(_row(name, mesh, files[meshes[name]]) for name, mesh in made.items())]))
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


_WAYS: Sequence[Callable[[Path], str]] = (
    lambda path: path.stem,
    lambda path: f"{path.parent.name}_{path.stem}",
    lambda path: f"{path.parent.name}_{path.stem}_{path.suffix[1:]}",
)


def file_names(paths: Sequence[Path]) -> dict[Path, str]:
    """Return a name that ends in `.stl` for each file, all of them different, and the shortest that are."""
    for way in _WAYS:
        names = [way(path) for path in paths]
        if len({name.lower() for name in names}) == len(paths):
            break
    else:
        names = [f"{number}_{path.stem}" for number, path in enumerate(paths, 1)]
    return {path: f"{name}.stl" for path, name in zip(paths, names, strict=True)}


def scales_of(body: Body, names: Collection[str]) -> dict[str, set[Scale]]:
    """Return the scales of each mesh that a body uses, by its name in the URDF."""
    found: dict[str, set[Scale]] = {name: set() for name in names}
    for link in body.links.values():
        for shape in (*link.visuals, *link.collisions):
            if shape.geometry.file in found:
                found[shape.geometry.file].add(shape.geometry.size)
    return {name: scales or {UNSCALED} for name, scales in found.items()}


def _add_pose_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", metavar="ROBOT|PATH", help="the robot, by name or file")
    words = "publish this position and end: 0.6 (rad or m), '35 deg', '5 cm'; no terminal is needed"
    parser.add_argument("--joint", action="append", default=[], metavar="NAME=POSITION", help=words)
    words = "publish the positions of --joint for this long (default: once)"
    parser.add_argument("--duration", type=options.seconds, metavar="T", help=words)
    parser.add_argument("--topic", metavar="TOPIC", help="the topic with the URDF (default: robot_description)")
    options.add_timeout_option(parser, "2s")
    add_bus_options(parser)


def _pose(arguments: argparse.Namespace) -> int:
    from rbxcompose.domains.body.command_pose import pose  # imports the bus, which no other action needs

    return pose(arguments)


LINKS = ("link", "on", "by", "mass", "shapes")
JOINTS = ("joint", "type", "from", "to", "effort", "speed")
FORMATS = ("svg", "pdf")
_MOVES = 'color="#1f6feb" fontcolor="#1f6feb" penwidth=2.2'
_FIXED = 'color="#6e7781" fontcolor="#6e7781"'
_FLOATS = f"{_FIXED} style=dashed"
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def extent_of(body: Body) -> str:
    """Return how many links and moving joints a body has, and its mass, in words."""
    links, joints = len(body.links), len(body.moving)
    joints_words = "1 joint that moves" if joints == 1 else f"{joints} joints that move"
    return f"{links} link{'' if links == 1 else 's'}, {joints_words}, {mass_of(body):.4g} kg"


def mass_of(body: Body) -> float:
    """Return the mass of all links [kg]."""
    return sum(link.inertial.mass for link in body.links.values() if link.inertial)


def links_of(body: Body) -> Iterator[tuple[str, ...]]:
    """Yield a row of `LINKS` for each link, the root first."""
    for name, _ in body.walk():
        link, above = body.links[name], body.joint_above.get(name)
        mass = f"{link.inertial.mass:.4g} kg" if link.inertial else ""
        yield name, above.parent if above else "", above.name if above else "", mass, shapes_of(link)


def shapes_of(link: BodyLink) -> str:
    """Return what a link looks like, in words."""
    return ", ".join(visual.geometry.file or visual.geometry.kind for visual in link.visuals)


def joints_of(body: Body) -> Iterator[tuple[str, ...]]:
    """Yield a row of `JOINTS` for each joint that moves."""
    for joint in body.joints.values():
        if joint.moves:
            limits = joint.limits
            turns = joint.kind != "prismatic"
            lower, upper = (limits.lower, limits.upper) if limits and joint.kind != "continuous" else (None, None)
            yield (
                joint.name,
                f"{joint.kind}, mimics {joint.mimic.joint}" if joint.mimic else joint.kind,
                _amount(lower, "deg" if turns else "m"),
                _amount(upper, "deg" if turns else "m"),
                _amount(limits.effort if limits else None, "Nm" if turns else "N"),
                _amount(limits.velocity if limits else None, "deg/s" if turns else "m/s"),
            )


def tree_of(body: Body) -> Iterator[str]:
    """Yield a line for each link, indented by its depth, with the joint that it hangs on."""
    for name, depth in body.walk():
        joint = body.joint_above.get(name)
        yield f"{'  ' * depth}{name}{f'  ({_hinge(joint)})' if joint else ''}"


def _hinge(joint: BodyJoint) -> str:
    return joint.name if joint.kind == "fixed" else f"{joint.name}: {joint.kind}"


def _amount(value: float | None, unit: str) -> str:
    if value is None:
        return ""
    return f"{math.degrees(value):.4g} {unit}" if unit.startswith("deg") else f"{value:.4g} {unit}"


def draw_graph(body: Body, form: str) -> bytes:
    """Return the graph of a body in one of `FORMATS`.

    Raises:
        NotDoneError: if Graphviz is not installed.
    """
    drawn: bytes = graphviz().AGraph(string=body_dot(body)).draw(format=form, prog="dot")
    return drawn


def body_dot(body: Body) -> str:
    """Return the graph in DOT: links as boxes, joints as arrows; those that move are blue and thick."""
    return "".join(f"{line}\n" for line in _lines(body))


def _lines(body: Body) -> Iterator[str]:
    numbers = {name: f"n{number}" for number, (name, _) in enumerate(body.walk())}
    yield f"digraph {_label(body.name)} {{"
    yield '  graph [rankdir=TB fontname="sans-serif" nodesep=0.3 ranksep=0.6]'
    yield '  node [fontname="sans-serif" fontsize=11 shape=box style=rounded]'
    yield '  edge [fontname="sans-serif" fontsize=9]'
    for name, key in numbers.items():
        yield f"  {key} [label={_label(name)}]"
        for joint in body.joints_below[name]:
            yield f"  {key} -> {numbers[joint.child]} [label={_label(joint.name, *_words(joint))} {_style(joint)}]"
    yield "}"


def _words(joint: BodyJoint) -> list[str]:
    """Return the type of a joint, with its axis if it has one, and which joint it follows."""
    if not joint.moves:
        return [joint.kind]
    words = [f"{joint.kind}, {axis_words(joint.axis)}"]
    return [*words, f"mimics {joint.mimic.joint}"] if joint.mimic else words


def axis_words(axis: Vector3) -> str:
    """Return an axis in words: "z", "-y", or its three numbers."""
    for name, along in _AXES.items():
        for sign, factor in (("", 1.0), ("-", -1.0)):
            if all(abs(a - factor * b) < 1e-3 for a, b in zip(axis, along, strict=True)):
                return f"{sign}{name}"
    return " ".join(f"{value:.3g}" for value in axis)


def _style(joint: BodyJoint) -> str:
    return _MOVES if joint.moves else _FLOATS if joint.kind in FLOATING else _FIXED


def _label(*lines: str) -> str:
    """Return lines as a text in DOT, whose backslashes and entities would mean something else."""
    escaped = (plain(line).replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"') for line in lines)
    return '"' + "\\n".join(escaped) + '"'
