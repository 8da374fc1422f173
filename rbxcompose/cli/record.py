"""Record the topics of a robot to an MCAP file, until Ctrl-C.

Payloads stay as they are on the bus, with the definitions of their types, so Foxglove, Lichtblick and ROS 2 can read
them. A recorder that is killed loses at most half a second: the next one in its folder recovers its file.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from datetime import datetime
from pathlib import Path

from rbxcompose.cli.bus.entities import add_json_option, seconds
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.place import BusPlace, add_bus_options, find_place
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.recordings.options import (
    add_selection_options,
    count_table,
    recover_in,
    selection_of,
    warn,
)
from rbxcompose.cli.recordings.tap import Tap
from rbxcompose.cli.robots.lookup import NotDoneError, find_robot
from rbxcompose.printable import plain
from rbxcompose.recording.codes import LOST, UNWRITABLE
from rbxcompose.recording.files import ENDING
from rbxcompose.recording.recorder import Recorder, Split

_PAUSE = 0.02  # [s] between checks for messages
_SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([kMG])B")
_TIMES = {"k": 1e3, "M": 1e6, "G": 1e9}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_bus_options(parser)
    add_selection_options(parser)
    add_json_option(parser)
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="the file, else ROBOT-DATE-TIME.mcap")
    parser.add_argument("--for", type=seconds, dest="duration", metavar="30s", help="end after this time")
    parser.add_argument(
        "--split", type=_split, default=Split(), metavar="SIZE|TIME", help="start a new file after 500MB, or 10min"
    )


def run(arguments: argparse.Namespace) -> int:
    """Record, then report what was recorded."""
    try:
        place = find_place(arguments)
        path = _path(arguments)
        if path.parent.is_dir():
            recover_in(path.parent)
        return _record(arguments, place, path)
    except NotDoneError as error:
        return refuse(error.finding)


def _record(arguments: argparse.Namespace, place: BusPlace, path: Path) -> int:
    with Guest(place, stays=True) as guest, guest.interruptible():
        start = guest.clock.now()
        try:
            recorder = Recorder(path, start, arguments.split)
        except OSError as error:
            return refuse(UNWRITABLE.at(None, f"'{plain(str(path))}' cannot be written: {_reason(error)}"))
        tap = Tap(guest, selection_of(arguments))
        if not arguments.json:
            tell(f"recording to {recorder.paths[0]}; Ctrl-C ends it")
        end = math.inf if arguments.duration is None else start + arguments.duration
        return _write(recorder, tap, guest, end, is_json=arguments.json)


def _write(recorder: Recorder, tap: Tap, guest: Guest, end: float, *, is_json: bool) -> int:
    try:
        while not guest.is_interrupted and guest.clock.now() < end:
            guest.run(lambda: guest.is_interrupted, _PAUSE)
            for message in tap.take():
                recorder.add(message)
            recorder.keep(guest.clock.now())
        recorder.finish()
    except OSError as error:
        recorder.abandon()
        return refuse(UNWRITABLE.at(None, f"'{plain(str(recorder.paths[-1]))}' cannot be written: {_reason(error)}"))
    if tap.lost:
        warn(LOST.at(None, f"{tap.lost:,} messages came too fast to be recorded", help="choose fewer with '--topics'"))
    counts = recorder.counts
    if is_json:
        tell(
            json.dumps(
                {
                    "files": [str(path) for path in recorder.paths],
                    "messages": {topic.name: number for topic, number in counts.items()},
                }
            )
        )
        return 0
    paths = ", ".join(map(str, recorder.paths))
    tell(f"{count_table(counts)}\nrecorded {counts.total():,} messages to {paths}")
    return 0


def _path(arguments: argparse.Namespace) -> Path:
    wanted: Path | None = arguments.output
    if wanted is not None:
        return wanted if wanted.suffix == ENDING else wanted.with_name(wanted.name + ENDING)
    name = "recording" if arguments.router else find_robot(arguments.robot).path.name
    return Path(f"{name}-{datetime.now():%Y%m%d-%H%M%S}{ENDING}")


def _reason(error: OSError) -> str:
    return plain(error.strerror or str(error))


def _split(text: str) -> Split:
    """Read `500MB` or `10min`."""
    if found := _SIZE.fullmatch(text.strip()):
        return Split(size=max(1, int(float(found[1]) * _TIMES[found[2]])))
    try:
        return Split(time=seconds(text))
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(f"'{text}' is neither a size nor a time; write '500MB' or '10min'") from None
