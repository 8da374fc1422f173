"""List and show types of messages, services and actions, begin your own, export packages of them.

A robot's own types are those in the folders of its section `msgs`: `msg new my_msgs/Grasp` begins one, and `msg stubs`
tells editors and type checkers about `from rbxcompose.msgs.my_msgs import Grasp`. ROS 2 knows all types of a robot
except its own and those of the package `rbxcompose_msgs`: `msg export ros2_ws/src PATH` writes their packages.
"""

import argparse
import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import rbxcompose
from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Span, kind
from rbxcompose.commands.console import FINDINGS, NotDoneError, emit, refuse, table, write_report
from rbxcompose.commands.messages import NO_TYPE, to_json
from rbxcompose.commands.new_files import NAME, write_new
from rbxcompose.commands.options import Subcommand, add_actions, argument, run_action
from rbxcompose.commands.targets import add_path_argument, robot_path
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.message_texts import wrong_package, wrong_type
from rbxcompose.compiler.sections.bus import msgs
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.tree import MappingNode, entries_of
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import KINDS, parse, parts, type_hash
from rbxcompose.msgs.generate import all_structures, modules
from rbxcompose.msgs.packages import OWN, all_names, own_packages, package_files, parts_of, short, whole_text

GROUP = "data"
LICENCE = "Apache-2.0"
NO_OWN = kind("RBX9049")
_ENDINGS = tuple(f".{kind_}" for kind_ in KINDS)
_NAMES = "such as my_msgs/Grasp, my_msgs/srv/Open or my_msgs/action/Close"
_BEGUN = {
    "msg": """# What it tells, with units.
std_msgs/Header header
float64 width  # [m]
""",
    "srv": """# What is asked for.
float64 width  # [m]
---
bool success
string message
""",
    "action": """# What is to be done.
float64 width  # [m]
---
bool success
string message
---
float64 width  # so far [m]
""",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    json_ = argument("--json", action="store_true", help="answer in JSON")
    known = argument("type", metavar="TYPE", help="such as geometry_msgs/Twist")
    own = argument("type", metavar="TYPE", help=_NAMES)
    msgs = argument("--into", metavar="DIR", type=Path, default=Path("msgs"), help="the folder of packages (msgs)")
    typings = argument("--into", metavar="DIR", type=Path, default=Path("typings"), help="the folder (typings)")
    folder = argument("folder", metavar="DIR", type=Path, help="the folder in which to create the packages")
    robot = argument("path", nargs="?", metavar="PATH", help="the robot whose own packages are written, too")
    printed = "print a definition with all types that it uses, and its type hash"
    begun = "write a type of your own to start from, and the folders of its package"
    stubbed = "write the classes of the robot's types for editors and type checkers"
    exported = f"write {OWN}, and a robot's own packages, for a ROS 2 workspace"
    actions = (
        Subcommand("ls", "list all types, those of the robot first", _ls, (add_path_argument,)),
        Subcommand("show", printed, _show, (known, add_path_argument)),
        Subcommand("new", begun, _new, (own, msgs)),
        Subcommand("stubs", stubbed, _stubs, (typings, add_path_argument)),
        Subcommand("export", exported, _export, (folder, robot)),
    )
    add_actions(parser, actions, json_, usual="show")


def run(arguments: argparse.Namespace) -> int:
    """Carry out the chosen action."""
    return run_action(arguments)


def _choose_robot(path: str | None) -> int:
    """Let names mean the types of a robot, or of the only one here, if there is one; return the exit code.

    A mistake in the types is refused: what is left of such a type is another type.
    """
    with suppress(NotDoneError):
        path = robot_path(path)
    if path is None:
        return 0
    compilation = compile_robot(path, environment=os.environ)
    robot = compilation.robot
    if robot is None or any(_is_in_types(finding.span, robot.manifest.root) for finding in compilation.report):
        write_report(compilation.report, compilation.sources)
        return FINDINGS
    return 0


def _is_in_types(span: Span | None, root: MappingNode) -> bool:
    """Return whether a place is in the text of a type, or in the section that names the folders of such texts."""
    folders = [entry.value.span for entry in entries_of(root.get(msgs.name)).values()]
    return span is not None and (span.file.endswith(_ENDINGS) or any(folder.contains(span) for folder in folders))


def _ls(arguments: argparse.Namespace) -> int:
    if code := _choose_robot(arguments.path):
        return code
    own = registry.chosen().texts
    names = [*sorted(own), *(name for name in all_names() if name not in own)]
    if arguments.json:
        emit(to_json([{"type": name, "own": name in own} for name in names]))
    else:
        emit(table([("type", ""), *((name, "the robot's own" if name in own else "") for name in names)]))
    return 0


def _show(arguments: argparse.Namespace) -> int:
    wanted, names = arguments.type, all_names()
    if arguments.path is not None or not any(wanted in (name, short(name)) for name in names):
        if code := _choose_robot(arguments.path):
            return code
        names = all_names()
    name = next((name for name in names if wanted in (name, short(name))), None)
    if name is None:
        words = f"unknown type '{wanted}'"
        return refuse(NO_TYPE.misspelt(None, words, wanted, [*names, *map(short, names)], "known types"))
    hashed, text = type_hash(name, registry.chosen().structures), whole_text(name)
    data = {"type": name, "hash": hashed, "text": text, "parts": parts_of(name)}
    emit(to_json(data) if arguments.json else f"# {name}\n# {hashed}\n{text}".rstrip("\n"))
    return 0


def _new(arguments: argparse.Namespace) -> int:
    package, *kinds, bare = arguments.type.split("/") if "/" in arguments.type else (arguments.type, "", "")
    kind_ = kinds[0] if kinds else "msg"
    if len(kinds) > 1 or kind_ not in KINDS:
        words = f"'{arguments.type}' is no name of a type"
        return refuse(NAME.at(None, words, help=_NAMES))
    name = f"{package}/{kind_}/{bare}"
    if why := wrong_package(package) or wrong_type(bare):
        return refuse(NAME.at(None, why))
    if registry.standard_text(name) is not None:
        return refuse(NAME.at(None, f"'{arguments.type}' is a standard type", help="choose another name"))
    path = f"{name}.{kind_}"
    if finding := write_new(arguments.into, {path: _BEGUN[kind_]}):
        return refuse(finding)
    file = arguments.into / path
    text = f"{shown_name(file)} is written; name '{arguments.into}' in the section 'msgs' of a robot"
    emit(to_json({"type": name, "file": str(file)}) if arguments.json else text)
    return 0


def _stubs(arguments: argparse.Namespace) -> int:
    if code := _choose_robot(robot_path(arguments.path)):
        return code
    own = registry.chosen().texts
    if not own:
        return refuse(NO_OWN.at(None, "the robot has no types of its own"))
    packages = {name.split("/")[0] for name in own}
    files = {package: arguments.into / "rbxcompose" / "msgs" / f"{package}.pyi" for package in sorted(packages)}
    structures = {part: one for name in own for part, one in parts(name, parse(name, own[name])).items()}
    texts = modules({**all_structures(), **structures})
    for package, file in files.items():
        file.parent.mkdir(parents=True, exist_ok=True)
        replace_file(file, texts[package].encode())
    text = "\n".join(f"{shown_name(file)} is written" for file in files.values())
    emit(to_json({package: str(file) for package, file in files.items()}) if arguments.json else text)
    return 0


def _export(arguments: argparse.Namespace) -> int:
    if arguments.path is not None and (code := _choose_robot(arguments.path)):
        return code
    folder, packages = arguments.folder, [OWN, *(own_packages() if arguments.path is not None else ())]
    files = {package: package_files(package, rbxcompose.__version__, LICENCE) for package in packages}
    finding = write_new(
        folder, {f"{package}/{path}": text for package in files for path, text in files[package].items()}
    )
    if finding is not None:
        return refuse(replace(finding, help="choose another folder"))
    if arguments.json:
        emit(to_json({"packages": packages, "folder": str(folder)}))
    else:
        where = ", ".join(shown_name(folder / package) for package in packages)
        emit(f"{where} is written; in the workspace: colcon build --packages-select {' '.join(packages)}")
    return 0
