"""`launch`: launch files of ROS 2, in XML, YAML and Python."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rbxcompose.base.findings import Report
from rbxcompose.base.printable import plain
from rbxcompose.commands.importing.foreign_files import ForeignFile, FreeNames
from rbxcompose.commands.importing.importer import LEFT_OPEN, NOT_CARRIED_OVER, ImportedFiles, importer
from rbxcompose.commands.importing.manifest_text import (
    Row,
    flag,
    flow,
    flow_list,
    header,
    key,
    place,
    row,
    section,
    word,
)
from rbxcompose.compiler.composition.robot_file import is_own_name
from rbxcompose.domains.programs.launch_files.evaluation import Evaluation, LaunchedProgram, Parameter
from rbxcompose.manifest.validate import UNKNOWN_KEY

_WIDEST = 100  # columns of a map in one line


@importer("launch", "launch files of ROS 2, in XML, YAML and Python", has_arguments=True)
def launch(files: Sequence[ForeignFile], name: str, report: Report) -> str | ImportedFiles:
    """Return a robot with a component for each program that the files start."""
    prefixes = tuple(Path(each) for each in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if each)
    found = Evaluation(prefixes, os.environ, report, files[0].out)
    for file in files:
        found.run(file)
    for given in files[0].arguments:
        if given not in found.arguments:
            words = f"the files declare no argument '{plain(given, 60)}'"
            report.add(UNKNOWN_KEY.misspelt(None, words, given, found.arguments, "their arguments"))
    nodes = [program for program in found.programs if program.package]
    if found.outputs:
        words = "'output' is not carried over: the log of the robot has what its programs print"
        report.add(NOT_CARRIED_OVER.at(found.outputs[0], words))
    if nodes:
        words = "the files do not say which topics their nodes have, so no check knows them"
        help_text = "write 'publishes:' and 'subscribes:', or run 'rbxcompose ros2 pin' while the nodes run"
        report.add(LEFT_OPEN.at(nodes[0].span, words, help=help_text))
    if not found.programs:
        return ImportedFiles("", included=found.sources)
    rows = _rows(found, is_placed=files[0].out is not None)
    text = f"{header('launch', [file.name for file in files], 'Robot', name)}\n{section(rows)}"
    return ImportedFiles(text, included=found.sources)


def _rows(found: Evaluation, *, is_placed: bool) -> Iterator[Row]:
    if found.arguments:
        yield row(0, "", "Arguments are filled in with these values; 'NAME:=VALUE' behind FILE gives others.")
    for name, argument in found.arguments.items():
        about = f": {plain(argument.description)}" if argument.description else ""
        yield row(0, "", f"  {plain(name, 60)}:={plain(argument.value)} ({place(argument.span)}{about})")
    if any(program.package for program in found.programs):
        yield row(0, "", "The topics of each 'ros2_node' are still open: see 'publishes' and 'subscribes'.")
    if not is_placed and any(program.files or program.folder for program in found.programs):
        yield row(0, "", "Relative paths begin in the folder of the first FILE.")
    yield row(0, "components:")
    names = FreeNames(is_own_name)
    for program in found.programs:
        name = names.take(program.wanted, "program")
        yield row(1, f"{key(name)}:", place(program.span))
        yield from _node(program, name) if program.package else _program(program)
        if program.restart:
            when = program.restart["when"]
            yield row(2, f"restart: {flow(program.restart) if len(program.restart) > 1 else when}")


def _node(node: LaunchedProgram, name: str) -> Iterator[Row]:
    yield row(2, "type: ros2_node")
    yield row(2, f"package: {word(node.package)}")
    yield row(2, f"executable: {word(node.executable)}", "" if node.name else "it gives the node its name")
    if node.name and node.name != name:
        yield row(2, f"name: {word(node.name)}")
    if node.namespace:
        yield row(2, f"namespace: {word(node.namespace)}")
    yield from _map("remaps", node.remaps)
    yield from _map("parameters", node.parameters)
    if node.files:
        yield row(2, f"parameter_files: {flow_list([*map(word, node.files)])}")
    if node.words:
        yield row(2, f"arguments: {flow_list([*map(word, node.words)])}")
    yield from _map("environment", node.environment)


def _program(program: LaunchedProgram) -> Iterator[Row]:
    yield row(2, "type: program")
    yield row(2, f"command: {flow_list([*map(word, program.words)])}")
    if program.folder:
        yield row(2, f"folder: {word(program.folder)}")
    yield from _map("environment", program.environment)


def _map(name: str, entries: Mapping[str, Parameter]) -> Iterator[Row]:
    """Yield a map in one line, or with a line for each entry if that is too long."""
    written = {key(each): _written(value) for each, value in entries.items()}
    line = f"{name}: {flow(written)}"
    if written and len(line) <= _WIDEST:
        yield row(2, line)
    elif written:
        yield row(2, f"{name}:")
        yield from (row(3, f"{each}: {value}") for each, value in written.items())


def _written(value: Parameter) -> str:
    match value:
        case bool():
            return flag(value)
        case int():
            return str(value)
        case float():  # which keeps its point: 3.0 is not 3 for ROS
            return repr(value)
        case str():
            return word(value)
        case list():
            return flow_list([*map(_written, value)])
    return flow({key(name): _written(below) for name, below in value.items()})
