"""Completion of values: files, running robots, their components and topics."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from threading import Thread

from rbxcompose.bus.graph import Graph
from rbxcompose.cli.bus.place import BusPlace, place_of
from rbxcompose.cli.completions.candidates import candidates, for_shell
from rbxcompose.cli.robots.lookup import NotDoneError, answer_of, find_robot, known_state, robots_up
from rbxcompose.mux.requests import MUX, LookAtMux
from rbxcompose.runtime.folder import ComponentState

PATIENCE = 0.3  # [s] in which the bus must answer; a person at the keyboard does not wait longer
_MANIFESTS = (".yaml", ".yml")
_BUS = {"TOPIC": "topics", "PATTERN": "topics", "SERVICE": "services", "ACTION": "actions"}  # attributes of the graph

Tell = Callable[[BusPlace], Graph]


class KnownValues:
    """Finds values; `graph` returns the graph of a bus."""

    def __init__(self, graph: Tell) -> None:
        self._graph = graph

    def of(self, metavar: str, dest: str, current: str, given: Mapping[str, str]) -> Iterable[str]:
        """Return the candidates for an argument."""
        if dest == "robot" and metavar == "NAME":
            return robots()
        kinds = metavar.split("|")
        if metavar in given and "PARAMETER" in kinds:  # the words that follow the first one
            kinds = ["SETTING" if "=" in given[metavar] else "PARAMETER"]
        return [one for what in kinds for one in self._of(what, current, given)]

    def _of(self, what: str, current: str, given: Mapping[str, str]) -> Iterable[str]:
        match what:
            case "TOPIC" | "PATTERN" | "SERVICE" | "ACTION":
                return self._names(_BUS[what], current, given)
            case "ROBOT":
                return [*robots(), *files(current, _MANIFESTS)]
            case "PATH":
                return files(current, _MANIFESTS)
            case "FILE" | "DIR":
                return files(current)
            case "COMPONENT":
                return [one.name for one in _states(given)]
            case "MUX":
                return [one.name for one in _states(given) if one.type == MUX]
            case "INPUT":
                return _inputs(given)
            case "SETTING":
                return [f"{one.name}.{name}" for one in _states(given) for name in _live(one)]
            case "PARAMETER":
                component = given.get("COMPONENT") or next((given[one] for one in given if "PARAMETER" in one), "")
                return [name for one in _states(given) if one.name == component for name in _live(one)]
            case "TYPE":
                return _types()
        return ()

    def _names(self, what: str, current: str, given: Mapping[str, str]) -> list[str]:
        try:
            graph = self._graph(_place(given))
        except NotDoneError:
            return []
        names = [one.name for one in getattr(graph, what) if not one.is_hidden]
        return names if current[:1] in ("/", "") else [name.removeprefix("/") for name in names]


def _states(given: Mapping[str, str]) -> Sequence[ComponentState]:
    try:
        state = known_state(find_robot(given.get("robot")))
    except NotDoneError:
        return []
    return state.components if state else []


def _inputs(given: Mapping[str, str]) -> list[str]:
    """Return the inputs of all muxes of a robot."""
    names = [one.name for one in _states(given) if one.type == MUX]
    try:
        folder = find_robot(given.get("robot"))
        states = [answer_of(folder, LookAtMux(name), timeout=PATIENCE) for name in names]
    except NotDoneError:
        return []
    return [each.name for one in states for each in one.inputs]


def _live(component: ComponentState) -> list[str]:
    """Return the settings of a component that may change, as its type declares them: the bus is not asked."""
    from rbxcompose.config import live_names
    from rbxcompose.plugins import BrokenPluginError
    from rbxcompose.sdk.registry import component_type

    try:
        return list(live_names(component_type(component.type).config_type()))
    except (KeyError, BrokenPluginError):
        return []


def _place(given: Mapping[str, str]) -> BusPlace:
    domain = given.get("domain", "")
    number = int(domain) if domain.isdecimal() else None
    if "router" in given:
        return BusPlace(given["router"], number or 0)
    found = place_of(find_robot(given.get("robot")))
    return found if number is None else BusPlace(found.router, number)


def robots() -> list[str]:
    """Return the names of running robots."""
    try:
        return [folder.path.name for folder in robots_up()]
    except NotDoneError:
        return []


def files(current: str, endings: tuple[str, ...] = ("",)) -> list[str]:
    """Return the folders, with a slash, and the files with one of `endings` that continue the typed text."""
    head, slash, start = current.rpartition("/")
    try:
        found = sorted(Path(os.path.expanduser(head + slash) or ".").iterdir())
    except OSError:
        return []
    names = [f"{one.name}/" if one.is_dir() else one.name for one in found]
    return [
        f"{head}{slash}{name}"
        for name in names
        if name.startswith(start) and name.endswith(("/", *endings)) and (start or not name.startswith("."))
    ]


def _types() -> list[str]:
    from rbxcompose.msgs import registry
    from rbxcompose.msgs.packages import short

    return [short(name) for name in registry.names("msg")]


def complete(words: Sequence[str]) -> int:
    """Print the candidates for the end of a command line, one per line: `rbxcompose __complete SHELL WORD ...`."""
    if not words:
        return 2
    found = for_shell(words[0], words[1:], partial(candidates, values=KnownValues(_at_once)))
    sys.stdout.write("".join(f"{one}\n" for one in found))
    sys.stdout.flush()
    return 0


def _at_once(place: BusPlace) -> Graph:
    """Query a bus with a short timeout: a stopped router accepts connections but says nothing."""
    told: list[Graph] = []
    asking = Thread(target=lambda: told.extend(_ask(place)), daemon=True)
    asking.start()
    asking.join(PATIENCE)
    if asking.is_alive():
        os._exit(0)  # nothing has been printed; the thread cannot be ended in another way
    return told[0] if told else Graph((), (), (), ())


def _ask(place: BusPlace) -> Iterable[Graph]:
    from rbxcompose.cli.bus.guest import Guest  # imports the bus, which few arguments need

    try:
        with Guest(place) as guest:
            yield guest.graph()
    except NotDoneError:
        return
