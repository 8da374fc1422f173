"""Measure how a camera maps directions to pixels, by pictures of a board.

The board is a chessboard, or a page of `rbxcompose tags print`. Pictures are files, or come from a camera that runs.
The result is a file as ROS has it, for `calibration` of a camera.
Exit codes: 0 fine, 1 it cannot be measured, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from functools import partial
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import kind
from rbxcompose.base.printable import plain
from rbxcompose.base.units import LENGTH
from rbxcompose.commands import options
from rbxcompose.commands.console import NotDoneError, emit, misused, refuse
from rbxcompose.commands.guest import Guest, ReceivedMessage, visit, wanted
from rbxcompose.commands.lookup import add_bus_options
from rbxcompose.domains.body.meshes import MissingLibraryError, need
from rbxcompose.domains.vision.calibration import (
    CalibrationBoard,
    CalibrationError,
    CalibrationViews,
    Chessboard,
    TagSheet,
    calibration_text,
    picture_files,
)
from rbxcompose.domains.vision.commands.tags import PAPERS, numbers, one_of, tag_places
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, FAMILIES, with_margin
from rbxcompose.msgs.cdr import CdrError, decode
from rbxcompose.msgs.sensor_arrays import WrongPictureError, grey
from rbxcompose.msgs.sensor_msgs import Image

GROUP = "write"
NOT_MEASURED = kind("RBX3720")
ENOUGH = 20  # views
_TYPE = "sensor_msgs/msg/Image"
_COUNTS = re.compile(r"(\d{1,2})x(\d{1,2})")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    argument = options.argument
    pictures = argument("pictures", nargs="*", metavar="PICTURE", help="files; without any, it listens to --topic")
    topic = argument(
        "--topic", default="camera/image_raw", metavar="TOPIC", help="of a camera (default: camera/image_raw)"
    )
    chessboard = argument("--chessboard", type=counts, metavar="CxR", help="inner corners of a chessboard, such as 8x6")
    square = argument("--square", type=options.positive(LENGTH), metavar="S", help="the side of its squares")
    tags = argument("--tags", nargs="+", type=numbers, metavar="N|N-M", help="tags of a page of `tags print`")
    size = argument("--size", type=options.positive(LENGTH), default=0.1, metavar="S", help="of a tag (default: 10 cm)")
    family = argument("--family", type=one_of(FAMILIES), default=DEFAULT_FAMILY, metavar="F", help="their family")
    paper = argument("--paper", choices=tuple(PAPERS), default="a4", help="the paper of the page (default: a4)")
    count = argument(
        "--count", type=options.count, default=ENOUGH, metavar="N", help=f"views to take (default: {ENOUGH})"
    )
    out = options.out_option("the file (default: camera.yaml)", default="camera.yaml")
    shared = (topic, chessboard, square, tags, size, family, paper, count, out, options.add_json_option)
    bus = (partial(options.add_timeout_option, default="5s"), add_bus_options)
    words = "measure a camera by pictures of a board"
    options.add_actions(parser, (options.Subcommand("calibrate", words, _calibrate, (pictures, *shared, *bus)),))


run = options.run_action


def counts(text: str) -> tuple[int, int]:
    """Read `8x6`."""
    found = _COUNTS.fullmatch(text)
    columns, rows = (int(found[1]), int(found[2])) if found else (0, 0)
    if min(columns, rows) < 3:
        raise argparse.ArgumentTypeError(f"'{text}' is not like 8x6: the corners inside of a board, 3 or more each way")
    return columns, rows


def _calibrate(arguments: argparse.Namespace) -> int:
    try:
        need("camera", "cv2", extra="vision")
        board = _board(arguments)
    except MissingLibraryError as error:
        return refuse(error.finding)
    except ValueError as error:
        return misused("camera", str(error))
    views = CalibrationViews(board)
    if not arguments.pictures:
        return visit(arguments, lambda guest: _listen(guest, views, arguments))
    names = []
    for name, picture in picture_files([Path(path) for path in arguments.pictures]):
        if why := picture if isinstance(picture, str) else views.take(picture):
            sys.stderr.write(f"{plain(name)} is left out: {why}\n")
        else:
            names.append(name)
    try:
        return _end(views, names, arguments)
    except NotDoneError as error:
        return refuse(error.finding)


def _board(arguments: argparse.Namespace) -> CalibrationBoard:
    if bool(arguments.chessboard) == bool(arguments.tags):
        raise ValueError("give one board: --chessboard CxR with --square, or --tags with --size")
    if arguments.chessboard:
        if arguments.square is None:
            raise ValueError("a chessboard needs --square, the side of its squares")
        columns, rows = arguments.chessboard
        return Chessboard(columns, rows, arguments.square)
    wanted_tags = list(dict.fromkeys(number for found in arguments.tags for number in found))
    pages = tag_places(wanted_tags, arguments.family, arguments.size, arguments.paper)
    if len(pages) > 1:
        raise ValueError(f"these tags are on {len(pages)} pages: a board is one page")
    edge = (with_margin(arguments.size, arguments.family) - arguments.size) / 2
    places = {number: (x + edge, y + edge) for number, (x, y) in pages[0].items()}
    return TagSheet(arguments.family, arguments.size, places)


def _listen(guest: Guest, views: CalibrationViews, arguments: argparse.Namespace) -> int:
    """Take views from a camera that runs, until there are enough or an interrupt."""
    topic = wanted(guest.graph().topics, arguments.topic, "topic")
    if _TYPE not in topic.types:
        raise NotDoneError(NOT_MEASURED.at(None, f"'{topic.name}' has no pictures of the type {_TYPE}"))
    newest: list[ReceivedMessage] = []
    guest.listen(topic, newest.append)
    words = "hold the board still in all parts of the picture, near and far, tilted to all sides; Ctrl-C ends it"
    sys.stderr.write(f"{words}\n")
    said = ""

    def is_enough() -> bool:
        nonlocal said
        if newest:
            message = newest[-1]
            newest.clear()
            try:
                why = views.take(grey(decode(Image, message.arrival.payload)))
            except (CdrError, WrongPictureError) as error:
                why = str(error)
            if not why or why != said:
                across, down = views.spans
                seen = f"view {len(views.views)}: {across:.0%} of the width and {down:.0%} of the height"
                sys.stderr.write(f"{why or seen}\n")
            said = why
        return len(views.views) >= arguments.count or guest.is_interrupted

    with guest.interruptible():
        guest.run(is_enough)
    return _end(views, [f"view {number + 1}" for number in range(len(views.views))], arguments)


def _end(views: CalibrationViews, names: list[str], arguments: argparse.Namespace) -> int:
    try:
        found = views.calibrated()
    except CalibrationError as error:
        raise NotDoneError(NOT_MEASURED.at(None, str(error))) from error
    out = Path(arguments.out)
    try:
        replace_file(out.resolve(), calibration_text(found.camera).encode())
    except OSError as error:
        raise NotDoneError(NOT_MEASURED.at(None, f"'{out}' cannot be written: {error.strerror}")) from error
    camera, (focal, axis) = found.camera, found.known_to
    if arguments.json:
        data = {"file": str(out), "views": len(names), "miss": found.miss, "known_to": found.known_to}
        emit(json.dumps(data | {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}))
        return 0
    emit(
        f"wrote {out}: {camera.width} x {camera.height} pixels, by {len(names)} views\n"
        f"focal length {camera.fx:.1f} and {camera.fy:.1f}, known to {focal:.1f} px\n"
        f"axis at {camera.cx:.1f}, {camera.cy:.1f}, known to {axis:.1f} px\n"
        f"corners are off by {found.miss:.2f} px"
    )
    if found.doubtful:
        emit(f"these fit much worse than others: {', '.join(names[number] for number in found.doubtful)}")
    return 0
