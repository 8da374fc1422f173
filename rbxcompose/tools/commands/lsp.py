"""Speak the Language Server Protocol with an editor, over stdin and stdout.

It reports errors as you type, completes, jumps to definitions and explains. An editor starts it.
"""

import argparse
import os
from importlib.util import find_spec

from rbxcompose.base.findings import kind
from rbxcompose.commands.console import refuse

GROUP = "write"
NOT_INSTALLED = kind("RBX9010")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--stdio", action="store_true", help="the default; many editors pass it")


def run(arguments: argparse.Namespace) -> int:
    """Serve until the editor ends the session."""
    if find_spec("pygls") is None:
        help_text = "install it with: pip install 'rbxcompose[lsp]'"
        return refuse(NOT_INSTALLED.at(None, "the language server is not installed", help=help_text))
    from rbxcompose.tools.lsp.server import make_server

    make_server(os.environ).start_io()
    return 0
