"""What the subcommands of `udev` share: their options, and the devices of a robot."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from rbxcompose.cli.bus.entities import add_json_option
from rbxcompose.cli.output.console import tell_report
from rbxcompose.cli.project.robot_choice import add_path_argument, robot_path
from rbxcompose.cli.project.robot_options import add_layer_options, compiled
from rbxcompose.dataclass import dataclass
from rbxcompose.devices.rules import GROUP, rules_file, rules_text
from rbxcompose.devices.serial_ports import ROOT
from rbxcompose.doctor.udev import Named
from rbxcompose.findings import Sources
from rbxcompose.manifest.tree import key_span
from rbxcompose.sections.devices import devices

Actions: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
Do = Callable[[argparse.Namespace], int]

_GROUP_NAME = re.compile(r"[a-z_][a-z0-9_-]{0,31}")


@dataclass(frozen=True, slots=True)
class RobotDevices:
    """The devices of a robot: by name, with their places; and whether the robot has no error."""

    robot: str
    named: Named
    sources: Sources
    is_right: bool

    def rules(self, group: str) -> str:
        """Return the rules for them."""
        return rules_text(self.robot, (device for device, _ in self.named.values()), group)

    @property
    def file(self) -> Path:
        """Return the path of their rules below the root."""
        return rules_file(self.robot)


def add_action(actions: Actions, name: str, about: str, do: Do) -> argparse.ArgumentParser:
    """Declare an action with the options that all have."""
    parser = actions.add_parser(name, help=about, description=f"{about[0].upper()}{about[1:]}.")
    add_path_argument(parser)
    add_layer_options(parser)
    words = "look at the /sys, /dev and /etc below this folder, such as a mounted image"
    parser.add_argument("--root", type=_folder, default=ROOT, metavar="DIR", help=words)
    add_json_option(parser)
    parser.set_defaults(do=do)
    return parser


def add_group_option(parser: argparse.ArgumentParser) -> None:
    """Declare `--group`."""
    words = f"the group that may open the devices (default: {GROUP})"
    parser.add_argument("--group", type=_group, default=GROUP, metavar="NAME", help=words)


def _folder(text: str) -> Path:
    path = Path(text)
    if not path.is_dir():
        raise argparse.ArgumentTypeError(f"'{text}' is not a folder")
    return path.resolve()


def _group(text: str) -> str:
    if not _GROUP_NAME.fullmatch(text):
        raise argparse.ArgumentTypeError(f"'{text}' is not the name of a group")
    return text


def devices_of(arguments: argparse.Namespace) -> RobotDevices | None:
    """Return the devices of the robot that is meant; None after telling why there are none."""
    path = robot_path(arguments.path)
    return None if path is None else read_devices(path, arguments)


def read_devices(path: str, arguments: argparse.Namespace) -> RobotDevices | None:
    """Return the devices of a robot, and tell its findings; None if it cannot be read."""
    found = compiled(path, arguments)
    if found.report.has_errors:
        tell_report(found.report, found.sources)
    if found.robot is None:
        return None
    contents = found.robot.manifest.contents
    named = {
        name: (one.wanted(name), key_span(contents.root, ("devices", name)))
        for name, one in contents.of(devices).items()
    }
    return RobotDevices(found.robot.manifest.name, named, found.sources, not found.report.has_errors)
