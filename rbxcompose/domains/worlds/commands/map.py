"""Show the map on the bus of a robot, or save it as files of map_server.

It takes the newest map of the topic, whoever publishes it: a component, or a program for SLAM in ROS 2.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from functools import partial
from pathlib import Path

from rbxcompose.base.arrays import np
from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import kind
from rbxcompose.base.units import LENGTH, format_quantity
from rbxcompose.commands import options
from rbxcompose.commands.console import NotDoneError, emit, misused, refuse
from rbxcompose.commands.guest import Guest, ReceivedMessage, visit, wanted
from rbxcompose.commands.lookup import add_bus_options
from rbxcompose.commands.new_files import taken
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap, MapError, map_files
from rbxcompose.domains.worlds.world import grid_of
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.nav_msgs import OccupancyGrid

GROUP = "data"
ON_SYSTEM = options.BUS
FOR_ALL = ("show",)
NO_MAP = kind("RBX3641")
DEFAULT = "map"  # the name of a map
_TYPE = "nav_msgs/msg/OccupancyGrid"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    topic = options.argument("--topic", default="map", metavar="TOPIC", help="the topic of the map (default: map)")
    words = f"write NAME.yaml and NAME.pgm (default: {DEFAULT}, also in a folder)"
    out = options.out_option(words, metavar="NAME", default=DEFAULT)
    force = options.argument("--force", action="store_true", help="replace files that exist")
    shared = (topic, partial(options.add_timeout_option, default="5s"), add_bus_options, options.add_system_options)
    actions = (
        options.Subcommand("show", "show how large it is and what is known", _show, (*shared, options.add_json_option)),
        options.Subcommand("save", "write it as NAME.yaml and NAME.pgm", _save, (out, force, *shared)),
    )
    options.add_actions(parser, actions)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return visit(arguments, lambda guest: int(arguments.do(guest, arguments)))


def received_map(guest: Guest, name: str, timeout: float) -> GridMap:
    """Return the newest map that arrives within `timeout` [s].

    Raises:
        NotDoneError: if there is none, or it is no map.
    """
    topic = wanted(guest.graph().topics, name, "topic")
    if _TYPE not in topic.types:
        raise NotDoneError(NO_MAP.at(None, f"'{topic.name}' is of type {', '.join(topic.types)}, not {_TYPE}"))
    heard: list[ReceivedMessage] = []
    guest.listen(topic, heard.append)
    if not guest.run(lambda: bool(heard), timeout):
        help_text = "does it have one? 'rbxcompose topic show' lists who publishes"
        raise NotDoneError(NO_MAP.at(None, f"no map has arrived on '{topic.name}'", help=help_text))
    try:
        message = decode(OccupancyGrid, heard[-1].arrival.payload)
        if not len(message.data):
            raise MapError("it has no cells")
        grid = grid_of(message)
        return replace(grid, resolution=float(f"{grid.resolution:.7g}"))  # messages have it as float32
    except (CdrError, MapError, ValueError) as error:
        raise NotDoneError(NO_MAP.at(None, f"what arrived on '{topic.name}' is no map: {error}")) from error


def _show(guest: Guest, arguments: argparse.Namespace) -> int:
    grid = received_map(guest, arguments.topic, arguments.timeout)
    rows, columns = grid.cells.shape
    size = (columns * grid.resolution, rows * grid.resolution)
    occupied, unknown = float(np.mean(grid.cells >= SOLID)), float(np.mean(grid.cells < 0))
    at = grid.origin
    if arguments.json:
        origin = {"x": at.x, "y": at.y, "heading": at.heading}
        known = {"occupied": occupied, "unknown": unknown}
        data = {"resolution": grid.resolution, "cells": [columns, rows], "size": size, "origin": origin, **known}
        emit(json.dumps(data))
        return 0
    width, height, resolution = (format_quantity(round(metres, 4), LENGTH) for metres in (*size, grid.resolution))
    emit(f"{width} x {height}, {columns} x {rows} cells of {resolution}, from x {at.x:g} m, y {at.y:g} m")
    emit(f"{occupied:.1%} occupied, {unknown:.1%} unknown")
    return 0


def _save(guest: Guest, arguments: argparse.Namespace) -> int:
    base = base_of(arguments.out)
    files = [f"{base.name}.yaml", f"{base.name}.pgm"]
    if not arguments.force and (finding := taken(base.parent, files)) is not None:
        return refuse(replace(finding, help="choose another name with '--out', or say '--force'"))
    return write_map(received_map(guest, arguments.topic, arguments.timeout), base)


def base_of(out: str) -> Path:
    """Return where a map is written, without an ending: below that name, in a folder below its own."""
    name = out.removesuffix(".yaml").removesuffix(".pgm")
    return Path(name) / DEFAULT if not name or name.endswith("/") or Path(out).is_dir() else Path(name)


def write_map(grid: GridMap, base: Path) -> int:
    """Write the files of a map, each whole or not at all and the picture first; return the exit code."""
    made = map_files(grid, base.name)
    try:
        base.parent.mkdir(parents=True, exist_ok=True)
        for name in sorted(made):  # .pgm before .yaml, which names it
            replace_file((base.parent / name).resolve(), made[name])
    except OSError as error:
        return misused("map", f"'{base}' cannot be written: {error.strerror}")
    for name in sorted(made, reverse=True):
        emit(f"wrote {base.parent / name}")
    return 0
