"""`param save`: live values go into the files of the robot."""

from __future__ import annotations

import argparse
import json

from rbxcompose.cli.bus.entities import NO_NAME
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.bus.parameter_nodes import ParameterNodes
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.parameters.saved_values import changed_since_up, files_with, require_unedited, write
from rbxcompose.cli.robots.live_settings import LiveChange, LiveSettings, live_settings
from rbxcompose.cli.robots.lookup import NO_ANSWER, NotDoneError, find_robot, known_state
from rbxcompose.composition.value_edits import value_text
from rbxcompose.findings import Finding, kind
from rbxcompose.runtime.folder import RobotFolder, RobotState

NO_FILES = kind(
    "RBX9046",
    """The files of the robot are not known, or have errors

What compares live values with the manifest needs the robot's files: those of a robot that this user has brought up on
this machine. `rbxcompose check` tells what is wrong with them.

Bad: `rbxcompose param save --router tcp/192.168.1.7:7447`
Good: `rbxcompose param save`, on the robot itself.
""",
)


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


def save(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Write the chosen live values into the files of the robot, or show what would be written."""
    live, folder, state = manifest_of(nodes, arguments)
    changes = chosen(list(changed_since_up(live, folder)), live, arguments.names)
    if isinstance(changes, Finding):
        return refuse(changes)
    if changes:
        require_unedited(live, changes, folder)
        texts = files_with(live, changes, state)
        if not arguments.dry_run:
            write(texts)
        places = sorted(str(edit.span) for edit in texts.fix.edits)
    else:
        places = []
    if arguments.json:
        tell(json.dumps({"saved": [_data(one) for one in changes], "places": places, "dry_run": arguments.dry_run}))
        return 0
    for one in changes:
        tell(f"{one.path}: {shown(one, one.written)} -> {shown(one, one.live)}")
    verb = "would be written" if arguments.dry_run else "written"
    tell("\n".join(f"{verb}: {one}" for one in places) or "nothing to save: all values are those of the manifest")
    return 0


def chosen(changes: list[LiveChange], live: LiveSettings, names: list[str]) -> list[LiveChange] | Finding:
    """Return the changes of components (`battery`) or settings (`battery.runtime`); no names mean all."""
    known = {f"{name}.{one}" for name, config in live.now.items() for one in type(config).model_fields}
    for name in names:
        if name not in known and name not in live.now:
            return NO_NAME.misspelt(None, f"the robot has no setting '{name}'", name, sorted({*known, *live.now}))
    return [one for one in changes if not names or {one.path, one.component} & set(names)]


def shown(change: LiveChange, value: object) -> str:
    """Return a value of a setting as a manifest says it."""
    return "nothing" if value is None else value_text(value, change.dimension)


def _data(change: LiveChange) -> dict[str, object]:
    old, new = (json.loads(to_json(one)) for one in (change.written, change.live))
    return {"component": change.component, "name": change.name, "old": old, "new": new}
