"""Draw a robot: components, wires, processes and missions, as Mermaid, DOT or one HTML page.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

import argparse
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.commands.console import FINDINGS, emit, misused, write_report
from rbxcompose.commands.options import out_option
from rbxcompose.commands.targets import add_layer_options, add_path_argument, compiled, robot_path
from rbxcompose.tools.inspection.diagram import MANY, diagram_of, dot, folded, mermaid
from rbxcompose.tools.inspection.pages import html

GROUP = "look"
TEXTS = {"mermaid": mermaid, "dot": dot}
HTML = "html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_path_argument(parser)
    add_layer_options(parser)
    words = f"draw every mission and every open wire, also if there are more than {MANY} that are alike"
    parser.add_argument("--all", action="store_true", help=words)
    parser.add_argument("--format", choices=[*TEXTS, HTML], default="mermaid", help="output format")
    out_option("write it to this file")(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the graph; draw a robot with mistakes as far as it could be read, and write its findings to stderr."""
    compilation = compiled(robot_path(arguments.path), arguments)
    write_report(compilation.report, compilation.sources)
    if compilation.robot is not None:
        whole = diagram_of(compilation.robot)
        drawn = whole if arguments.all else folded(whole)
        text = html(drawn, whole) if arguments.format == HTML else TEXTS[arguments.format](drawn)
        if arguments.out is None:
            emit(text.rstrip("\n"))
        elif problem := _write(Path(arguments.out), text):
            return misused("graph", problem)
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
