"""`params`: files of ROS 2 parameters, and dumps of `dynamic_reconfigure`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from rbxcompose.findings import Related, Report
from rbxcompose.importing.foreign_files import ForeignFile, Given
from rbxcompose.importing.importer import DISAGREES, NOT_CARRIED_OVER, OTHER_PROGRAM, importer
from rbxcompose.importing.known_components import KnownComponent, known_component
from rbxcompose.importing.manifest_text import Row, header, place, row, section
from rbxcompose.importing.names import FreeNames
from rbxcompose.importing.parameter_values import ParameterData, argument_type, is_told, shown_name, value_of, written
from rbxcompose.importing.ros_parameters import NodeParameters, parameters_of, scalars_of
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode
from rbxcompose.printable import plain

ParameterPath = tuple[str, ...]
GivenValues = dict[ParameterPath, Given[ParameterData]]

# What programs of ROS have by themselves, and what decides here.
_OF_ROS = {
    "use_sim_time": "'bus: {clock: external}' makes robot time follow '/clock'",
    "qos_overrides": "the class of a port decides",
    "start_type_description_service": "there is no such service",
}


@importer("params", "files of ROS 2 parameters, and dumps of dynamic_reconfigure")
def params(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with a component for each node that is one of ours, and an argument for each other parameter."""
    found = [file for file in files if _is_one(file, report)]
    nodes: dict[str, tuple[NodeParameters, GivenValues]] = {}
    for file in found:
        for node in parameters_of(file):
            _, known = nodes.setdefault(node.node, (node, {}))
            _add(known, node, report)
    components = {
        name: made
        for name, (node, known) in nodes.items()
        if (made := known_component(node, known, report)) is not None
    }
    others = {name: one for name, one in nodes.items() if name not in components and one[1]}
    text = "\n".join(
        part for part in (section(_argument_rows(others)), section(_component_rows(components.values()))) if part
    )
    return f"{header('params', [file.name for file in found], 'Robot', name)}\n{text}" if text else ""


def _is_one(file: ForeignFile, report: Report) -> bool:
    words = ""
    if not isinstance(file.root, MappingNode):
        words = "it is no map of keys"
    elif {"rbx", "kind"} <= file.root.entries.keys():
        words = "it is a manifest"
    if words:
        report.add(OTHER_PROGRAM.at(file.root.span, f"'{plain(file.name)}' is no file of parameters: {words}"))
    return not words


def _add(known: GivenValues, node: NodeParameters, report: Report) -> None:
    """Add the parameters of a node; tell those that cannot be carried over, and those that disagree."""
    for path, entry in scalars_of(node.root):
        shown = f"'{plain(shown_name(path), 60)}' of '{plain(node.node, 60)}'"
        if path[0] in _OF_ROS and not _is_false(entry.value):
            words = f"{shown} is not carried over: {_OF_ROS[path[0]]}"
            report.add(NOT_CARRIED_OVER.at(entry.key.span, words))
        if path[0] in _OF_ROS:
            continue
        value = value_of(entry.value)
        if value is None and is_told(entry.value):
            continue
        if value is None:
            words = f"{shown} is not carried over: it is neither a value nor a list of values"
            report.add(NOT_CARRIED_OVER.at(entry.value.span, words))
        elif (other := known.setdefault(tuple(".".join(path).split(".")), value)) != value:
            words = f"{shown} was something else before; the first one counts"
            report.add(DISAGREES.at(value.span, words, related=[Related(other.span, "the first one")]))


def _is_false(node: TreeNode) -> bool:
    return isinstance(node, ScalarNode) and plain_value(node) is False


def _argument_rows(nodes: dict[str, tuple[NodeParameters, GivenValues]]) -> Iterator[Row]:
    """Yield an argument for each parameter, below the name of its node."""
    names = FreeNames()
    if nodes:
        yield row(0, "args:")
    for name, (node, known) in nodes.items():
        yield row(1, "", f"{place(node.span)}: '{plain(name, 60)}'")
        for path, value in known.items():
            last = "_".join(path)
            wanted = last if len(nodes) == 1 else f"{name.rpartition('/')[2].replace('**', 'all')}_{last}"
            text = f"{{type: {argument_type(value.value)}, default: {written(value.value)}}}"
            origin = f"{place(value.span)}: {plain(shown_name(path), 60)}"
            yield row(1, f"{names.take(wanted, 'parameter')}: {text}", origin)


def _component_rows(components: Iterable[KnownComponent]) -> Iterator[Row]:
    names, is_first = FreeNames(), True
    for one in components:
        if is_first:
            yield row(0, "components:")
        is_first = False
        yield row(1, f"{names.take(one.name, one.type)}:", f"{place(one.span)}: '{plain(one.node, 60)}'")
        yield row(2, f"type: {one.type}", "the settings are those of this type")
        for setting, (text, span) in one.settings.items():
            yield row(2, f"{setting}: {text}", place(span))
