"""Write a system for what keeps it alive, a robot for ROS 2, MoveIt or viewers, a mission as a tree.

`systemd`, `compose` and `k8s` write units, a Compose file and manifests of Kubernetes; `srdf` is for MoveIt.
`ros2` writes packages for a workspace: messages, and for each robot a launch file for RViz or Foxglove.
`rviz` and `foxglove` write what shows a robot there: a configuration of RViz 2, a layout of Foxglove.
`bt` writes a mission, with those that it uses, as trees of BehaviorTree.CPP 4.

The files go to a new or empty folder; `srdf` writes a URDF, an SRDF and the limits of joints.
Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

import argparse
import getpass
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from rbxcompose import __version__
from rbxcompose.base.findings import Finding, Report
from rbxcompose.commands.console import FINDINGS, emit, refuse, write_report
from rbxcompose.commands.options import is_system, out_option
from rbxcompose.commands.targets import system_without_errors, without_errors
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.bundle import NOT_EXPORTED, BundledFile, files_of
from rbxcompose.compiler.systems.model import System
from rbxcompose.tools.commands.needs import requirements
from rbxcompose.tools.exporting import ros2, shares
from rbxcompose.tools.exporting.viewers import foxglove_layout, rviz_config

GROUP = "system"
SRDF, ROS2, RVIZ, FOXGLOVE, BT = "srdf", "ros2", "rviz", "foxglove", "bt"
PROGRAMS = ("systemd", "compose", "k8s", ROS2, SRDF, RVIZ, FOXGLOVE, BT)
_OF_ROBOTS: Mapping[str, Callable[[Sequence[Plan]], dict[str, str]]] = {
    ROS2: lambda plans: ros2.packages(plans, __version__),
    RVIZ: lambda plans: {f"{plan.robot}.rviz": rviz_config(plan) for plan in plans},
    FOXGLOVE: lambda plans: {f"{plan.robot}.foxglove.json": foxglove_layout(plan) for plan in plans},
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("program", choices=PROGRAMS, help="for which program")
    parser.add_argument(
        "path", metavar="SYSTEM", help="the file: a system; srdf: a robot; ros2, rviz, foxglove: either; bt: a mission"
    )
    out_option("a new or empty folder", metavar="FOLDER", required=True)(parser)
    parser.add_argument("--host", metavar="NAME", help="only what this host runs")
    parser.add_argument("--profile", action="append", default=[], metavar="P", help="apply this profile of the system")
    parser.add_argument("--real", action="store_true", help="use the real devices; without it, they are simulated")
    parser.add_argument("--user", metavar="NAME", help="systemd: the user that runs it (default: you)")
    parser.add_argument("--file", metavar="PATH", help="systemd: the system's file on the host (default: as here)")
    parser.add_argument(
        "--command", metavar="PATH", help="systemd: rbxcompose on the host (default: the host's, or as here)"
    )
    parser.add_argument("--image", metavar="NAME", default=f"rbxcompose:{__version__}", help="k8s: the image")


def run(arguments: argparse.Namespace) -> int:
    """Compile the system and write the files."""
    if arguments.program == SRDF:
        return _export_robot(arguments)
    if arguments.program in _OF_ROBOTS:
        return _export_robots(arguments, _OF_ROBOTS[arguments.program])
    if arguments.program == BT:
        return _export_mission(arguments)
    if not is_system(arguments.path):
        return refuse(NOT_EXPORTED.at(None, f"'{arguments.path}' is not the file of a system"))
    system = system_without_errors(arguments.path, arguments.profile, real=arguments.real)
    if arguments.host is not None and arguments.host not in system.hosts:
        message = f"the system has no host '{arguments.host}'"
        return refuse(NOT_EXPORTED.misspelt(None, message, arguments.host, system.hosts, "hosts"))
    try:
        texts, files = _made(system, arguments)
    except ValueError as error:
        return refuse(NOT_EXPORTED.at(None, f"'{system.name}' cannot be exported: {error}"))
    return _finish(arguments, texts, files)


def _export_robots(arguments: argparse.Namespace, made: Callable[[Sequence[Plan]], dict[str, str]]) -> int:
    """Write what is made of the robots of a system, or of a single robot."""
    if is_system(arguments.path):
        system = system_without_errors(arguments.path, (), real=arguments.real)
        plans = [robot.plan for robot in system.robots.values()]
    else:
        _, plan = without_errors(compile_robot(arguments.path, real=arguments.real, environment=os.environ))
        plans = [plan]
    return _finish(arguments, made(plans))


def _finish(
    arguments: argparse.Namespace, texts: Mapping[str, str], files: Mapping[str, BundledFile] = MappingProxyType({})
) -> int:
    made = {**{name: BundledFile(text.encode()) for name, text in texts.items()}, **files}
    if (problem := _write(Path(arguments.out), made)) is not None:
        return refuse(problem)
    for name in made:
        emit(str(Path(arguments.out, name)))
    return 0


def _export_robot(arguments: argparse.Namespace) -> int:
    from rbxcompose.tools.exporting.srdf import exported  # imports the sections of robots

    robot, _ = without_errors(compile_robot(arguments.path, environment=os.environ, real=arguments.real))
    manifest = robot.manifest
    made = exported(manifest.contents, manifest.name)
    if not made:
        return refuse(NOT_EXPORTED.at(None, f"'{manifest.name}' has no body"))
    return _finish(arguments, made)


def _export_mission(arguments: argparse.Namespace) -> int:
    from rbxcompose.tools.exporting.behaviour_tree import exported  # imports the importer of trees

    report, sources = Report(), dict[str, str]()
    made = exported(Path(arguments.path), report, sources)
    write_report(report, sources)
    return _finish(arguments, made) if made else FINDINGS


def _made(system: System, arguments: argparse.Namespace) -> tuple[dict[str, str], dict[str, BundledFile]]:
    """Return the texts of a system, and files beside them, by name."""
    found, (file, files) = list(shares.shares(system, arguments.host)), files_of(system)
    match arguments.program:
        case "systemd":
            words = {"file": arguments.file or str(system.path), "user": arguments.user or getpass.getuser()}
            return {
                shares.unit_name(item): shares.unit(item, program=_program(system, item.host, arguments), **words)
                for item in found
            }, {}
        case "compose":
            text = shares.compose_file(found, system=system.name, file=file)
            needed = requirements([placed.robot for placed in system.robots.values()], __version__)
            beside = {f"project/{name}": one for name, one in files.items()}
            return {"Dockerfile": shares.dockerfile(needed), "compose.yaml": text}, beside
    name, image = system.name, arguments.image
    return shares.kubernetes_manifests(found, system=name, file=file, files=files, image=image), {}


def _program(system: System, host: str, arguments: argparse.Namespace) -> str:
    """Return the path of rbxcompose on a host."""
    own = system.hosts[host].command
    there = own if own.startswith("/") else shutil.which("rbxcompose")
    return arguments.command or there or "/usr/local/bin/rbxcompose"


def _write(folder: Path, made: Mapping[str, BundledFile]) -> Finding | None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            return NOT_EXPORTED.at(None, f"the folder '{folder}' is not empty", help="name a new one")
        for name, one in made.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).touch(one.mode)
            (folder / name).write_bytes(one.data)
    except OSError as error:
        return NOT_EXPORTED.at(None, f"'{folder}' cannot be written: {error.strerror}")
    return None
