"""`udev install`."""

from __future__ import annotations

import argparse
import difflib
import json
import sys
from pathlib import Path

from rbxcompose.atomic_files import replace_file
from rbxcompose.cli.devices.actions import Actions, add_action, add_group_option, devices_of
from rbxcompose.cli.devices.check import installed
from rbxcompose.cli.output.console import FINDINGS, good, misused, refuse, tell
from rbxcompose.cli.project.questions import Asker, CancelledError
from rbxcompose.devices.rules import RELOAD
from rbxcompose.findings import kind

NOT_INSTALLED = kind("RBX9418")
NO_DEVICES = kind("RBX9419")
_MODE = 0o644
_YES = ("y", "yes")


def add(actions: Actions) -> None:
    """Declare the action."""
    about = "show the rules that would be written below /etc/udev/rules.d, ask, and write them"
    parser = add_action(actions, "install", about, _install)
    add_group_option(parser)
    parser.add_argument("-y", "--yes", action="store_true", help="do not ask")


def _install(arguments: argparse.Namespace) -> int:
    found = devices_of(arguments)
    if found is None or not found.is_right:
        return FINDINGS
    if not found.named:
        return refuse(NO_DEVICES.at(None, f"the robot '{found.robot}' has no devices, so there are no rules to write"))
    path, rules = arguments.root / found.file, found.rules(arguments.group)
    before = installed(path)
    if before == rules:
        return _done(arguments, path, written=False)
    if not arguments.yes:
        if arguments.json or not sys.stdin.isatty():
            return misused("udev install", "there is nobody to ask: give '--yes'")
        tell(_change(path, before, rules))
        if not _agreed():
            tell("nothing was written")
            return FINDINGS
    elif not arguments.json:
        tell(_change(path, before, rules))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, rules.encode(), mode=_MODE)
    except OSError as error:
        words = f"'{path}' cannot be written: {error.strerror}"
        tee = f"rbxcompose udev generate | sudo tee {path}"
        return refuse(NOT_INSTALLED.at(None, words, help=f"run it with sudo, or: {tee}"))
    return _done(arguments, path, written=True)


def _change(path: Path, before: str | None, after: str) -> str:
    """Return what would be written: all of a new file, the difference from an old one."""
    if before is None:
        return f"{path}:\n{after}"
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), str(path), "new", lineterm="")
    return "\n".join(lines)


def _agreed() -> bool:
    try:
        return Asker(is_asking=True).ask("write it?", lambda text: text.casefold() in _YES, "no")
    except CancelledError:
        return False


def _done(arguments: argparse.Namespace, path: Path, *, written: bool) -> int:
    if arguments.json:
        tell(json.dumps({"file": str(path), "written": written, "reload": RELOAD}))
    elif written:
        tell(good(f"wrote {path}; it takes effect with: {RELOAD}"))
    else:
        tell(f"{path} has these rules already")
    return 0
