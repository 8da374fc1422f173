"""Shared code of `record` and `replay` besides the bus: options, findings, tables."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import tell_report
from rbxcompose.findings import Finding, Report
from rbxcompose.printable import plain
from rbxcompose.qos import Qos
from rbxcompose.recording.codes import RECOVERED
from rbxcompose.recording.files import recover_all
from rbxcompose.recording.topics import RecordedTopic, Selection, by_name


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
    """Return the selection of topics."""
    return Selection(tuple(arguments.topics), tuple(arguments.classes))


def _class(text: str) -> Qos:
    try:
        return Qos(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a class; choose from {', '.join(Qos)}") from None


def recover_in(folder: Path) -> None:
    """Recover the unfinished recordings of a folder and report them."""
    for one in recover_all(folder):
        if one.problem:
            warn(RECOVERED.at(None, f"'{plain(str(one.path))}' is unfinished and stays so: {plain(one.problem)}"))
        else:
            warn(
                RECOVERED.at(None, f"'{plain(str(one.path))}' was unfinished: {one.messages:,} messages are recovered")
            )


def warn(finding: Finding) -> None:
    """Report a finding that does not end the command."""
    report = Report()
    report.add(finding)
    tell_report(report, {})


def count_table(counts: Mapping[RecordedTopic, int]) -> str:
    """Return one line for each topic: name, type, class, number of messages."""
    rows = [("topic", "type", "class", "messages")]
    together = by_name(counts)
    topics = sorted(together, key=lambda topic: (topic.name, topic.type))
    rows += [(one.name, one.type or "-", one.qos.value, f"{together[one]:,}") for one in topics]
    return table(rows)
