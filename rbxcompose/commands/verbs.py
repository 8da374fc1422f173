"""The verbs: found by the names of their files, and imported only when needed.

The file of a verb that is a word of Python ends in an underscore, which is not part of the verb's name.
"""

from __future__ import annotations

import importlib
import keyword
from contextlib import suppress
from typing import TYPE_CHECKING, Protocol, cast

from rbxcompose.base.plugins import file_of, modules_of

if TYPE_CHECKING:  # a verb that does not run costs no imports
    import argparse


FOLDER = "commands"
"""In which a room has its verbs."""


GROUPS = ("write", "run", "look", "drive", "missions", "bodies and arms", "data", "system")
"""What one wants of a verb, in the order of the help."""

MOST_USED = "most used"


class Verb(Protocol):
    """The contents of a verb's module.

    With `IS_COMMON = True`, it stands among the most used ones in the help. With `STARTS_ROBOTS = True`, `stop` and
    `down` wait for the robots that it starts.
    """

    __doc__: str | None

    GROUP: str
    """One of `GROUPS`, as a text in quotes, since it is read without an import."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare options and arguments."""
        ...

    def run(self, arguments: argparse.Namespace) -> int:
        """Run the verb and return the exit code."""
        ...


def verbs() -> list[str]:
    """Return the names of all verbs, sorted."""
    return sorted(name.removesuffix("_") for name in modules_of(FOLDER))


def module_of(verb: str) -> str:
    """Return the name of a verb's module."""
    return modules_of(FOLDER)[f"{verb}_" if keyword.iskeyword(verb) else verb]


def about(verb: str) -> str:
    """Return the first line of a verb's docstring, read from its text: importing all verbs would take too long."""
    return _text(verb).partition("\n")[0].strip('"')


def starts_robots(verb: str) -> bool:
    """Return whether a verb starts robots, before the import of that verb, which takes as long as a start."""
    with suppress(OSError):  # then its import says so
        return "\nSTARTS_ROBOTS = True\n" in _text(verb)
    return False


def in_groups() -> dict[str, list[str]]:
    """Return the verbs by their headings in the help: the most used ones, then the others by what one wants."""
    texts = {verb: _text(verb) for verb in verbs()}
    found: dict[str, list[str]] = {heading: [] for heading in (MOST_USED, *GROUPS)}
    for group in GROUPS:
        for verb, text in texts.items():
            if f'\nGROUP = "{group}"\n' in text:
                found[MOST_USED if "\nIS_COMMON = True\n" in text else group].append(verb)
    return found


def _text(verb: str) -> str:
    with open(file_of(module_of(verb)), encoding="utf-8") as file:
        return file.read()


def load(verb: str) -> Verb:
    """Import a verb."""
    return cast(Verb, importlib.import_module(module_of(verb)))


def parser_of(name: str, verb: Verb) -> argparse.ArgumentParser:
    """Return the parser of a verb."""
    from rbxcompose.commands.console import Parser  # help does not need it

    parser = Parser(f"rbxcompose {name}", description=verb.__doc__ or "", allow_abbrev=False)
    verb.add_arguments(parser)
    return parser
