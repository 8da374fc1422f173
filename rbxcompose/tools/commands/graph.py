"""Draw a robot: components, wires, processes and missions, as Mermaid, DOT or one HTML page.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.commands.console import FINDINGS, emit, refuse, write_report
from rbxcompose.commands.layout import NotDrawnError
from rbxcompose.commands.options import out_option
from rbxcompose.commands.targets import add_layer_options, add_path_argument, layers_of, robot_path
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.tools.inspection.diagram import diagram_of, dot, mermaid
from rbxcompose.tools.inspection.graph_html import html

GROUP = "look"
USAGE = 2
FORMATS = {"mermaid": mermaid, "dot": dot, "html": html}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_path_argument(parser)
    add_layer_options(parser)
    parser.add_argument("--format", choices=list(FORMATS), default="mermaid", help="output format")
    out_option("write it to this file")(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the graph; draw a robot with mistakes as far as it could be read, and write its findings to stderr."""
    path = robot_path(arguments.path)
    if path is None:
        return FINDINGS
    compilation = compile_robot(path, **layers_of(arguments))
    write_report(compilation.report, compilation.sources)
    if compilation.robot is not None:
        try:
            text = FORMATS[arguments.format](diagram_of(compilation.robot))
        except NotDrawnError as error:
            return refuse(error.finding)
        if arguments.out is None:
            emit(text.rstrip("\n"))
        elif problem := _write(Path(arguments.out), text):
            sys.stderr.write(f"rbxcompose graph: {problem}\n")
            return USAGE
    return FINDINGS if compilation.report.has_errors else 0


def _write(file: Path, text: str) -> str:
    """Write a file; return why it could not be written, or nothing."""
    try:
        if file.exists() and not file.is_file():
            file.write_text(text, encoding="utf-8")  # `/dev/stdout`, a pipe
        else:
            replace_file(file.resolve(), text.encode())
    except OSError as error:
        return f"'{file}' cannot be written: {error.strerror}"
    return ""
