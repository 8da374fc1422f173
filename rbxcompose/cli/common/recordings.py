"""What `record` and `replay` share beside the bus: options, findings, tables, an orderly end."""

from __future__ import annotations

import argparse
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rbxcompose.cli.common.telling import tell_report
from rbxcompose.findings import Finding, Report
from rbxcompose.plain import plain
from rbxcompose.qos import Qos
from rbxcompose.recording.codes import RECOVERED
from rbxcompose.recording.files import recover_all
from rbxcompose.recording.topics import Selection, Topic
from rbxcompose.units import TIME, UnitError, to_si


def add_selection_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--topics` and `--class`."""
    parser.add_argument(
        "--topics",
        nargs="+",
        action="extend",
        default=[],
        metavar="PATTERN",
        help="only these, such as odom '/camera/*'",
    )
    parser.add_argument(
        "--class",
        nargs="+",
        action="extend",
        default=[],
        dest="classes",
        type=_class,
        metavar="CLASS",
        help=f"only these classes: {', '.join(Qos)}",
    )


def selection_of(arguments: argparse.Namespace) -> Selection:
    """Return which topics are wanted."""
    return Selection(tuple(arguments.topics), tuple(arguments.classes))


def _class(text: str) -> Qos:
    try:
        return Qos(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no class; there are {', '.join(Qos)}") from None


def seconds(text: str) -> float:
    """Read `30s` or `2 min` [s]."""
    try:
        value = to_si(text, TIME)
    except UnitError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    if value <= 0:
        raise argparse.ArgumentTypeError("must be longer than nothing")
    return value


def recover_in(folder: Path) -> None:
    """Recover the unfinished recordings of a folder and tell of them."""
    for one in recover_all(folder):
        if one.problem:
            warn(RECOVERED.at(None, f"'{plain(str(one.path))}' is unfinished and stays so: {plain(one.problem)}"))
        else:
            warn(
                RECOVERED.at(None, f"'{plain(str(one.path))}' was unfinished: {one.messages:,} messages are recovered")
            )


def warn(finding: Finding) -> None:
    """Tell a finding that does not end the command."""
    report = Report()
    report.add(finding)
    tell_report(report, {})


def table(counts: Mapping[Topic, int]) -> str:
    """Return one line for each topic: name, type, class, number of messages."""
    rows = [("topic", "type", "class", "messages")]
    topics = sorted(counts, key=lambda topic: (topic.name, topic.type))
    rows += [(plain(one.name), plain(one.type) or "-", one.qos.value, f"{counts[one]:,}") for one in topics]
    widths = [max(len(row[index]) for row in rows) for index in range(len(rows[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


class Interrupt:
    """Tells whether Ctrl-C or a request to end has come."""

    def __init__(self) -> None:
        self.has_come = False

    def __bool__(self) -> bool:
        return self.has_come


@contextmanager
def until_interrupted() -> Iterator[Interrupt]:
    """Have signals only noted, so that what is being written gets its end."""
    interrupt = Interrupt()

    def note(number: int, frame: object) -> None:
        interrupt.has_come = True

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield interrupt
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
