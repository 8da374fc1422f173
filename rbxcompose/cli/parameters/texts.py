"""Values of parameters as a person writes them on the command line or in a file, and back."""

from __future__ import annotations

import sys
from pathlib import Path

from rbxcompose.composition.value_edits import value_text
from rbxcompose.findings import Finding, Report, Span, kind
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.reader import read_file, read_text
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.manifest.validate import to_plain
from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterType, ParameterValue
from rbxcompose.params.core import SEPARATOR
from rbxcompose.params.values import to_message
from rbxcompose.units import Dimension

NO_VALUES = kind("RBX9048")
PIPED = "-"
_ROS = "ros__parameters"


def value_of(text: str) -> ParameterValue:
    """Read a number, a flag or a list in YAML; anything else is text."""
    root, findings = read_text(text, "VALUE")
    data = text if root is None or findings or isinstance(root, MappingNode) else to_plain(root)
    return to_message(text if data is None else data) or ParameterValue(
        type=ParameterType.PARAMETER_STRING, string_value=text
    )


def exact_text(value: object, dimension: Dimension | None) -> str:
    """Return a value as `value_of` reads it, exact to the last but one bit."""
    return value_text(value, dimension).replace("$$", "$")


def file_values(path: Path, report: Report, sources: dict[str, str]) -> dict[str, tuple[Parameter, ...]]:
    """Return the parameters in a file, by component, or `-` in what is piped in; mistakes go into `report`."""
    if str(path) == PIPED:
        sources[PIPED] = sys.stdin.read()
        root, findings = read_text(sources[PIPED], PIPED)
    else:
        root, findings = read_file(path, shown_name(path), sources)
    report.extend(findings)
    found: dict[str, tuple[Parameter, ...]] = {}
    if root is None:
        return found
    if not isinstance(root, MappingNode):
        report.add(_no_map(root.span, "components"))
        return found
    for name, entry in root.entries.items():
        values = entry.value
        if isinstance(values, MappingNode) and list(values.entries) == [_ROS]:
            values = values.entries[_ROS].value
        if isinstance(values, MappingNode):
            found[name] = tuple(_parameters(values, "", report))
        else:
            report.add(_no_map(values.span, f"the parameters of '{name}'"))
    return found


def _parameters(node: MappingNode, above: str, report: Report) -> list[Parameter]:
    found = []
    for name, entry in node.entries.items():
        path = f"{above}{SEPARATOR}{name}" if above else name
        if isinstance(entry.value, MappingNode):
            found += _parameters(entry.value, path, report)
        elif (value := _message(entry.value)) is None:
            report.add(NO_VALUES.at(entry.value.span, f"no parameter can have this value, as '{path}' has"))
        else:
            found.append(Parameter(path, value))
    return found


def _message(node: TreeNode) -> ParameterValue | None:
    value = to_plain(node)
    return None if value is None else to_message(value)


def _no_map(span: Span, what: str) -> Finding:
    return NO_VALUES.at(span, f"{what} must be a map", help="'rbxcompose param dump' shows the form")
