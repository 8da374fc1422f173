"""Print the JSON Schema of a kind of manifest, for editors.

It knows all installed component types, including those of other distributions. Some import message types of a robot:
print it in the folder of that robot. What cannot be imported is left out, and stderr says why.
"""

import argparse

from rbxcompose.base.findings import Finding, Report
from rbxcompose.base.plugins import LEFT_OUT
from rbxcompose.commands.console import emit, write_report
from rbxcompose.commands.messages import finds_types_here
from rbxcompose.compiler.schema.documents import as_text, installed_schema, makers
from rbxcompose.sdk.registry import component_names, why_unusable

GROUP = "write"
_HELP = "if these are message types of a robot, run this in the folder of that robot"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    kinds = {kind.lower(): kind for kind in makers()}
    parser.add_argument("kind", metavar="KIND", choices=list(kinds), help=f"one of {', '.join(kinds)}")


def run(arguments: argparse.Namespace) -> int:
    """Print the schema."""
    kind = next(kind for kind in makers() if kind.lower() == arguments.kind)
    if (left_out := _left_out()) and finds_types_here():
        left_out = _left_out()
    write_report(Report(left_out), {})
    emit(as_text(installed_schema(kind)).rstrip("\n"))
    return 0


def _left_out() -> list[Finding]:
    reasons = filter(None, map(why_unusable, component_names()))
    return [LEFT_OUT.at(None, why, help=_HELP if "rbxcompose.msgs" in why else "") for why in reasons]
