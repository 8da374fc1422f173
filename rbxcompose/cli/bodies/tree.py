"""`body tree`."""

from __future__ import annotations

import argparse
from pathlib import Path

from rbxcompose.body.description import Description
from rbxcompose.body.text import tree_of
from rbxcompose.cli.bodies.actions import Actions, add_action, file_of, write
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.inspection.body_graph import FORMATS, draw_graph
from rbxcompose.inspection.layout import NotDrawnError

TEXT, PDF = "text", "pdf"


def add(actions: Actions) -> None:
    """Declare the action."""
    parser = add_action(actions, "tree", "show which link hangs on which, by which joint", _tree)
    parser.add_argument("--format", choices=(TEXT, *FORMATS), default=TEXT, help="lines, or a picture as a graph")
    parser.add_argument("--out", metavar="FILE", help="write it to this file (default of a PDF: NAME.pdf)")


def _tree(arguments: argparse.Namespace, description: Description) -> int:
    try:
        content = _drawn(arguments.format, description)
    except NotDrawnError as error:
        return refuse(error.finding)
    if arguments.out is not None:
        return write(Path(arguments.out), content)
    if arguments.format == PDF:
        return write(file_of(arguments, description, ".pdf"), content)
    tell(content.decode().rstrip("\n"))
    return 0


def _drawn(form: str, description: Description) -> bytes:
    if form == TEXT:
        return "".join(f"{line}\n" for line in tree_of(description.body)).encode()
    return draw_graph(description.body, form)
