"""The body that PATH names, of a robot or of a bare file; and the files that actions write."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import field
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Finding, Report, Span, kind, one_compile
from rbxcompose.commands.console import FINDINGS, emit, misused, refuse, write_report
from rbxcompose.commands.targets import add_layer_options, compiled, robot_path
from rbxcompose.domains.body.description import BodyPart, Description, describe
from rbxcompose.domains.body.files import BodyFile
from rbxcompose.domains.body.sections.body import as_xacro_text, body
from rbxcompose.manifest.files import find, shown_name

URDF, XACRO = ".urdf", ".xacro"
_LAYERS: Mapping[str, str] = {"profile": "--profile", "overlays": "-f", "sets": "--set", "real": "--real"}
_FILES: Mapping[str, str] = {"with_": "--with", "packages": "--package"}
_ALL = {**_LAYERS, **_FILES}
NO_BODY = kind("RBX2008")
UNKNOWN = kind("RBX2018")


@dataclass(slots=True)
class DescribedBody:
    """A body, None if it could not be read or there is none; the findings, and the texts that they point into."""

    description: Description | None = None
    report: Report = field(default_factory=Report)
    sources: dict[str, str] = field(default_factory=dict)


class MisuseError(Exception):
    """Raised with what is wrong in the words of a command."""


def add_source_options(parser: argparse.ArgumentParser, also: str = "") -> None:
    """Declare PATH, which may name something else, `also`, and the options that belong to it."""
    words = "the robot's file, its folder, or rbx:robots/NAME; or a .urdf or .xacro file without a robot"
    parser.add_argument("path", nargs="?", metavar="PATH", help=f"{words}{also}; without it, the only robot")
    add_layer_options(parser)
    parser.add_argument(
        "--with", action="append", default=[], dest="with_", metavar="NAME=VALUE", help="an argument of the xacro file"
    )
    parser.add_argument(
        "--package",
        action="append",
        default=[],
        dest="packages",
        metavar="NAME=FOLDER",
        help="the folder of a ROS package that the URDF or xacro file names",
    )


def described(arguments: argparse.Namespace) -> DescribedBody:
    """Return the body that PATH names.

    Raises:
        MisuseError: if an option does not fit it.
    """
    if not is_description(arguments.path):
        _refuse_options(arguments, _FILES, "is for .urdf and .xacro files; a robot names it in its 'body'")
        compilation = compiled(arguments.path, arguments)
        description = compilation.robot.manifest.contents.of(body) if compilation.robot else None
        return DescribedBody(_usable(description), compilation.report, compilation.sources)
    _refuse_options(arguments, _LAYERS, "is for robots, not for .urdf and .xacro files")
    if arguments.with_ and arguments.path.endswith(URDF):
        raise MisuseError("--with is for .xacro files: a URDF has no arguments")
    values = dict(_pair(written, "--with") for written in arguments.with_)
    folders = {name: _folder(value) for name, value in (_pair(package, "--package") for package in arguments.packages)}
    return bare_body(arguments.path, {name: _value(value) for name, value in values.items()}, folders)


def is_description(path: str) -> bool:
    """Return whether a path names a URDF or xacro file, by its ending."""
    return path.endswith((URDF, XACRO))


def given_options(arguments: argparse.Namespace, options: Mapping[str, str] = _ALL) -> Iterator[str]:
    """Yield those of the options that belong to PATH that were given."""
    yield from (option for name, option in options.items() if getattr(arguments, name))


def _refuse_options(arguments: argparse.Namespace, options: Mapping[str, str], why: str) -> None:
    for option in given_options(arguments, options):
        raise MisuseError(f"{option} {why}")


@one_compile()
def bare_body(path: str, values: Mapping[str, str] = {}, folders: Mapping[str, Path] = {}) -> DescribedBody:
    """Return the body of a file without a robot; it may use what its project and the packages contain."""
    found, out = find(path), DescribedBody()
    if isinstance(found, Finding):
        out.report.add(found)
        return out
    span = Span(shown_name(found), 1, 1, 1, 1)
    file = BodyFile(found, span, path.endswith(XACRO), values, folders)
    description, findings = describe("", found.parent, [BodyPart("", file, None, span, span)], out.sources)
    out.description = _usable(description)
    out.report.extend(findings)
    return out


def _usable(description: Description | None) -> Description | None:
    return description if description is not None and description.body.links else None


def _pair(written: str, option: str) -> tuple[str, str]:
    name, equals, value = written.partition("=")
    if not (name and equals):
        raise MisuseError(f"{option} needs NAME=VALUE, not '{written}'")
    return name, value


def _value(written: str) -> str:
    """Return a value as xacro takes it: a plain number as it is written, a quantity in SI units."""
    with suppress(ValueError):
        float(written)
        return written
    return as_xacro_text(written)


def _folder(written: str) -> Path:
    folder = Path(os.path.expanduser(written)).resolve()
    if not folder.is_dir():
        raise MisuseError(f"--package: '{written}' is not a folder")
    return folder


Use = Callable[[argparse.Namespace, Description], int]
Read = Callable[[argparse.Namespace, DescribedBody], int]
Do = Callable[[argparse.Namespace], int]


def using(use: Use) -> Do:
    """Return an action that uses a body, after its findings are written to stderr."""
    return lambda arguments: read(arguments, lambda same, found: used(same, found, use))


def reading(do: Read) -> Do:
    """Return an action that does something with what was read at PATH."""
    return lambda arguments: read(arguments, do)


def read(arguments: argparse.Namespace, do: Read) -> int:
    """Do something with what was read at PATH; return the exit code."""
    arguments.path = robot_path(arguments.path)
    try:
        found = described(arguments)
    except MisuseError as error:
        return misused("body", str(error))
    return do(arguments, found)


def used(arguments: argparse.Namespace, found: DescribedBody, use: Use) -> int:
    """Write the findings to stderr, and use the body if there is one; return the exit code."""
    write_report(found.report, found.sources)
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
    emit(f"wrote {file}")
    return 0
