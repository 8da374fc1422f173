"""The verbs: found by the names of their files, and imported only when needed.

The file of a verb that is a word of Python ends in an underscore, which is not part of the verb's name.
"""

from __future__ import annotations

import importlib
import keyword
import os
from typing import TYPE_CHECKING, Protocol, cast

from rbxcompose import cli

if TYPE_CHECKING:  # a verb that does not run costs no imports
    import argparse


class Verb(Protocol):
    """The contents of a verb's module."""

    __doc__: str | None

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare options and arguments."""
        ...

    def run(self, arguments: argparse.Namespace) -> int:
        """Run the verb and return the exit code."""
        ...


def verbs() -> list[str]:
    """Return the names of all verbs, sorted."""
    names = (name.removesuffix(".py") for name in os.listdir(cli.__path__[0]) if name.endswith(".py"))
    return sorted(name.removesuffix("_") for name in names if name not in ("__init__", "main"))


def module_of(verb: str) -> str:
    """Return the name of a verb's module in the package `cli`."""
    return f"{verb}_" if keyword.iskeyword(verb) else verb


def load(verb: str) -> Verb:
    """Import a verb."""
    return cast(Verb, importlib.import_module(f"{cli.__name__}.{module_of(verb)}"))


def parser_of(name: str, verb: Verb) -> argparse.ArgumentParser:
    """Return the parser of a verb."""
    from rbxcompose.cli.output.console import Parser  # help does not need it

    parser = Parser(f"rbxcompose {name}", description=verb.__doc__ or "", allow_abbrev=False)
    verb.add_arguments(parser)
    return parser
