"""`udev check`."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rbxcompose.cli.devices.actions import Actions, add_action, add_group_option, devices_of
from rbxcompose.cli.output.console import FINDINGS, has_colour, tell
from rbxcompose.devices.serial_ports import serial_ports
from rbxcompose.doctor.serial_ports import look_at
from rbxcompose.doctor.udev import device_answers, group_answer, rules_answer, this_account
from rbxcompose.findings import Finding, Report
from rbxcompose.regular_files import read_regular
from rbxcompose.rendering.json_ import as_data
from rbxcompose.rendering.text import render_text

_MOST = 1 << 20  # [B] of rules


def add(actions: Actions) -> None:
    """Declare the action."""
    about = "tell whether the devices of a robot are plugged in, named and open to this user"
    add_group_option(add_action(actions, "check", about, _check))


def _check(arguments: argparse.Namespace) -> int:
    found = devices_of(arguments)
    if found is None or not found.is_right:
        return FINDINGS
    ports = serial_ports(arguments.root)
    rules = rules_answer(found.rules(arguments.group), installed(arguments.root / found.file), f"/{found.file}")
    are_right = isinstance(rules, str)
    answers = list(device_answers(found.named, ports, look_at, rules_are_right=are_right))
    if found.named:
        answers += [group_answer(this_account(), arguments.group), rules]
    report = Report([one for one in answers if isinstance(one, Finding)])
    fine = [one for one in answers if isinstance(one, str)]
    if arguments.json:
        tell(json.dumps({"fine": fine, "findings": [as_data(one, found.sources) for one in report]}))
    else:
        told = render_text(report, found.sources, has_colour(sys.stdout))
        tell("\n".join([*(f"ok  {one}" for one in fine), told]).rstrip("\n"))
    return FINDINGS if report.has_errors else 0


def installed(file: Path) -> str | None:
    """Return the text of a file of rules; None if there is none that can be read."""
    try:
        return read_regular(file, _MOST).decode(errors="replace")
    except OSError:
        return None
