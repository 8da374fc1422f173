"""Print a script that makes a shell complete commands, options, files, robots and topics.

For bash: `rbxcompose completion bash > ~/.local/share/bash-completion/completions/rbxcompose`. For zsh: the same as
`_rbxcompose` in a folder of `$fpath`. For fish: `~/.config/fish/completions/rbxcompose.fish`.
"""

import argparse
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import partial
from pathlib import Path
from threading import Thread

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.graph import Graph
from rbxcompose.commands.console import NotDoneError, emit
from rbxcompose.commands.lookup import BusPlace, answer_of, find_place, find_robot, known_state, robots_up
from rbxcompose.commands.verbs import load, parser_of, verbs
from rbxcompose.domains.muxes.requests import MUX, LookAtMux
from rbxcompose.runtime.folder import ComponentState

GROUP = "system"
# A script queries the candidates each time, so that it need not change with each version.
_BASH = r"""_rbxcompose() {
    local one
    COMPREPLY=()
    while IFS= read -r one; do
        COMPREPLY+=("$(printf %q "$one")")
    done < <(rbxcompose __complete bash "${COMP_LINE:0:COMP_POINT}" 2>/dev/null)
    if [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == */ ]]; then
        compopt -o nospace 2>/dev/null
    fi
}
complete -F _rbxcompose rbxcompose"""
_ZSH = r"""#compdef rbxcompose
_rbxcompose() {
    local -a found
    found=("${(@f)$(rbxcompose __complete zsh "${(@)words[1,CURRENT]}" 2>/dev/null)}")
    compadd -S '' -- ${(M)found:#*/}
    compadd -- ${found:#*/}
}
if [[ $funcstack[1] == _rbxcompose ]]; then
    _rbxcompose
else
    compdef _rbxcompose rbxcompose
fi"""
_FISH = r"""function __rbxcompose_complete
    set -l current (commandline -ct)
    rbxcompose __complete fish (commandline -opc) "$current" 2>/dev/null
end
complete -c rbxcompose -f -a '(__rbxcompose_complete)'"""
SCRIPTS = {"bash": _BASH, "zsh": _ZSH, "fish": _FISH}
_GENERAL = ("--help", "--version")
_BREAKS = re.compile(r".*[:=]", re.DOTALL)  # bash treats these as ends of words and replaces only what follows
_SEVERAL = ("*", "+")
PATIENCE = 0.3  # [s] in which the bus must answer; a person at the keyboard does not wait longer
_MANIFESTS = (".yaml", ".yml")
_BUS = {"TOPIC": "topics", "PATTERN": "topics", "SERVICE": "services", "ACTION": "actions"}  # attributes of the graph


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("shell", choices=list(SCRIPTS), help="the shell that will read it")


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    emit(SCRIPTS[arguments.shell])
    return 0


Values = Callable[[str, str, str, Mapping[str, str]], Iterable[str]]
"""Finds candidates for the value of an argument by its metavar, its `dest` and what is typed of it; the last one has
the options typed so far by `dest`, other words by metavar."""


@dataclass(slots=True)
class _Place:
    """The position of the current word in a command line."""

    parser: argparse.ArgumentParser
    option: argparse.Action | None = None  # the option that waits for its value
    given: dict[str, str] = field(default_factory=dict)
    positionals: list[argparse.Action] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.positionals = [action for action in self.parser._actions if not action.option_strings]

    def go(self, word: str) -> None:
        """Step over a word."""
        options = self.parser._option_string_actions
        name, equals, value = word.partition("=")
        if name in options:
            action = options[name]
            self.option = None if equals or action.nargs == 0 else action
            self.given.update({action.dest: value} if equals else {})
        elif self.option is not None:
            self.given[self.option.dest] = word
            self.option = self.option if self.option.nargs in _SEVERAL else None
        elif self.positionals:
            first = self.positionals[0]
            if isinstance(first, argparse._SubParsersAction):
                if word in first.choices:
                    self.parser = first.choices[word]
                    self.__post_init__()
            else:
                self.given.setdefault(str(first.metavar), word)
                if first.nargs not in _SEVERAL:
                    self.positionals.pop(0)

    def fitting(self, current: str, values: Values) -> Iterable[str]:
        """Yield the candidates for the current word."""
        options = self.parser._option_string_actions
        name, equals, value = current.partition("=")
        if equals and name in options:
            yield from (f"{name}={one}" for one in self._values(options[name], value, values))
        elif self.option is not None and not (current.startswith("-") and self.option.nargs in _SEVERAL):
            yield from self._values(self.option, current, values)
        elif current.startswith("-") or not self.positionals:
            yield from (option for option in options if option.startswith("--"))
        else:
            yield from self._values(self.positionals[0], current, values)

    def _values(self, action: argparse.Action, current: str, values: Values) -> Iterable[str]:
        if action.choices is not None:
            return map(str, action.choices)
        return values(str(action.metavar or ""), action.dest, current, self.given)


def candidates(words: Sequence[str], values: Values) -> list[str]:
    """Return the sorted candidates for the last of `words`, the words after `rbxcompose`."""
    *before, current = words
    if not before:
        found: Iterable[str] = _GENERAL if current.startswith("-") else verbs()
    elif before[0] not in verbs():
        found = ()
    else:
        place = _Place(parser_of(before[0], load(before[0])))
        for word in before[1:]:
            place.go(word)
        found = place.fitting(current, values)
    return sorted({text for text in found if text.startswith(current)})


def for_shell(shell: str, words: Sequence[str], find: Callable[[Sequence[str]], list[str]]) -> list[str]:
    """Return the candidates as a shell wants them: bash passes the line, the others its words with `rbxcompose`."""
    if shell != "bash":
        return find(list(words[1:]) or [""])
    typed = _split(words[0] if words else "")
    broken = _BREAKS.match(typed[-1])
    return [one[broken.end() if broken else 0 :] for one in find(typed)]


def _split(line: str) -> list[str]:
    """Return the words of a line after the first; the last one may be incomplete."""
    for ending in ("", "'", '"'):
        try:
            words = shlex.split(line + ending)
        except ValueError:
            continue  # a quote is open
        return words[1:] + [""] * (not ending and (line[-1:].isspace() or len(words) < 2))
    return [""]


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
        return [text for what in kinds for text in self._of(what, current, given)]

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
                return [state.name for state in _states(given)]
            case "MUX":
                return [state.name for state in _states(given) if state.type == MUX]
            case "INPUT":
                return _inputs(given)
            case "SETTING":
                return [f"{state.name}.{name}" for state in _states(given) for name in _live(state)]
            case "PARAMETER":
                component = given.get("COMPONENT") or next((given[name] for name in given if "PARAMETER" in name), "")
                return [name for state in _states(given) if state.name == component for name in _live(state)]
            case "TYPE":
                return _types()
        return ()

    def _names(self, what: str, current: str, given: Mapping[str, str]) -> list[str]:
        try:
            graph = self._graph(_place(given))
        except NotDoneError:
            return []
        names = [graph_name.name for graph_name in getattr(graph, what) if not graph_name.is_hidden]
        return names if current[:1] in ("/", "") else [name.removeprefix("/") for name in names]


def _states(given: Mapping[str, str]) -> Sequence[ComponentState]:
    try:
        state = known_state(find_robot(given.get("robot")))
    except NotDoneError:
        return []
    return state.components if state else []


def _inputs(given: Mapping[str, str]) -> list[str]:
    """Return the inputs of all muxes of a robot."""
    names = [state.name for state in _states(given) if state.type == MUX]
    try:
        folder = find_robot(given.get("robot"))
        states = [answer_of(folder, LookAtMux(name), timeout=PATIENCE) for name in names]
    except NotDoneError:
        return []
    return [each.name for state in states for each in state.inputs]


def _live(component: ComponentState) -> list[str]:
    """Return the settings of a component that may change, as its type declares them: the bus is not asked."""
    from rbxcompose.base.config import live_names
    from rbxcompose.base.plugins import BrokenPluginError
    from rbxcompose.sdk.registry import component_type

    try:
        return list(live_names(component_type(component.type).config_type()))
    except (KeyError, BrokenPluginError):
        return []


def _place(given: Mapping[str, str]) -> BusPlace:
    domain = given.get("domain", "")
    number = int(domain) if domain.isdecimal() else None
    return find_place(argparse.Namespace(router=given.get("router"), robot=given.get("robot"), domain=number))


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
    names = [f"{path.name}/" if path.is_dir() else path.name for path in found]
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
    found = for_shell(words[0], words[1:], partial(candidates, values=KnownValues(_at_once).of))
    sys.stdout.write("".join(f"{text}\n" for text in found))
    sys.stdout.flush()
    return 0


def _at_once(place: BusPlace) -> Graph:
    """Query a bus with a short timeout: a stopped router accepts connections but says nothing."""
    graphs: list[Graph] = []
    asking = Thread(target=lambda: graphs.extend(_ask(place)), daemon=True)
    asking.start()
    asking.join(PATIENCE)
    if asking.is_alive():
        os._exit(0)  # nothing has been printed; the thread cannot be ended in another way
    return graphs[0] if graphs else Graph((), (), (), ())


def _ask(place: BusPlace) -> Iterable[Graph]:
    from rbxcompose.commands.guest import Guest  # imports the bus, which few arguments need

    try:
        with Guest(place) as guest:
            yield guest.graph()
    except NotDoneError:
        return
