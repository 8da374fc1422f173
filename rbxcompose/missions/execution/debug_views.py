"""What people are shown before they intervene in a mission: how its nodes may end, and its data as they are written."""

import json
import re
from collections.abc import Iterator, Mapping

from rbxcompose.base.expressions.types import FLAG, UNKNOWN, Type
from rbxcompose.base.expressions.values import Value, is_named_pose
from rbxcompose.base.units import format_number, format_quantity
from rbxcompose.missions.analysis.examined import Ending
from rbxcompose.missions.execution.mission_run import MissionRun
from rbxcompose.missions.execution.requests import ListedDatum, OutcomesByNode
from rbxcompose.missions.program.program import Program, RobotNames

_PLAIN = re.compile(r"[A-Za-z_]\w*", re.ASCII)


def outcomes_of(program: Program, robot: RobotNames) -> OutcomesByNode:
    """Return the outcomes in which each node may end, by its number as text."""
    ending = Ending(program, robot)
    return {str(node.number): tuple(ending.of(node.number).words) for node in program.nodes}


def data_of(run: MissionRun) -> Iterator[ListedDatum]:
    """Yield the data of a mission, as they would be written to set them to what they are."""
    values = run.engine.data
    for name, datum in run.engine.program.data.items():
        choices = ("false", "true") if datum.type == FLAG else datum.type.choices
        yield ListedDatum(name, datum.type.detail, choices, written(values[name], datum.type))


def written(value: Value, wanted: Type, *, within: bool = False) -> str | None:
    """Return a value as it is written in a manifest, `within` a list or a map; None if it cannot be written."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return format_quantity(value, wanted.dimension) if wanted.dimension else format_number(value)
    if isinstance(value, str):
        return value if not within or _PLAIN.fullmatch(value) else json.dumps(value, ensure_ascii=False)
    if is_named_pose(value):
        return value.name or None
    of = wanted.of or UNKNOWN
    if isinstance(value, list | tuple):
        parts = wanted.parts if len(wanted.parts) == len(value) else {}
        items = [written(item, parts.get(f"{index}", of), within=True) for index, item in enumerate(value)]
        return None if None in items else f"[{', '.join(filter(None, items))}]"
    if isinstance(value, Mapping):
        entries = {name: written(entry, wanted.parts.get(name, of), within=True) for name, entry in value.items()}
        return (
            None if None in entries.values() else f"{{{', '.join(f'{key}: {text}' for key, text in entries.items())}}}"
        )
    return None
