"""`param diff`, `param dump`, `param save`: live values beside the files of the robot, and into them."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from functools import partial

from rbxcompose.cli.bus.entities import NO_NAME
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.output.console import tell
from rbxcompose.cli.parameters.changed_values import changes_of
from rbxcompose.cli.parameters.listed_values import listed
from rbxcompose.cli.parameters.saved_values import Compiled, changed_since_up, files_with, require_unedited, write
from rbxcompose.cli.parameters.texts import exact_text
from rbxcompose.cli.robots.live_settings import LiveChange, LiveSettings, compiled_as_it_runs, live_settings
from rbxcompose.cli.robots.lookup import NO_ANSWER, NotDoneError, find_robot, known_state
from rbxcompose.composition.value_edits import value_text
from rbxcompose.config import leaves
from rbxcompose.findings import Span, kind
from rbxcompose.inspection.origin import origin_of
from rbxcompose.manifest.tree import at
from rbxcompose.runtime.folder import RobotFolder, RobotState

NO_FILES = kind("RBX9046")


def manifest_of(nodes: ParameterNodes, arguments: argparse.Namespace) -> tuple[LiveSettings, RobotFolder, RobotState]:
    """Return the settings of the chosen robot beside its manifest.

    Raises:
        NotDoneError: if its files are not known here, or have errors.
    """
    if arguments.router:
        raise NotDoneError(NO_FILES.at(None, "the files of a robot behind '--router' are not known"))
    folder = find_robot(arguments.robot)
    state = known_state(folder)
    if state is None:
        raise NotDoneError(NO_ANSWER.at(None, f"'{folder.path.name}' does not answer"))
    live = live_settings(nodes, state)
    if live is None:
        help_text = f"'rbxcompose check {state.file}' tells them"
        raise NotDoneError(NO_FILES.at(None, f"the files of '{state.robot}' have errors now", help=help_text))
    return live, folder, state


def param_diff(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Show what is not as in the manifest; the exit code is 1 if there is anything."""
    live, _, _ = manifest_of(nodes, arguments)
    return tell_differences(live, arguments)


def tell_differences(live: LiveSettings, arguments: argparse.Namespace) -> int:
    """Tell what is not as in the manifest, and return the exit code."""
    found = list(live.changes)
    if arguments.json:
        tell(json.dumps([{**_data(one), "place": str(place(live, one))} for one in found]))
    else:
        lines = [f"{_change_text(one)}  # {place(live, one)}" for one in found]
        tell("\n".join(lines) or "all values are those of the manifest")
    return 1 if found else 0


def param_dump(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Write the parameters that may change, as YAML for `load`."""
    wanted = [nodes.find(arguments.component)] if arguments.component else nodes.names
    found = [one for one in listed(nodes, wanted) if not one.about.read_only and one.value is not None]
    if arguments.json:
        data: dict[str, dict[str, object]] = {}
        for one in found:
            data.setdefault(one.node.removeprefix("/"), {})[one.about.name] = one.value
        tell(to_json(data))
        return 0
    lines, node = [], ""
    for one in found:
        lines += [f"{one.node.removeprefix('/')}:"] if one.node != node else []
        node = one.node
        lines.append(f"  {one.about.name}: {exact_text(one.value, one.dimension)}")
    tell("\n".join(lines) or "{}")
    return 0


def place(live: LiveSettings, change: LiveChange) -> Span:
    """Return where the manifest says a setting, or where it would."""
    path = live.robot.components[change.component].place(change.name)
    node = at(live.robot.manifest.root, path)
    return live.robot.key(*path) if node is None else origin_of(live.robot.manifest, path, node).span


def param_save(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Write the chosen live values into the files of the robot, or show what would be written."""
    live, folder, state = manifest_of(nodes, arguments)
    history = changes_of(nodes)
    changes = chosen(changed_since_up(live, folder, history), live, arguments.names)
    if changes:
        require_unedited(live, changes, folder, history)
    return save(live, changes, partial(compiled_as_it_runs, state), arguments)


def save(live: LiveSettings, changes: Sequence[LiveChange], compiled: Compiled, arguments: argparse.Namespace) -> int:
    """Write changes into the files of the robot, and tell them.

    Raises:
        NotDoneError: if one cannot be written, or something else would change by it.
    """
    places: list[str] = []
    if changes:
        texts = files_with(live, changes, compiled)
        if not arguments.dry_run:
            write(texts)
        places = sorted(str(edit.span) for edit in texts.fix.edits)
    if arguments.json:
        tell(json.dumps({"saved": [_data(one) for one in changes], "places": places, "dry_run": arguments.dry_run}))
        return 0
    for one in changes:
        tell(_change_text(one))
    verb = "would be written" if arguments.dry_run else "written"
    tell("\n".join(f"{verb}: {one}" for one in places) or "nothing to save: all values are those of the manifest")
    return 0


def chosen(changes: list[LiveChange], live: LiveSettings, names: list[str]) -> list[LiveChange]:
    """Return the changes of components (`battery`) or settings (`battery.runtime`); no names mean all.

    Raises:
        NotDoneError: if the robot has no such component or setting.
    """
    known = {f"{name}.{one}" for name, config in live.now.items() for one, _ in leaves(config)}
    for name in names:
        if name not in known and name not in live.now:
            message = f"the robot has no setting '{name}'"
            raise NotDoneError(NO_NAME.misspelt(None, message, name, sorted({*known, *live.now}), "settings"))
    return [one for one in changes if not names or {one.path, one.component} & set(names)]


def shown(change: LiveChange, value: object) -> str:
    """Return a value of a setting as a manifest says it."""
    return "nothing" if value is None else value_text(value, change.dimension)


def _change_text(change: LiveChange) -> str:
    return f"{change.path}: {shown(change, change.written)} -> {shown(change, change.live)}"


def _data(change: LiveChange) -> dict[str, object]:
    old, new = (json.loads(to_json(one)) for one in (change.written, change.live))
    return {"component": change.component, "name": change.name, "old": old, "new": new}
