"""What the verbs about topics, services and actions share."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from rbxcompose.bus.graph import GraphEnd, GraphName, find
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.place import add_bus_options, find_place
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.cli.systems.options import add_system_options
from rbxcompose.findings import kind
from rbxcompose.printable import plain
from rbxcompose.units import FREQUENCY, TIME, Dimension, UnitError, to_si

Do = Callable[[Guest, argparse.Namespace], int]

NO_NAME = kind("RBX9022")
NOBODY = kind("RBX9025")
SAID_NO = kind("RBX9026")


def visit(arguments: argparse.Namespace, do: Callable[[Guest], int]) -> int:
    """Join the chosen bus, run `do` there, and return the exit code."""
    try:
        with Guest(find_place(arguments)) as guest:
            return do(guest)
    except NotDoneError as error:
        return refuse(error.finding)


def wanted(names: Sequence[GraphName], name: str, what: str) -> GraphName:
    """Return the topic, service or action of that name.

    Raises:
        NotDoneError: if there is none.
    """
    found = find(names, name)
    if found is None:
        words = f"there is no {what} '{name}'"
        raise NotDoneError(NO_NAME.misspelt(None, words, name, [one.name for one in names], f"{what}s"))
    return found


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of cells as lines in aligned columns; make foreign names safe for a terminal."""
    cells = [[plain(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells
    )


def tell_list(names: Sequence[GraphName], ends: tuple[str, str], arguments: argparse.Namespace) -> int:
    """List names with their types and the counts of both `ends`; hidden names only with `--all`."""
    listed = [one for one in names if arguments.all or not one.is_hidden]
    if arguments.json:
        tell(json.dumps([_short(one, ends) for one in listed]))
        return 0
    rows = [
        (one.name, ", ".join(one.types), str(len(one.givers)), str(len(one.takers)), one.clash and f"! {one.clash}")
        for one in listed
    ]
    tell(table([("name", "type", *ends, ""), *rows]))
    return 0


def described(one: GraphName, ends: tuple[str, str]) -> dict[str, Any]:
    """Return all that is known about a name, for JSON."""
    return {
        "name": one.name,
        "types": one.types,
        "clash": one.clash,
        ends[0]: [_end(end) for end in one.givers],
        ends[1]: [_end(end) for end in one.takers],
    }


def add_server_verbs(
    parser: argparse.ArgumentParser, noun: str, verb: tuple[str, str], content: str, example: str, do: Sequence[Do]
) -> None:
    """Declare the subcommands of services or actions: `ls`, and a `verb` with its help, which sends a `content`.

    `do` has the functions that carry them out, in this order.
    """
    actions = parser.add_subparsers(dest="action", metavar=f"ls|{verb[0]}", required=True)
    ls = actions.add_parser("ls", help=f"list the {noun}s with their types")
    add_ls_options(ls)
    send = actions.add_parser(verb[0], help=verb[1])
    send.add_argument("name", metavar=noun.upper(), help=f"its name, such as {example}")
    send.add_argument("content", metavar=content.upper(), nargs="?", default="", help="YAML; missing fields are zero")
    add_timeout_option(send, "5s")
    add_json_option(send)
    for one, done in zip((ls, send), do, strict=True):
        one.set_defaults(do=done)
        add_bus_options(one)
        add_system_options(one)


def add_ls_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--all` and `--json`."""
    parser.add_argument("-a", "--all", action="store_true", help="also hidden ones, such as parts of actions")
    add_json_option(parser)


def add_json_option(parser: argparse.ArgumentParser) -> None:
    """Declare `--json`."""
    parser.add_argument("--json", action="store_true", help="answer in JSON, one line per answer")


def add_timeout_option(parser: argparse.ArgumentParser, default: str) -> None:
    """Declare `--timeout 5s`."""
    words = f"how long to wait for the other side (default: {default})"
    parser.add_argument("--timeout", type=seconds, default=seconds(default), metavar="T", help=words)


def add_count_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--once` and `-n`."""
    counts = parser.add_mutually_exclusive_group()
    counts.add_argument("--once", dest="count", action="store_const", const=1, help="end after one")
    counts.add_argument("-n", "--count", type=count, metavar="N", help="end after this many")


def seconds(text: str) -> float:
    """Read `30s` or `2 min` [s]."""
    return _positive(text, TIME)


def hertz(text: str) -> float:
    """Read `10Hz` [Hz]."""
    return _positive(text, FREQUENCY)


def positive(dimension: Dimension) -> Callable[[str], float]:
    """Return a reader of positive quantities of this dimension [SI]."""
    return lambda text: _positive(text, dimension)


def signed(dimension: Dimension) -> Callable[[str], float]:
    """Return a reader of quantities of this dimension [SI], which may be below zero."""
    return lambda text: _quantity(text, dimension)


def count(text: str) -> int:
    """Read a whole number of at least 1."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number above 0")
    return int(text)


def _positive(text: str, dimension: Dimension) -> float:
    value = _quantity(text, dimension)
    if value <= 0:
        raise argparse.ArgumentTypeError("must be above zero")
    return value


def _quantity(text: str, dimension: Dimension) -> float:
    try:
        return to_si(text, dimension)
    except UnitError as error:
        raise argparse.ArgumentTypeError(": ".join(filter(None, (str(error), error.detail, error.help)))) from error


def _short(one: GraphName, ends: tuple[str, str]) -> dict[str, Any]:
    counts = {ends[0]: len(one.givers), ends[1]: len(one.takers)}
    return {"name": one.name, "types": one.types, "clash": one.clash, **counts}


def _end(end: GraphEnd) -> dict[str, Any]:
    qos = None if end.qos is None else asdict(end.qos)
    return {"node": end.node, "type": end.kind.type, "hash": end.kind.hash, "gid": end.gid.hex(), "qos": qos}
