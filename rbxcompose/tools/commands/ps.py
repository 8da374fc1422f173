"""Show the components of running robots: state, process, restarts; and who has stopped the robot."""

import argparse
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from rbxcompose.base.requests import to_data
from rbxcompose.commands.console import NotDoneError, emit, refuse, table
from rbxcompose.commands.lookup import (
    NO_SUPERVISOR,
    add_addressed_robot,
    answer_of,
    find_robot,
    known_state,
    robots_up,
    version_problem,
)
from rbxcompose.commands.options import EACH
from rbxcompose.runtime.folder import SUSPENDED, ClockOffset, ComponentState, RobotFolder, RobotState
from rbxcompose.runtime.processes import Process
from rbxcompose.runtime.requests import RobotStatus

GROUP = "look"
IS_COMMON = True
ON_SYSTEM = EACH
_COLUMNS = ("name", "type", "state", "process", "pid", "restarts")
_ANSWER = 0.4  # [s] for a supervisor to answer; its state file is as recent, except for what died since
_CLEANS_UP = f"{NO_SUPERVISOR}, so it brakes and ends; 'rbxcompose down {{}}', or the next 'up', cleans up"
_BLOCKED = "blocked"  # the state of a component that runs but cannot do its work


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_addressed_robot(parser, "only this robot, by name or file; or a system")
    parser.add_argument("--json", action="store_true", help="answer in JSON; several robots are a list 'robots'")


def run(arguments: argparse.Namespace) -> int:
    """Show the supervisor's answer or, if it does not answer, the last state that it wrote."""
    wanted = arguments.robot or arguments.path
    several = robots_up() if wanted is None else []
    if len(several) > 1:
        return _tell_all(several, in_json=arguments.json)
    shown = _shown(find_robot(wanted))
    emit(json.dumps(shown) if arguments.json else _table(shown))
    return 0


def _tell_all(folders: Iterable[RobotFolder], *, in_json: bool) -> int:
    """Show all robots; report those that nothing is known of."""
    shown, lost = [], []
    for folder in folders:
        try:
            shown.append(_shown(folder))
        except NotDoneError as error:
            lost.append(error.finding)
    if shown:
        emit(json.dumps({"robots": shown}) if in_json else "\n\n".join(map(_table, shown)))
    return max((refuse(item) for item in lost), default=0)


def _shown(folder: RobotFolder) -> dict[str, Any]:
    written = known_state(folder)
    if written is not None and written.supervisor.is_stopped:
        return _last_known(written)  # the supervisor cannot answer
    try:
        state = answer_of(folder, RobotStatus(), timeout=_ANSWER)
    except NotDoneError:
        written = known_state(folder)
        if written is None:
            raise
        return _last_known(written)
    return _data(state, state.supervisor.pid)


def _data(state: RobotState, supervisor: int | None) -> dict[str, Any]:
    return {
        "robot": state.robot,
        "version": state.package_version,
        "supervisor": {"pid": supervisor},
        "router": {"endpoint": state.router},
        "real": state.layers.real,
        "stop": None if state.stop is None else to_data(state.stop),
        "clocks": {host: to_data(clock) for host, clock in state.clocks.items()},
        "components": [_component(component) for component in state.components],
    }


def _component(state: ComponentState) -> dict[str, object]:
    """Return one component; a blocked one with what blocks it."""
    fields = {key: getattr(state, key) for key in ("name", "type", "process", "pid", "restarts")}
    fields |= {"note": state.note} if state.note else {}
    if state.waits_for is None:
        return {**fields, "state": state.state}
    return {**fields, "state": _BLOCKED if state.state == "active" else state.state, "waits_for": state.waits_for}


def _last_known(state: RobotState) -> dict[str, Any]:
    alive = state.alive()
    pids = {name: process.pid for name, process in alive.items()}
    components = tuple(
        replace(component, state=_state(component, alive), pid=pids.get(component.process))
        for component in state.components
    )
    router = state.router if "router" in alive else None
    supervisor = state.supervisor.pid if state.is_supervised else None
    return _data(replace(state, components=components, router=router), supervisor)


def _state(component_state: ComponentState, alive: Mapping[str, Process]) -> str:
    if component_state.process not in alive:
        return component_state.state if component_state.state == "failed" else "dead"
    return SUSPENDED if alive[component_state.process].is_stopped else component_state.state


def _table(shown: Mapping[str, Any]) -> str:
    pid, endpoint = shown["supervisor"]["pid"], shown["router"]["endpoint"]
    head = f"{shown['robot']}: supervisor {pid or 'dead'}, router {endpoint or 'none'}"
    rows = [[_cell(component[column]) for column in _COLUMNS] for component in shown["components"]]
    blocked = [component for component in shown["components"] if "waits_for" in component]
    waiting = [f"{component['name']} waits for {component['waits_for']}, which failed" for component in blocked]
    notes = [f"{component['name']}: {component['note']}" for component in shown["components"] if "note" in component]
    clocks = [f"clock of {host}: {ClockOffset(**clock).words}" for host, clock in shown["clocks"].items()]
    last = version_problem(shown["robot"], shown["version"]) if pid else _CLEANS_UP.format(shown["robot"])
    lines = [head, *_stop_lines(shown["stop"]), table([_COLUMNS, *rows]), *waiting, *notes, *clocks]
    return "\n".join([*lines, last] if last else lines)


def _stop_lines(stop: Mapping[str, Any] | None) -> Iterator[str]:
    """Yield who stopped the robot, and what is needed before it can be released."""
    if stop is not None:
        yield f"STOPPED at {stop['time']:.1f} s by {stop['by']}"
        reasons = [f"'{name}': {reason}" for name, reason in stop["holds"].items()]
        yield f"'release' is refused, because of {', '.join(reasons)}" if reasons else "'release' allows motion again"


def _cell(value: object) -> str:
    return "-" if value is None else str(value)
