"""`param load`, `diff`, `reset` and `save` for a robot on another host: its live values, and the files of this one."""

from __future__ import annotations

import argparse
import json
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.parameters.manifest_verbs import NO_FILES, chosen, save, shown, tell_differences
from rbxcompose.cli.parameters.saved_values import CHANGED_SINCE
from rbxcompose.cli.parameters.texts import PIPED
from rbxcompose.cli.robots.live_rules import compiled_with
from rbxcompose.cli.robots.live_settings import LiveChange, LiveSettings, nodes_of
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.cli.systems.remote import UNREACHED, Remote, on_all
from rbxcompose.cli.systems.share_run import layers_of
from rbxcompose.compiler import Compilation
from rbxcompose.composition.value_edits import is_same
from rbxcompose.config import Config
from rbxcompose.dataclass import dataclass
from rbxcompose.model.robot import Robot
from rbxcompose.msgs.rcl_interfaces import Parameter
from rbxcompose.params.core import UnsettableError, changed, settings
from rbxcompose.params.values import to_message
from rbxcompose.printable import plain
from rbxcompose.regular_files import read_regular
from rbxcompose.systems.model import PlacedRobot, System

WITH_FILES = ("load", "save", "diff", "reset")
_LARGEST = 10_000_000  # [bytes] of a file of parameters


@dataclass(frozen=True, slots=True)
class RemoteParameters:
    """The parameters of a robot of a system; `words` is the command as a host of it would take it.

    The files here have a robot with simulated devices and one with `real` ones: the one meant is the one that runs.
    """

    system: System
    robot: PlacedRobot
    remote: Remote
    words: Sequence[str]
    real: bool = False

    def run(self, arguments: argparse.Namespace) -> int:
        """Carry the command out and return its exit code."""
        try:
            if arguments.action == "load":
                return self._load(arguments.file)
            running = self._ask("ps")
            return replace(self, real=bool(running.get("real")))._compare(arguments)
        except NotDoneError as error:
            return refuse(error.finding)

    def _compare(self, arguments: argparse.Namespace) -> int:
        """Compare the live values with the files, and carry out what follows."""
        live = self._live()
        match arguments.action:
            case "diff":
                return tell_differences(live, arguments)
            case "reset":
                return self._reset(chosen(list(live.changes), live, arguments.names), arguments)
            case _:
                return self._save(live, arguments)

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
            tell("[]" if arguments.json else "all values are those of the manifest")
            return 0
        pairs = [f"{one.path}={json.dumps(one.written, default=str)}" for one in changes]
        return subprocess.run(
            self._there("param", "set", *pairs, *(["--json"] if arguments.json else [])), check=False
        ).returncode

    def _save(self, live: LiveSettings, arguments: argparse.Namespace) -> int:
        """Write what somebody has set into the files on this machine."""
        had: dict[str, list[object]] = {}
        for one in self._ask("param", "history"):
            had.setdefault(f"{one['component']}.{one['name']}", []).extend(
                (_plain(one["before"]), _plain(one["after"]))
            )
        changes = chosen([one for one in live.changes if one.path in had], live, arguments.names)
        for one in changes:
            if not any(is_same(value, _plain(_json(one.written))) for value in had[one.path]):
                span = live.robot.value(*live.robot.components[one.component].place(one.name))
                message = f"'{one.path}' is {shown(one, one.written)} in the file now, which the robot has never had"
                raise NotDoneError(CHANGED_SINCE.at(span, message, help="'rbxcompose apply' takes over the file"))
        return save(live, changes, self._compiled, arguments)

    def _live(self) -> LiveSettings:
        """Return the settings that the robot has now, beside those of the files here.

        Raises:
            NotDoneError: if the robot does not tell them.
        """
        found, told = self._compiled({}), self._ask("param", "dump")
        if found.robot is None or found.plan is None:
            raise NotDoneError(NO_FILES.at(None, f"the files of '{self.robot.name}' have errors"))
        return LiveSettings(found.robot, found.plan, found.sources, dict(_configs(found.robot, told)))

    def _compiled(self, unsaved: Mapping[Path, str]) -> Compilation:
        """Return the robot as it is by itself, with other texts of its files."""
        layers = layers_of(self.system, self.robot, real=self.real)
        return compiled_with(self.robot.plan.file, layers, unsaved)

    def _ask(self, *words: str) -> Any:
        """Return what the robot answers.

        Raises:
            NotDoneError: if it does not.
        """
        done = on_all({"": self._there(*words, "--json")})[""]
        if done.wait() or done.answer is None:
            why = plain(done.lines[0]) if done.lines else "it says nothing"
            raise NotDoneError(UNREACHED.at(None, f"'{self.remote.name}' does not tell the parameters: {why}"))
        return done.answer

    def _there(self, *words: str) -> list[str]:
        return self.remote.rbxcompose([*words, "--robot", self.robot.name])


def _configs(robot: Robot, told: Mapping[str, Mapping[str, object]]) -> Iterator[tuple[str, Config]]:
    """Yield the components that were told of, with the live values of each."""
    for node, name in nodes_of(robot).items():
        values = told.get(node.removeprefix("/"))
        if values is None:
            continue
        config = robot.components[name].config
        live = {one.name for one in settings(config).values() if one.is_live}
        messages = {key: to_message(_plain(value)) for key, value in values.items() if key in live}
        wanted = [Parameter(name=key, value=one) for key, one in messages.items() if one is not None]
        with suppress(UnsettableError):  # its file has changed meanwhile
            config = changed(config, wanted)
        yield name, config


def _json(value: object) -> object:
    return json.loads(json.dumps(value, default=str))


def _plain(value: object) -> object:
    """Return a value from JSON as parameters have it."""
    return tuple(value) if isinstance(value, list) else value
