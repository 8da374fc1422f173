"""Serve a client of the Model Context Protocol, over stdin and stdout.

Its tools check, explain, test and try what is in the project, and look at robots that run. The client starts it.
Without --operate, the client has the role `view` of the console, which changes nothing.
"""

import argparse
import asyncio
import os
from importlib.util import find_spec
from pathlib import Path

from rbxcompose.base.printable import plain
from rbxcompose.commands.console import misused, refuse
from rbxcompose.commands.options import seconds
from rbxcompose.tools.commands.lsp import NOT_INSTALLED

GROUP = "write"
_LONGEST = "2 min"
_IN_PROJECTS = ("robots", "missions", "robot.yaml")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    words = "the folder of the project (default: this one)"
    parser.add_argument("folder", nargs="?", default=".", metavar="FOLDER", help=words)
    words = "at robots that run, give it the role 'operate': run, pause, resume and cancel missions, stop, release"
    parser.add_argument("--operate", action="store_true", help=words)
    words = f"the longest that a call may take (default: {_LONGEST})"
    parser.add_argument("--deadline", type=seconds, default=seconds(_LONGEST), metavar="T", help=words)
    parser.add_argument("--stdio", action="store_true", help="the default; some clients pass it")


def run(arguments: argparse.Namespace) -> int:
    """Serve until the client ends the session."""
    if find_spec("mcp") is None:
        help_text = "install it with: pip install 'rbxcompose[mcp]'"
        return refuse(
            NOT_INSTALLED.at(None, "the server for the Model Context Protocol is not installed", help=help_text)
        )
    from rbxcompose.domains.console.access import Role
    from rbxcompose.tools.mcp.server import AuditLog, audit_path, serve

    if not any(Path(arguments.folder, name).exists() for name in _IN_PROJECTS):
        problem = (
            f"'{plain(arguments.folder)}' is no project: it has neither 'robots/' nor 'missions/' nor 'robot.yaml'"
        )
        return misused("mcp", problem)
    os.chdir(arguments.folder)
    try:
        log = AuditLog()
    except OSError as error:
        return misused("mcp", f"calls cannot be logged in '{audit_path()}': {error.strerror}")
    asyncio.run(serve(Role.OPERATE if arguments.operate else Role.VIEW, arguments.deadline, log))
    return 0
