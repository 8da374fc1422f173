"""What the actions of `body` share: the description that PATH names, and files that they write."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from rbxcompose.atomic_files import replace_file
from rbxcompose.body.description import Description
from rbxcompose.cli.bodies.source import DescribedBody, MisuseError, add_source_options, described, is_description
from rbxcompose.cli.output.console import FINDINGS, misused, refuse, tell, tell_report
from rbxcompose.cli.project.robot_choice import robot_path
from rbxcompose.findings import Finding, kind

NO_BODY = kind("RBX2008")
UNKNOWN = kind("RBX2018")
Use = Callable[[argparse.Namespace, Description], int]
Read = Callable[[argparse.Namespace, DescribedBody], int]
Actions: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"


def add_action(actions: Actions, name: str, about: str, use: Use) -> argparse.ArgumentParser:
    """Declare an action that uses a body, after its findings are written to stderr; return its parser."""
    return add_reader(actions, name, about, lambda arguments, found: used(arguments, found, use))


def add_reader(actions: Actions, name: str, about: str, do: Read) -> argparse.ArgumentParser:
    """Declare an action that does something with what was read at PATH; return its parser."""
    parser = actions.add_parser(name, help=about, description=about)
    add_source_options(parser)
    parser.set_defaults(do=lambda arguments: read(arguments, do))
    return parser


def read(arguments: argparse.Namespace, do: Read) -> int:
    """Do something with what was read at PATH; return the exit code."""
    arguments.path = robot_path(arguments.path)
    if arguments.path is None:
        return FINDINGS
    try:
        found = described(arguments)
    except MisuseError as error:
        return misused("body", str(error))
    return do(arguments, found)


def used(arguments: argparse.Namespace, found: DescribedBody, use: Use) -> int:
    """Write the findings to stderr, and use the body if there is one; return the exit code."""
    tell_report(found.report, found.sources)
    if found.description is None:
        return FINDINGS if found.report.has_errors else refuse(no_body(arguments.path))
    return use(arguments, found.description) or (FINDINGS if found.report.has_errors else 0)


def no_body(path: str) -> Finding:
    """Return the finding that there is no body."""
    message = "this file has no links" if is_description(path) else "this robot has no body"
    return NO_BODY.at(None, message)


def file_of(arguments: argparse.Namespace, description: Description, ending: str) -> Path:
    """Return the file that `--out` names, or one in this folder that has the name of the body."""
    return Path(arguments.out or f"{re.sub(r'[^A-Za-z0-9_-]', '_', description.body.name) or 'body'}{ending}")


def write(file: Path, content: bytes) -> int:
    """Write a file and say so; return the exit code."""
    try:
        replace_file(file.resolve(), content)
    except OSError as error:
        return misused("body", f"'{file}' cannot be written: {error.strerror}")
    tell(f"wrote {file}")
    return 0
