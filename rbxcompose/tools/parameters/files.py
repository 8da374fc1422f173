"""Live values beside the files of the robot, and into them: `param diff`, `dump`, `save`, also of another host."""

import argparse
import json
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rbxcompose.base.config import Config, key_of, leaves, value_at, with_values
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.base.findings import Fix, Related, Span, apply_fixes, kind
from rbxcompose.base.printable import plain
from rbxcompose.base.units import Dimension
from rbxcompose.bus.names import resolve
from rbxcompose.commands.console import NotDoneError, emit
from rbxcompose.commands.guest import NO_NAME, Guest
from rbxcompose.commands.hosts import UNREACHED, Remote, on_all
from rbxcompose.commands.lookup import NO_ANSWER, answer_of, find_robot, known_state, place_of
from rbxcompose.commands.messages import to_json
from rbxcompose.compiler.compile import Compilation
from rbxcompose.compiler.composition.value_edits import UnsavableError, edit_of, is_same, merged, value_text
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.diff import Change, Difference, difference
from rbxcompose.compiler.plan.dump import dump
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.tree import FILE_BYTES, at
from rbxcompose.msgs.rbxcompose_parameters import ParameterChange
from rbxcompose.msgs.rcl_interfaces import GetParameters, Parameter, ParameterValue
from rbxcompose.runtime.folder import RobotFolder, RobotState
from rbxcompose.runtime.plan_requests import AdoptSaved, ComparePlan, PlanComparison
from rbxcompose.runtime.supervision.plan_change import Fate
from rbxcompose.sdk.parameters import UnsettableError, changed, dimension_of, from_message, settings, to_message
from rbxcompose.tools.inspection.origin import origin_of
from rbxcompose.tools.live_rules import compiled_with
from rbxcompose.tools.parameters.changes import PIPED, change_values, changes_of, message_of, write_values
from rbxcompose.tools.parameters.nodes import ParameterNodes, listed
from rbxcompose.tools.project_texts import difference as difference_of
from rbxcompose.tools.project_texts import hash_of
from rbxcompose.tools.system_runs import layers_of

NOT_SAVED = kind("RBX9044")
CHANGED_SINCE = kind("RBX9045")
_COMPARE = 10.0  # [s] for the supervisor to read a plan
_ANSWER = 2.0  # [s] for a component to say its values
NO_FILES = kind("RBX9046")
_LARGEST = 10_000_000  # [bytes] of a file of parameters


@dataclass(frozen=True, slots=True)
class LiveChange:
    """A setting that is another one than in the manifest; numbers are SI."""

    component: str
    name: str
    written: object
    live: object
    dimension: Dimension | None

    @property
    def path(self) -> str:
        """Return its name: `battery.runtime`."""
        return f"{self.component}.{self.name}"


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """A compiled robot, and the configurations that its components have now, by name."""

    robot: Robot
    plan: Plan
    sources: Mapping[str, str]
    now: Mapping[str, Config]

    @property
    def changes(self) -> Iterator[LiveChange]:
        """Yield what is not as in the manifest."""
        for name, config in self.now.items():
            written = self.robot.components[name].config
            for one, field in leaves(config):
                old, new = value_at(written, one), value_at(config, one)
                if not is_same(old, new):
                    yield LiveChange(name, one, old, new, dimension_of(field))

    def node(self, component: str) -> str:
        """Return the name of a component on the bus: `/left/battery`."""
        return resolve(component, self.robot.manifest.bus.namespace or "")

    def plan_with(self, configs: Mapping[str, Config]) -> Plan:
        """Return the plan of the manifest, with other configurations of some components."""
        instances = (
            replace(instance, config=configs.get(instance.name, instance.config)) for instance in self.plan.instances
        )
        return replace(self.plan, instances=tuple(instances))


def live_settings(nodes: ParameterNodes, state: RobotState) -> LiveSettings | None:
    """Return the settings of a robot that runs; None if its files have errors now."""
    found = compiled_with(state.file, state.layers)
    if found.robot is None or found.plan is None:
        return None
    return LiveSettings(found.robot, found.plan, found.sources, live_configs(nodes, found.robot))


def live_configs(nodes: ParameterNodes, robot: Robot) -> dict[str, Config]:
    """Return the configurations of all components that are on the bus, with the values that they have now."""
    configs = {name: robot.components[name].config for node, name in nodes_of(robot).items() if node in nodes.names}
    live = {name: names for name, config in configs.items() if (names := _live_names(config))}
    asked = [resolve(name, robot.manifest.bus.namespace or "") for name in live]
    requests = [GetParameters.Request(names=tuple(names)) for names in live.values()]
    answers = nodes.ask(asked, "get_parameters", GetParameters, requests)
    for (name, names), answer in zip(live.items(), answers, strict=True):
        pairs = zip(names, answer.values, strict=True)
        configs[name] = _with_live(configs[name], {setting: value for setting, value in pairs if value.type})
    return configs


def _live_names(config: Config) -> list[str]:
    return [setting.name for setting in settings(config).values() if setting.is_live]


def _with_live(config: Config, values: Mapping[str, ParameterValue]) -> Config:
    """Return a configuration with the values that its settings have now."""
    with suppress(UnsettableError):  # its file has changed meanwhile
        return changed(config, [Parameter(name=name, value=value) for name, value in values.items()])
    return config


def nodes_of(robot: Robot) -> dict[str, str]:
    """Return the components of a robot by the names of their nodes: `/left/battery`."""
    return {resolve(name, robot.manifest.bus.namespace or ""): name for name in robot.components}


Compiled = Callable[[Mapping[Path, str]], Compilation]


@dataclass(frozen=True, slots=True)
class NewTexts:
    """What is to be written: the texts of files before and after, by path; the edits with their places."""

    before: Mapping[Path, bytes]
    after: Mapping[Path, bytes]
    fix: Fix

    @property
    def hash(self) -> str:
        """Return what tells whether the same would be written into the same files."""
        parts = ((str(path).encode(), self.before[path], data) for path, data in sorted(self.after.items()))
        return hash_of(b"".join(f"{len(part)} ".encode() + part for one in parts for part in one))

    @property
    def difference(self) -> list[str]:
        """Return the lines that change, below the name of each file."""
        lines: list[str] = []
        for path, data in self.after.items():
            old, new = (text.decode("utf-8-sig").replace("\r\n", "\n") for text in (self.before[path], data))
            lines += [f"@@ {shown_name(path)} @@", *difference_of(old, new)]
        return lines


def files_with(live: LiveSettings, changes: Sequence[LiveChange], compiled: Compiled) -> NewTexts:
    """Return the files of a robot with values written into them; `compiled` returns the robot with other texts.

    Raises:
        NotDoneError: if one of the values cannot be written, or something else would change by it.
    """
    edits = []
    for change in changes:
        path = live.robot.components[change.component].place(key_of(live.now[change.component], change.name))
        try:
            edits.append(edit_of(live.robot.manifest, live.sources, path, change.live, change.dimension))
        except UnsavableError as error:
            message = f"'{change.path}' cannot be saved: {error.reason}"
            raise NotDoneError(NOT_SAVED.at(error.span, message, help=error.help)) from error
    try:
        fix = merged(edits)
    except UnsavableError as error:
        raise NotDoneError(NOT_SAVED.at(error.span, f"nothing is saved: {error.reason}")) from error
    texts = _edited(live, fix)
    _require_nothing_else(live, changes, texts, compiled)
    return texts


def write(texts: NewTexts) -> None:
    """Write all files; if one cannot be written, those before it are what they were.

    Raises:
        NotDoneError: if one cannot be written.
    """
    done: list[Path] = []
    for path, data in texts.after.items():
        try:
            if read_regular(path, FILE_BYTES) != texts.before[path]:
                raise OSError(None, "it has changed meanwhile")
            replace_file(path, data)
        except OSError as error:
            for one in done:
                replace_file(one, texts.before[one])
            raise NotDoneError(NOT_SAVED.at(None, f"nothing is saved: '{path}': {error.strerror}")) from error
        done.append(path)


def require_unedited(
    live: LiveSettings, changes: Iterable[LiveChange], folder: RobotFolder, history: Sequence[ParameterChange]
) -> None:
    """Refuse to save values whose places in the files say something that the robot has never had.

    Raises:
        NotDoneError: if there is one.
    """
    edited = _keys_changed(live.plan, folder)
    for change in changes:
        if change.path in edited and not any(is_same(value, change.written) for value in _values(history, change.path)):
            span = live.robot.value(*live.robot.components[change.component].place(change.name))
            was, now = edited[change.path]
            message = f"'{change.path}' is {now} in the file now; the robot came up with {was}"
            raise NotDoneError(CHANGED_SINCE.at(span, message, help="'rbxcompose param reset' takes over the file"))


def changed_since_up(live: LiveSettings, folder: RobotFolder, history: Sequence[ParameterChange]) -> list[LiveChange]:
    """Return what is not as in the files because somebody has set it, not because a file was edited."""
    found = list(live.changes)
    if not found:
        return []
    kept = _keys_changed(live.plan_with(live.now), folder).keys() | {
        f"{change.component}.{change.name}" for change in history
    }
    return [change for change in found if change.path in kept]


def staying(robot: Robot, plan: Plan, found: PlanComparison, folder: RobotFolder) -> Iterator[str]:
    """Yield which values a change to this plan leaves as somebody has set them, beside those of the files."""
    replaced = {
        component.name: [reason.key for reason in component.reasons]
        for component in found.components
        if component.fate in (Fate.KEPT, Fate.LIVE)
    }
    with suppress(NotDoneError), Guest(place_of(folder)) as guest:  # what does not answer now has other troubles
        live = LiveSettings(robot, plan, {}, live_configs(ParameterNodes(guest, _ANSWER), robot))
        for change in live.changes:
            keys = replaced.get(change.component)
            if keys is not None and not any(f"{key}.".startswith(f"{change.name}.") for key in keys):
                stays, written = shown(change, change.live), shown(change, change.written)
                reset = f"'rbxcompose param reset {change.path}' takes that"
                yield f"{change.path} stays at {stays} as set live; the files have {written}: {reset}"


def _values(history: Iterable[ParameterChange], path: str) -> Iterator[object]:
    for change in history:
        if f"{change.component}.{change.name}" == path:
            yield from (from_message(change.before), from_message(change.after))


def _keys_changed(plan: Plan, folder: RobotFolder) -> dict[str, tuple[str, str]]:
    """Return the settings in which a plan differs from that of the running robot, with both values in words."""
    text = dump(plan, reveals_secrets=True)  # the socket is this user's alone
    found = answer_of(folder, ComparePlan(text), timeout=_COMPARE)
    each = ((component.name, reason) for component in found.components for reason in component.reasons)
    return {f"{name}.{change.key}": (change.before or "nothing", change.after or "nothing") for name, change in each}


def _edited(live: LiveSettings, fix: Fix) -> NewTexts:
    files = live.robot.manifest.files
    before = {}
    for shown in dict.fromkeys(edit.span.file for edit in fix.edits):
        data = read_regular(files[shown], FILE_BYTES)
        if data.decode("utf-8-sig").replace("\r\n", "\n") != live.sources[shown]:
            raise NotDoneError(NOT_SAVED.at(None, f"nothing is saved: '{shown}' has changed meanwhile"))
        before[shown] = data
    texts = {shown: data.decode("utf-8") for shown, data in before.items()}
    ends = {shown: "\r\n" if "\r\n" in text else "\n" for shown, text in texts.items()}
    edits = (replace(edit, text=edit.text.replace("\n", ends[edit.span.file])) for edit in fix.edits)
    out = apply_fixes([replace(fix, edits=tuple(edits))], texts)
    if not out.done:
        raise NotDoneError(NOT_SAVED.at(None, "nothing is saved: the values are written in an unusual way"))
    after = {files[shown]: text.encode("utf-8") for shown, text in out.texts.items() if text != texts[shown]}
    return NewTexts({files[shown]: data for shown, data in before.items()}, after, fix)


def _require_nothing_else(
    live: LiveSettings, changes: Sequence[LiveChange], texts: NewTexts, compiled: Compiled
) -> None:
    """Compile what would be written: it must say the new values, and nothing else may be another one."""
    unsaved = {path: data.decode("utf-8") for path, data in texts.after.items()}
    found = compiled(unsaved)
    if found.plan is None or found.robot is None:
        error = next(finding for finding in found.report if finding.severity == "error")
        related = (Related(error.span, "here"),) if error.span else ()
        message = f"nothing is saved: the files would be wrong: {error.message} ({error.code})"
        raise NotDoneError(NOT_SAVED.at(None, message, help=error.help, related=related))
    wanted: dict[str, Config] = {}
    for change in changes:
        config = wanted.get(change.component, live.robot.components[change.component].config)
        said = value_at(found.robot.components[change.component].config, change.name)
        wanted[change.component] = with_values(
            config, {change.name: said if is_same(said, change.live) else change.live}
        )
    side_effects = _written_among(difference(live.plan_with(wanted), found.plan), found.robot)
    if not side_effects.is_empty:
        message = f"nothing is saved: {_keys_of(side_effects)} would change, too, which is written at the same place"
        help_text = "set that as well, or write the value into the component by hand"
        raise NotDoneError(NOT_SAVED.at(texts.fix.edits[0].span, message, help=help_text))


def _written_among(found: Difference, robot: Robot) -> Difference:
    """Return a difference without the settings that no file has, such as limits that follow those of another one."""
    root, kept = robot.manifest.root, dict[str, tuple[Change, ...]]()
    for name, each in found.changed.items():
        place = robot.components[name].place
        if written := tuple(change for change in each if at(root, place(change.key)) is not None):
            kept[name] = written
    return replace(found, changed=kept)


def _keys_of(found: Difference) -> str:
    keys = [f"{name}.{change.key}" for name, each in found.changed.items() for change in each]
    keys += [change.key for change in found.plan]
    return ", ".join(f"'{key}'" for key in keys) or "the robot"


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
        help_text = f"'rbxcompose check {state.file}' shows them"
        raise NotDoneError(NO_FILES.at(None, f"the files of '{state.robot}' have errors now", help=help_text))
    return live, folder, state


def param_diff(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Show what is not as in the manifest; the exit code is 1 if there is anything."""
    live, _, _ = manifest_of(nodes, arguments)
    return write_differences(live, arguments)


def write_differences(live: LiveSettings, arguments: argparse.Namespace) -> int:
    """Tell what is not as in the manifest, and return the exit code."""
    found = list(live.changes)
    if arguments.json:
        emit(json.dumps([{**_data(change), "place": str(place(live, change))} for change in found]))
    else:
        lines = [f"{_change_text(change)}  # {place(live, change)}" for change in found]
        emit("\n".join(lines) or "all values are those of the manifest")
    return 1 if found else 0


def param_reset(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Set parameters to the values that the manifest has now."""
    live, _, _ = manifest_of(nodes, arguments)
    wanted: dict[str, list[Parameter]] = {}
    for change in chosen(list(live.changes), live, arguments.names):
        wanted.setdefault(live.node(change.component), []).append(Parameter(change.name, message_of(change.written)))
    if not wanted:
        emit("[]" if arguments.json else "all values are those of the manifest")
        return 0
    change_values(nodes, wanted, "reset")
    return write_values(nodes, wanted, arguments)


def param_dump(nodes: ParameterNodes, arguments: argparse.Namespace) -> int:
    """Write the parameters that may change, as YAML for `load`."""
    wanted = [nodes.find(arguments.component)] if arguments.component else nodes.names
    found = [one for one in listed(nodes, wanted) if not one.about.read_only and one.value is not None]
    if arguments.json:
        data: dict[str, dict[str, object]] = {}
        for one in found:
            data.setdefault(one.node.removeprefix("/"), {})[one.about.name] = one.value
        emit(to_json(data))
        return 0
    lines, node = [], ""
    for one in found:
        lines += [f"{one.node.removeprefix('/')}:"] if one.node != node else []
        node = one.node
        value = value_text(one.value, one.dimension).replace("$$", "$")  # exact to the last but one bit
        lines.append(f"  {one.about.name}: {value}")
    emit("\n".join(lines) or "{}")
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
    exit_code = save(live, changes, partial(compiled_with, state.file, state.layers), arguments)
    if changes and not arguments.dry_run:
        names: dict[str, list[str]] = {}
        for change in changes:
            names.setdefault(change.component, []).append(change.name)
        with suppress(NotDoneError):  # while it is changed, or goes down; `apply` then shows again what is saved
            answer_of(folder, AdoptSaved(dump(live.plan_with(live.now), reveals_secrets=True), names), timeout=_COMPARE)
    return exit_code


def save(live: LiveSettings, changes: Sequence[LiveChange], compiled: Compiled, arguments: argparse.Namespace) -> int:
    """Write changes into the files of the robot, and report them.

    Raises:
        NotDoneError: if one cannot be written, or something else would change by it.
    """
    places: list[str] = []
    lines: list[str] = []
    seen = ""
    if changes:
        texts = files_with(live, changes, compiled)
        lines, seen = texts.difference, texts.hash
        if arguments.only_as not in ("", seen):
            message = "nothing is saved: the files or the values have changed since they were shown"
            raise NotDoneError(NOT_SAVED.at(None, message, help="look at them again with '--dry-run'"))
        if not arguments.dry_run:
            write(texts)
        places = sorted(str(edit.span) for edit in texts.fix.edits)
    if arguments.json:
        written = {"places": places, "difference": lines, "hash": seen, "dry_run": arguments.dry_run}
        emit(json.dumps({"saved": [_data(change) for change in changes], **written}))
        return 0
    for change in changes:
        emit(_change_text(change))
    verb = "would be written" if arguments.dry_run else "written"
    emit("\n".join(f"{verb}: {one}" for one in places) or "nothing to save: all values are those of the manifest")
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
    return [change for change in changes if not names or {change.path, change.component} & set(names)]


def shown(change: LiveChange, value: object) -> str:
    """Return a value of a setting as a manifest says it."""
    return "nothing" if value is None else value_text(value, change.dimension)


def _change_text(change: LiveChange) -> str:
    return f"{change.path}: {shown(change, change.written)} -> {shown(change, change.live)}"


def _data(change: LiveChange) -> dict[str, object]:
    old, new = (json.loads(to_json(one)) for one in (change.written, change.live))
    return {"component": change.component, "name": change.name, "old": old, "new": new}


@dataclass(frozen=True, slots=True)
class RemoteParameters:
    """The parameters of a robot of a system; `words` is the command as a host of it would take it.

    The files here have a robot with simulated devices and one with real ones: the one meant is the one that runs.
    """

    system: System
    robot: PlacedRobot
    remote: Remote
    words: Sequence[str]

    def run(self, arguments: argparse.Namespace) -> int:
        """Carry the command out and return its exit code."""
        if arguments.action == "load":
            return self._load(arguments.file)
        compiled = partial(self._compiled, real=bool(self._ask("ps").get("real")))
        live = self._live(compiled({}))
        match arguments.action:
            case "diff":
                return write_differences(live, arguments)
            case "reset":
                return self._reset(chosen(list(live.changes), live, arguments.names), arguments)
            case _:
                return self._save(live, compiled, arguments)

    def _load(self, file: Path) -> int:
        """Send a file of parameters along."""
        if str(file) == PIPED:
            return subprocess.run(self.remote.rbxcompose(self.words), check=False).returncode
        try:
            text = read_regular(file, _LARGEST)
        except OSError as error:
            raise NotDoneError(NO_FILES.at(None, f"'{file}' cannot be read: {error.strerror}")) from error
        words = [PIPED if word == str(file) else word for word in self.words]
        return subprocess.run(self.remote.rbxcompose(words), input=text, check=False).returncode

    def _reset(self, changes: Sequence[LiveChange], arguments: argparse.Namespace) -> int:
        """Set what is other than in the manifest."""
        if not changes:
            emit("[]" if arguments.json else "all values are those of the manifest")
            return 0
        pairs = [f"{change.path}={json.dumps(change.written, default=str)}" for change in changes]
        return subprocess.run(
            self._there("param", "set", *pairs, *(["--json"] if arguments.json else [])), check=False
        ).returncode

    def _save(self, live: LiveSettings, compiled: Compiled, arguments: argparse.Namespace) -> int:
        """Write what somebody has set into the files on this machine."""
        had: dict[str, list[object]] = {}
        for entry in self._ask("param", "history"):
            had.setdefault(f"{entry['component']}.{entry['name']}", []).extend(
                (_plain(entry["before"]), _plain(entry["after"]))
            )
        changes = chosen(
            [live_change for live_change in live.changes if live_change.path in had], live, arguments.names
        )
        for change in changes:
            if not any(is_same(value, _plain(_json(change.written))) for value in had[change.path]):
                span = live.robot.value(*live.robot.components[change.component].place(change.name))
                message = (
                    f"'{change.path}' is {shown(change, change.written)} in the file now, which the robot has never had"
                )
                raise NotDoneError(CHANGED_SINCE.at(span, message, help="'rbxcompose apply' takes over the file"))
        return save(live, changes, compiled, arguments)

    def _live(self, found: Compilation) -> LiveSettings:
        """Return the settings that the robot has now, beside those of the files here, as they are compiled.

        Raises:
            NotDoneError: if the robot does not report them.
        """
        dumped = self._ask("param", "dump")
        if found.robot is None or found.plan is None:
            raise NotDoneError(NO_FILES.at(None, f"the files of '{self.robot.name}' have errors"))
        return LiveSettings(found.robot, found.plan, found.sources, dict(_configs(found.robot, dumped)))

    def _compiled(self, unsaved: Mapping[Path, str], *, real: bool) -> Compilation:
        """Return the robot as it is by itself, with other texts of its files."""
        layers = layers_of(self.system, self.robot, real=real)
        return compiled_with(self.robot.plan.file, layers, unsaved)

    def _ask(self, *words: str) -> Any:
        """Return what the robot answers.

        Raises:
            NotDoneError: if it does not.
        """
        done = on_all({"": self._there(*words, "--json")})[""]
        if done.wait() or done.answer is None:
            why = plain(done.lines[0]) if done.lines else "it says nothing"
            raise NotDoneError(UNREACHED.at(None, f"'{self.remote.name}' does not report the parameters: {why}"))
        return done.answer

    def _there(self, *words: str) -> list[str]:
        return self.remote.rbxcompose([*words, "--robot", self.robot.name])


def _configs(robot: Robot, dumped: Mapping[str, Mapping[str, object]]) -> Iterator[tuple[str, Config]]:
    """Yield the components in a dump, with the live values of each."""
    for node, name in nodes_of(robot).items():
        values = dumped.get(node.removeprefix("/"))
        if values is None:
            continue
        config = robot.components[name].config
        live = _live_names(config)
        messages = {key: to_message(_plain(value)) for key, value in values.items() if key in live}
        yield name, _with_live(config, {key: message for key, message in messages.items() if message is not None})


def _json(value: object) -> object:
    return json.loads(json.dumps(value, default=str))


def _plain(value: object) -> object:
    """Return a value from JSON as parameters have it."""
    return tuple(value) if isinstance(value, list) else value
