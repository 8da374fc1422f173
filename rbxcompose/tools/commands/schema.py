"""Print the JSON Schema of a kind of manifest, for editors.

It knows all installed component types, including those of other distributions.
"""

import argparse

from rbxcompose.commands.console import emit
from rbxcompose.compiler.schema.documents import as_text, installed_schema, makers

GROUP = "write"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    kinds = {kind.lower(): kind for kind in makers()}
    parser.add_argument("kind", metavar="KIND", choices=list(kinds), help=f"one of {', '.join(kinds)}")


def run(arguments: argparse.Namespace) -> int:
    """Print the schema."""
    kind = next(kind for kind in makers() if kind.lower() == arguments.kind)
    emit(as_text(installed_schema(kind)).rstrip("\n"))
    return 0
