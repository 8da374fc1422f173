"""Publish a recording again on a robot's bus, or show what is in it.

Messages come at the recorded intervals. Topics of the class `command` make a robot move: they are
left out unless `--topics` names them. So are topics that are being published now, unless `--over` mixes them, or
`--namespace` keeps them apart. With --alone, or if no robot is up, it brings a router of its own.

With --into, nothing is published: it runs one component of a run that `up --rate max --record` has recorded again, with
its recorded inputs, and compares its outputs with the recording. The settings are those of the run, or those of
--robot PATH. Exit codes: 0 the same, 1 a difference or findings.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rbxcompose.bus.names import resolve
from rbxcompose.cli.bus.entities import seconds
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.place import BusPlace, add_bus_options
from rbxcompose.cli.output.console import misused, refuse, tell
from rbxcompose.cli.project.robot_options import add_layer_options
from rbxcompose.cli.recordings.component_replay import run_again
from rbxcompose.cli.recordings.options import (
    add_selection_options,
    count_table,
    recover_in,
    selection_of,
    warn,
)
from rbxcompose.cli.recordings.replay_bus import replay_bus
from rbxcompose.cli.recordings.tap import Player
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import MOST_NAMES, Finding, Severity
from rbxcompose.printable import plain
from rbxcompose.qos import Qos
from rbxcompose.recording.codes import DAMAGED, NOT_REPLAYED, NOTHING, SENT_ALREADY, UNREADABLE
from rbxcompose.recording.files import PART
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.reader import NotARecordingError, RecordingReader
from rbxcompose.recording.schedule import playlist
from rbxcompose.recording.summary import RecordingSummary, summary_of
from rbxcompose.recording.topics import RecordedTopic, Selection, by_name, is_replayable
from rbxcompose.regular_files import NotRegularError, open_regular

_PAUSE = 0.05  # [s] before a recording restarts


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", type=Path, metavar="FILE", help="the recording")
    add_bus_options(parser)
    add_selection_options(parser)
    parser.add_argument("--rate", type=_rate, default=1.0, metavar="2x", help="faster or slower than it was")
    parser.add_argument("--from", type=seconds, default=0.0, dest="start", metavar="10s", help="skip everything before")
    parser.add_argument("--alone", action="store_true", help="on a router of its own, away from robots that are up")
    parser.add_argument("--namespace", type=_namespace, metavar="NAME", help="put it before all topics")
    parser.add_argument("--over", action="store_true", help="also topics that are being published now")
    parser.add_argument("--loop", action="store_true", help="start again at the end, until Ctrl-C")
    parser.add_argument(
        "--into",
        metavar="COMPONENT",
        help="run one component of a recorded run again, as it was or as in --robot PATH, and compare",
    )
    parser.add_argument("--write", type=Path, metavar="FILE", help="with --into: keep what it sends now")
    add_layer_options(parser)
    parser.add_argument("--info", action="store_true", help="only show topics, types, counts and duration")
    parser.add_argument("--json", action="store_true", help="with --info or --into: answer with one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Read the file once to learn its contents, then replay it."""
    if problem := _misused(arguments):
        return misused("replay", problem)
    path = arguments.path
    if path.parent.is_dir():
        recover_in(path.parent)
    if path.name.endswith(PART) and not path.exists():
        path = path.with_name(path.name.removesuffix(PART))
    try:
        if arguments.into is not None:
            with _opened(path) as reader:
                return run_again(arguments, path, reader)
        summary = _look_through(path)
        if arguments.info:
            tell(json.dumps(_fields(summary)) if arguments.json else _text(path, summary))
            return 0
        return _replay(arguments, path, summary)
    except NotDoneError as error:
        return refuse(error.finding)


def _misused(arguments: argparse.Namespace) -> str:
    """Return what is wrong with incompatible options."""
    layers = arguments.profile or arguments.overlays or arguments.sets or arguments.real
    if layers and not (arguments.into and arguments.robot):
        return "options that change the robot's file need --into and --robot PATH"
    if arguments.json and not (arguments.info or arguments.into):
        return "--json needs --info or --into"
    if arguments.alone and (arguments.router or arguments.robot):
        return "--alone has a bus of its own, so no robot and no router is named"
    return "--write needs --into" if arguments.write and not arguments.into else ""


def _look_through(path: Path) -> RecordingSummary:
    with _opened(path) as reader:
        summary = summary_of(reader.messages())
    if reader.damage:
        place = f"after {summary.messages:,} messages"
        warn(DAMAGED.at(None, f"'{plain(str(path))}' is damaged {place}: {reader.damage}"))
    return summary


@contextmanager
def _opened(path: Path) -> Iterator[RecordingReader]:
    try:
        with open_regular(path) as file:
            yield RecordingReader(file)
    except NotRegularError as error:
        raise NotDoneError(UNREADABLE.at(None, f"'{plain(str(path))}' is not a recording: it is not a file")) from error
    except OSError as error:
        reason = plain(error.strerror or str(error))
        raise NotDoneError(UNREADABLE.at(None, f"'{plain(str(path))}' cannot be read: {reason}")) from error
    except NotARecordingError as error:
        finding = UNREADABLE.at(None, f"'{plain(str(path))}' is not a recording: {error}")
        raise NotDoneError(finding) from error


def _replay(arguments: argparse.Namespace, path: Path, summary: RecordingSummary) -> int:
    topics = _chosen(summary, selection_of(arguments))
    if not topics or arguments.start > summary.duration:
        why = "none of the chosen topics can be replayed" if not topics else f"it lasts {summary.duration:.1f} s"
        return refuse(NOTHING.at(None, f"nothing of '{plain(str(path))}' is replayed: {why}"))
    with replay_bus(arguments) as place:
        if not arguments.over:
            with Guest(place) as looking:  # its router knows all; a guest that stays has to make its own links first
                sent = _sent_already(looking, topics, arguments.namespace or "")
            topics = [one for one in topics if one.name not in sent]
            if sent:
                finding = _left_out(sent)
                if not topics:
                    return refuse(finding)
                warn(replace(finding, severity=Severity.WARNING))
        return _replay_on(place, topics, arguments, path)


def _replay_on(place: BusPlace, topics: list[RecordedTopic], arguments: argparse.Namespace, path: Path) -> int:
    with Guest(place, stays=True) as guest, guest.interruptible():
        player = Player(guest, topics, arguments.namespace or "")
        player.wait_for_subscribers()
        tell(f"replaying {len(topics)} topics of {plain(str(path))}; Ctrl-C ends it")
        count = _play(path, player, topics, arguments, guest)
        while arguments.loop and _wait(guest.clock.now() + _PAUSE, guest):  # even if the recording has no duration
            count += _play(path, player, topics, arguments, guest)
    tell(f"replayed {count:,} messages")
    return 0


def _sent_already(guest: Guest, topics: list[RecordedTopic], namespace: str) -> list[str]:
    """Return the recorded names of topics that somebody publishes now."""
    given = {one.name for one in guest.graph().topics if one.givers}
    return list(dict.fromkeys(one.name for one in topics if f"{namespace}{one.name}" in given))


def _left_out(names: list[str]) -> Finding:
    rest = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    message = f"these topics are being published now: {plain(', '.join(names[:MOST_NAMES]))}{rest}"
    return SENT_ALREADY.at(None, message, help="'--namespace old' keeps them apart, '--over' mixes them")


def _chosen(summary: RecordingSummary, wanted: Selection) -> list[RecordedTopic]:
    """Return the topics to publish, and report which selected ones are left out."""
    topics = sorted((one for one in summary.counts if wanted.takes(one)), key=lambda one: one.name)
    unfit = [one.name for one in topics if not is_replayable(one)]
    commands = [one.name for one in topics if one.qos is Qos.COMMAND and not wanted.patterns]
    if unfit:
        warn(NOT_REPLAYED.at(None, f"topics that the bus cannot carry: {plain(', '.join(unfit))}"))
    if commands:
        names = plain(", ".join(commands))
        warn(NOT_REPLAYED.at(None, f"topics that make a robot move: {names}", help="'--topics NAME' replays them"))
    return [one for one in topics if one.name not in {*unfit, *commands}]


def _play(path: Path, player: Player, topics: list[RecordedTopic], arguments: argparse.Namespace, guest: Guest) -> int:
    """Publish the recording once and return the number of messages."""
    chosen = set(topics)
    count = 0
    start = guest.clock.now()
    with _opened(path) as reader:
        for due, message in playlist(reader.messages(), rate=arguments.rate, start=arguments.start):
            if not _wait(start + due, guest):
                break
            count += _put(player, message, chosen)
    return count


def _put(player: Player, message: Recorded, chosen: set[RecordedTopic]) -> int:
    if message.topic not in chosen:
        return 0
    player.put(message)
    return 1


def _wait(until: float, guest: Guest) -> bool:
    """Wait until a time of the guest's clock; return False if an interrupt came first."""
    return not guest.run(lambda: guest.is_interrupted, until - guest.clock.now())


def _text(path: Path, summary: RecordingSummary) -> str:
    head = f"{plain(str(path))}: {summary.messages:,} messages, {summary.duration:.3f} s"
    return f"{head}\n{count_table(summary.counts)}" if summary.counts else head


def _fields(summary: RecordingSummary) -> dict[str, object]:
    topics = [
        {"name": one.name, "type": one.type, "class": one.qos.value, "encoding": one.encoding, "messages": number}
        for one, number in sorted(by_name(summary.counts).items(), key=lambda item: (item[0].name, item[0].type))
    ]
    return {
        "messages": summary.messages,
        "start": summary.start,
        "end": summary.end,
        "duration": summary.duration,
        "topics": topics,
    }


def _namespace(text: str) -> str:
    """Read `old` or `/old/run`, as what stands before the name of a topic."""
    try:
        return resolve(text.strip("/"))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _rate(text: str) -> float:
    """Read `2x`."""
    try:
        rate = float(text.removesuffix("x"))
    except ValueError:
        rate = math.nan
    if not 0 < rate < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a rate; write '2x' or '0.5x'")
    return rate
