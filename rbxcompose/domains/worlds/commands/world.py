"""Show what is in a world, by its file or a robot in it, and draw it from above.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Finding, Report, Span, kind
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.printable import plain
from rbxcompose.base.units import ANGLE, LENGTH, TIME, format_quantity
from rbxcompose.commands import options
from rbxcompose.commands.console import NotDoneError, ReportedError, emit, misused, refuse, table, write_report
from rbxcompose.commands.targets import add_layer_options, compiled, robot_path
from rbxcompose.compiler.systems.neighbours import outlines_of
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.domains.body.meshes import MissingLibraryError
from rbxcompose.domains.worlds.picture import png_of, svg_of
from rbxcompose.domains.worlds.sections.world import world
from rbxcompose.domains.worlds.shapes import WorldBox, WorldCylinder, WorldMesh, WorldShape
from rbxcompose.domains.worlds.world import no_walls
from rbxcompose.domains.worlds.world_file import WORLD, WorldFile, WorldObjectModel, read_world
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.files import find, shown_name
from rbxcompose.sdk.capabilities import Outline

GROUP = "look"
NO_WORLD = kind("RBX3640")
ROBOT_COLOUR = "orange"
PNG, SVG = ".png", ".svg"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    words = "the file of a world, or rbx:worlds/NAME; or a robot or system in one; without it, the only robot"
    path = options.argument("path", nargs="?", metavar="FILE|ROBOT", help=words)
    out = options.out_option("the picture, .png or .svg (default: NAME.png)")
    show = "list what is in it: its map, objects, spawn poses and places"
    actions = (
        options.Subcommand("show", show, _show, (path, add_layer_options, options.add_json_option)),
        options.Subcommand("picture", "draw it from above", _picture, (path, add_layer_options, out)),
    )
    options.add_actions(parser, actions)


run = options.run_action


def world_named(arguments: argparse.Namespace) -> WorldFile:
    """Return the world that a path names: its file, or that of a robot in it.

    Raises:
        NotDoneError: if there is none.
        ReportedError: if it has errors, which are reported.
    """
    written = arguments.path
    if written is not None and options.is_system(written):
        return _world_of_system(written, arguments)
    if written is not None and (file := _world_file(written)) is not None:
        report, sources = Report(), dict[str, str]()
        found = read_world(file, Documents(report, sources), Span(shown_name(file), 1, 1, 1, 1))
    else:
        compilation = compiled(path := robot_path(written), arguments)
        report, sources = compilation.report, compilation.sources
        around = compilation.robot.manifest.contents.of(world) if compilation.robot else None
        found = around.file if around else None
        if found is None and not report.has_errors:
            words = f"the robot '{plain(shown_name(Path(path)))}' is in no world"
            raise NotDoneError(NO_WORLD.at(None, words, help="name one with '--world FILE', or the file itself"))
    if found is not None:  # nothing else that is wrong with a robot concerns its world
        report = Report([one for one in report if one.span is not None and one.span.file == found.source])
    if found is None or report.has_errors:
        write_report(report, sources)
        raise ReportedError
    return found


def _world_of_system(path: str, arguments: argparse.Namespace) -> WorldFile:
    """Return the world that robots of a system share, with these where they begin."""
    system = compile_system(path, environment=os.environ, profiles=arguments.profile)
    write_report(system.report, system.sources)
    if system.report.has_errors:
        raise ReportedError
    outlines = outlines_of(system.robots)
    around = [found for name in outlines if (found := system.robots[name].robot.manifest.contents.of(world))]
    if not around:
        words = f"the robots of '{plain(system.name)}' share no world"
        raise NotDoneError(NO_WORLD.at(None, words, help="give it a 'world', and a 'spawn' to each robot"))
    robots = {name: _standing(outline) for name, outline in outlines.items()}
    return replace(around[0].file, objects={**around[0].file.objects, **robots})


def _standing(outline: Outline) -> WorldObjectModel:
    x, y, heading, radius, height = outline
    cylinder = {"radius": radius, "length": height}
    at = {"x": x, "y": y, "heading": f"{heading!r} rad"}
    return WorldObjectModel.model_validate({"cylinder": cylinder, "at": at, "colour": ROBOT_COLOUR})


def _world_file(written: str) -> Path | None:
    """Return the file of a world that a path names, maybe without its ending; None if it names something else."""
    for path in (written, f"{written}.yaml"):
        found = find(path)
        if not isinstance(found, Finding) and options.kind_of(found) == WORLD:
            return found
    return None


def _show(arguments: argparse.Namespace) -> int:
    found = world_named(arguments)
    if arguments.json:
        emit(json.dumps(data_of(found)))
        return 0
    emit("\n\n".join(block for block in _blocks(found) if block))
    return 0


def _blocks(found: WorldFile) -> Iterator[str]:
    yield f"{found.name}: {_about_map(found)}"
    shapes = [(thing.placed(name), thing.colour, thing.shape or "") for name, thing in found.objects.items()]
    things = [
        (shape.name, *_solid(shape, word), _pose(shape.pose_at(0.0)), _path(shape), at) for shape, at, word in shapes
    ]
    yield _listed(("object", "kind", "size", "at", "path", "colour"), things)
    yield _listed(("spawn", "at"), [(name, _pose(pose)) for name, pose in found.spawn.items()])
    rows = [
        (place.name, _pose(Pose2(place.x, place.y, place.heading)), place.colour) for place in found.places.values()
    ]
    yield _listed(("place", "at", "colour"), rows)


def _listed(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return table([head, *rows]) if rows else ""


def _about_map(found: WorldFile) -> str:
    if found.map is None:
        return "without walls"
    rows, columns = found.grid.cells.shape
    width, height = (_metres(count * found.grid.resolution) for count in (columns, rows))
    cells = f"{columns} x {rows} cells of {_metres(found.grid.resolution)}"
    return f"{width} x {height}, {cells}, from {shown_name(found.map)}"


def _solid(shape: WorldShape, word: str) -> tuple[str, str]:
    kind, size = _kind_and_size(shape)
    if kind == "cylinder":
        return word or kind, f"radius {_metres(size[0])}, {_metres(size[1])} high"
    return kind, " x ".join(map(_metres, size))


def _kind_and_size(shape: WorldShape) -> tuple[str, tuple[float, ...]]:
    """Return the kind of a shape and its sides, or its radius and height [m]."""
    match shape.solid:
        case WorldBox(size=size):
            return "box", size
        case WorldCylinder(radius=radius, height=height):
            return "cylinder", (radius, height)
        case WorldMesh(parts=parts):
            corners = [corner for _, hull in parts for corner in hull.corners]
            wide, deep, _ = (max(along) - min(along) for along in zip(*corners, strict=True))
            return "mesh", (wide, deep, shape.solid.height)
    raise TypeError(f"'{shape.name}' is a part of a shape")


def _path(shape: WorldShape) -> str:
    if shape.path is None:
        return ""
    again = ", again and again" if shape.path.repeats else ""
    return f"{len(shape.path.points)} points in {format_quantity(shape.path.points[-1][0], TIME)}{again}"


def _pose(pose: Pose2) -> str:
    return f"{_metres(pose.x)}, {_metres(pose.y)}, {format_quantity(pose.heading, ANGLE)}"


def _metres(value: float) -> str:
    return format_quantity(round(value, 4), LENGTH)


def data_of(found: WorldFile) -> dict[str, object]:
    """Return all that `show` lists as plain data, in SI units."""
    grid = found.grid
    rows, columns = grid.cells.shape
    about = {
        "file": str(found.map),
        "resolution": grid.resolution,
        "cells": [columns, rows],
        "size": [columns * grid.resolution, rows * grid.resolution],
        "origin": _plain(grid.origin),
    }
    return {
        "name": found.name,
        "map": None if grid is no_walls() else about,
        "objects": {name: _object(thing.placed(name), thing.colour) for name, thing in found.objects.items()},
        "spawn": {name: _plain(pose) for name, pose in found.spawn.items()},
        "places": {
            name: {**_plain(Pose2(place.x, place.y, place.heading)), "colour": place.colour}
            for name, place in found.places.items()
        },
    }


def _object(shape: WorldShape, colour: str) -> Mapping[str, object]:
    kind, size = _kind_and_size(shape)
    path = {"points": shape.path.points, "repeats": shape.path.repeats} if shape.path else None
    return {"kind": kind, "size": size, "at": _plain(shape.pose), "z": shape.z, "path": path, "colour": colour}


def _plain(pose: Pose2) -> dict[str, float]:
    return {"x": pose.x, "y": pose.y, "heading": pose.heading}


def _picture(arguments: argparse.Namespace) -> int:
    if arguments.out is not None and not arguments.out.endswith((PNG, SVG)):
        return misused("world", f"a picture ends in {PNG} or {SVG}, unlike '{arguments.out}'")
    found = world_named(arguments)
    out = Path(arguments.out or f"{found.name}{PNG}")
    try:
        data = png_of(found) if out.suffix == PNG else svg_of(found).encode()
        replace_file(out.resolve(), data)
    except MissingLibraryError as error:
        return refuse(error.finding)
    except OSError as error:
        return misused("world", f"'{out}' cannot be written: {error.strerror}")
    emit(f"wrote {out}")
    return 0
