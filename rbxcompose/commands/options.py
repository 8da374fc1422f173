"""Options and arguments that verbs share; apart from what carries them out, which takes longer to import."""

import argparse
import json
import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import open_regular, read_regular
from rbxcompose.base.units import FREQUENCY, TIME, Dimension, UnitError, to_si

EACH, BUS = "each host", "bus"
"""What a verb may have as `ON_SYSTEM`: where it runs for a robot of a system. On each host of the robot, or on any one
that reaches its bus; any other word is the type of the component that answers. With `EACH` it is for all robots of a
system, and needs no more of them than their names; else, for those of its actions that are in its `FOR_ALL`."""

Declare = Callable[[argparse.ArgumentParser], object]  # declares some arguments
_KIND = re.compile(rb"^kind:[ \t]*['\"]?(\w+)", re.MULTILINE)
_KEY = re.compile(rb"^['\"]?(\w+)['\"]?[ \t]*:", re.MULTILINE)
_MANIFEST = re.compile(rb"(?:^|[{,])[ \t]*['\"]?rbx['\"]?[ \t]*:", re.MULTILINE)
_HEAD = 4096  # bytes at the start of a file that contain its kind


@dataclass(frozen=True, slots=True)
class Subcommand:
    """A subcommand: its name, its help, what carries it out, and its arguments in their order in the help."""

    name: str
    help: str
    do: Callable[..., int]
    declares: tuple[Declare, ...] = ()
    about: str | None = None  # the longer help of the subcommand itself


def argument(*names: str, **options: Any) -> Declare:
    """Return what declares one argument, as `add_argument` takes it."""
    return lambda parser: parser.add_argument(*names, **options)


def out_option(words: str, *more: str, metavar: str = "FILE", **options: Any) -> Declare:
    """Return what declares where the answer is written: `-o` and `--out`, and `more` names."""
    return argument("-o", "--out", *more, metavar=metavar, help=words, **options)


def deferred(module: str, function: str) -> Callable[..., int]:
    """Return what calls a function of a module that is imported only then, since it needs more than others do."""
    return lambda *arguments: int(getattr(import_module(module), function)(*arguments))


def add_actions(
    parser: argparse.ArgumentParser, actions: Iterable[Subcommand], *common: Declare, metavar: str = "", usual: str = ""
) -> None:
    """Declare subcommands, each with its own arguments and then the `common` ones; `metavar` names them all.

    The `usual` one, else the first, is the most common reading, and is meant if none is written.
    """
    made = parser.add_subparsers(dest="action", required=True)
    for subcommand in actions:
        usual = usual or subcommand.name
        words = f"{subcommand.help} (the default)" if subcommand.name == usual else subcommand.help
        action = made.add_parser(subcommand.name, help=words, description=subcommand.about)
        for declare in (*subcommand.declares, *common):
            declare(action)
        action.set_defaults(do=subcommand.do)
    made.metavar = metavar or "|".join(made.choices)
    parser.set_defaults(action=usual)


def run_action(arguments: argparse.Namespace, *before: object) -> int:
    """Carry out the chosen subcommand with what stands `before` its arguments; return the exit code."""
    do: Callable[..., int] = arguments.do
    return do(*before, arguments)


def add_unsaved_option(parser: argparse.ArgumentParser) -> None:
    """Declare `--unsaved FILE`."""
    words = """texts in place of those of files, as JSON: {"PATH": "TEXT"}; '-' reads it from stdin"""
    parser.add_argument("--unsaved", type=_unsaved, default={}, metavar="FILE", help=words)


def unsaved_of(arguments: argparse.Namespace) -> Mapping[Path, str]:
    """Return the texts that are used in place of files, by their real paths."""
    found: Mapping[Path, str] = getattr(arguments, "unsaved", {})
    return found


def _unsaved(file: str) -> Mapping[Path, str]:
    """Read texts by the paths of files that there are."""
    from rbxcompose.manifest.tree import ALL_BYTES  # takes longer to import

    try:
        data = sys.stdin.buffer.read(ALL_BYTES + 1) if file == "-" else read_regular(Path(file), ALL_BYTES)
        texts = json.loads(data[: ALL_BYTES + 1])
    except (OSError, ValueError, RecursionError) as error:
        raise argparse.ArgumentTypeError(f"'{file}' cannot be read: {error}") from error
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise argparse.ArgumentTypeError(f"'{file}' has no texts by paths")
    for path in texts:
        if not Path(path).is_file():
            raise argparse.ArgumentTypeError(f"'{path}' is no file: only those that exist can have another text")
    return {Path(path).resolve(): text.removeprefix("\ufeff").replace("\r\n", "\n") for path, text in texts.items()}


def add_system_options(parser: argparse.ArgumentParser, *, has_profile: bool = False) -> None:
    """Declare what verbs need for the hosts of a system; a verb with layers of robots has `--profile` already."""
    if not has_profile:
        parser.add_argument(
            "--profile", action="append", default=[], metavar="P", help="of a system: apply this profile"
        )
    parser.add_argument("--ssh-config", metavar="FILE", help="of a system: ssh's configuration, instead of the user's")


def _head_of(path: Path) -> bytes | None:
    """Return the start of a file, None if it cannot be read."""
    with suppress(OSError), open_regular(path) as file:
        return file.read(_HEAD)
    return None


def kind_of(path: Path) -> str:
    """Return the kind that a manifest names; empty if it names none or cannot be read."""
    found = _KIND.search(_head_of(path) or b"")
    return found[1].decode() if found else ""


def is_manifest(path: Path) -> bool:
    """Return whether a file without a kind is meant as a manifest, by its name or its keys."""
    head = _head_of(path)
    if head is None or path.stem == "robot" or _MANIFEST.search(head):
        return True
    from rbxcompose.manifest.registry import robot_keys  # takes longer to import

    return len({key.decode() for key in _KEY.findall(head)}.intersection(robot_keys())) > 1


def is_system(written: str) -> bool:
    """Return whether a command-line path names the file of a system."""
    path: object = Path(written)
    if written.startswith("rbx:"):
        from rbxcompose.manifest.files import find  # takes longer to import

        path = find(written)
    return isinstance(path, Path) and path.is_file() and kind_of(path) == "System"


def system_and_robot(written: str) -> tuple[str, str] | None:
    """Return the system's file and the robot that `FILE` or `FILE:ROBOT` names; without a robot, all are meant."""
    path, _, robot = written.rpartition(":")
    named = next((pair for pair in ((written, ""), (path, robot)) if is_system(pair[0])), None)
    return named or next((pair for pair in ((written, ""), (path, robot)) if _was_system(pair[0])), None)


def _was_system(path: str) -> bool:
    """Return whether a file that is gone, or says nothing now, was that of a system when robots were brought up."""
    if not path.endswith((".yaml", ".yml")) or kind_of(Path(path)):
        return False
    from rbxcompose.runtime.folder import system_record  # takes longer to import

    return system_record(path).exists()


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


def speed_up(text: str, examples: str) -> float:
    """Read `20x`, how much faster than real time something shall be."""
    with suppress(ValueError):
        if 0 < (factor := float(text.removesuffix("x"))) < math.inf:
            return factor
    raise argparse.ArgumentTypeError(f"'{text}' is not a rate; write {examples}")


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


def count(text: str, least: int = 1) -> int:
    """Read a whole number of at least `least`."""
    if not text.isdecimal() or int(text) < least:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number of at least {least}")
    return int(text)


def count_from_zero(text: str) -> int:
    """Read a whole number of at least 0: `-n 0 -f` follows only what is new."""
    return count(text, least=0)


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
