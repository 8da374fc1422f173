"""What launch files start: their entities, evaluated in order within scopes, become programs with their values."""

from __future__ import annotations

import math
import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field, replace
from pathlib import Path, PurePath
from typing import NamedTuple

import yaml

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Related, Report, Span, kind
from rbxcompose.base.printable import FORBIDDEN, plain
from rbxcompose.base.units import MOST
from rbxcompose.commands.importing.foreign_files import ForeignFile, Given, read_files
from rbxcompose.commands.importing.importer import NOT_CARRIED_OVER
from rbxcompose.domains.programs.launch_files.entities import NOT_KNOWN, TEXT, LaunchEntity, attribute, entities_of
from rbxcompose.domains.programs.launch_files.substitutions import (
    LaunchText,
    SubstitutionCall,
    SubstitutionContext,
    UnknownValueError,
)
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.tree import DEPTH, INCLUDE_DEPTH
from rbxcompose.manifest.validate import KEYS, UNKNOWN_KEY
from rbxcompose.manifest.yaml_nodes import TOO_LARGE

NO_VALUE = kind("RBX2255")
NOT_INCLUDED = kind("RBX2256")

_Pair = dict[str, str]
Parameter = bool | int | float | str | list["Parameter"] | dict[str, "Parameter"]
_MOST_ENTITIES = 10_000  # that are evaluated: includes may double them again and again
_DEEPEST = 2 * DEPTH  # that they are nested, over all files
_MOST_PYTHON = 20  # runs of files in Python
_MANY = ("the transitions", "substitutions")
_OF_ALL = ("if", "unless")
_OF_PROGRAMS = (*_OF_ALL, "name", "output", "respawn", "respawn_delay", "respawn_max_retries", "cwd")
_OF_NODES = (*_OF_PROGRAMS, "pkg", "exec", "exec_name", "namespace", "args", "ros_args")
_PARTS_OF_NODES = ("param", "remap", "env", "argument")
_LEFT = (
    "launch-prefix",
    "emulate_tty",
    "sigterm_timeout",
    "sigkill_timeout",
    "forwarding",
    "on_exit",
    "log_cmd",
    "autostart",
)
_WHY = {
    "log": "it only prints",
    "RegisterEventHandler": "events start nothing here",
    "shutdown": "the supervisor decides when a robot goes down",
}
_INTEGERS = 1 << 63
_BODY = "in the place of 'robot_description', write 'body: {xacro: FILE}'"

_NODE_NAME = re.compile(r"([A-Za-z_]\w*)?", re.ASCII)
_NAMESPACE = re.compile(r"(/[A-Za-z_]\w*)*", re.ASCII)


@dataclass(slots=True)
class LaunchedProgram:
    """A program that a launch file starts, or a node of ROS 2 if it has a `package`.

    `name` and `namespace` are those of the node; empty if the file gives none.
    """

    wanted: str
    span: Span
    package: str = ""
    executable: str = ""
    name: str = ""
    namespace: str = ""
    remaps: dict[str, str] = field(default_factory=dict)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    files: list[str] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    folder: str = ""
    environment: dict[str, str] = field(default_factory=dict)
    restart: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LaunchArgument:
    """An argument that a file declares: the value that it has, its place, and what it is for."""

    value: str
    span: Span
    description: str = ""


@dataclass(slots=True)
class _Scope:
    """What a group may change for all that follows in it."""

    context: SubstitutionContext
    namespace: str = ""
    remaps: dict[str, str] = field(default_factory=dict)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    environment: dict[str, str] = field(default_factory=dict)

    def copy(self) -> _Scope:
        """Return one whose changes do not reach this one."""
        known = self.context
        context = replace(known, values=dict(known.values), environment=dict(known.environment))
        own = (dict(self.remaps), dict(self.parameters), dict(self.environment))
        return _Scope(context, self.namespace, *own)


class Evaluation:
    """The programs that launch files start, and the arguments that they declare; `sources` has what they include.

    Relative paths begin in `folder`; without it, in that of the first file.
    """

    def __init__(
        self, prefixes: tuple[Path, ...], environment: Mapping[str, str], report: Report, folder: Path | None = None
    ) -> None:
        self.programs: list[LaunchedProgram] = []
        self.arguments: dict[str, LaunchArgument] = {}
        self.outputs: list[Span] = []
        self.sources: dict[str, str] = {}
        self._prefixes, self._environment, self._report = prefixes, environment, report
        self._folder = folder
        self._unset: set[str] = set()
        self._left, self._python, self._depth = _MOST_ENTITIES, _MOST_PYTHON, 0
        self._open: list[Path] = []

    def run(self, file: ForeignFile) -> None:
        """Add what a file starts."""
        path = file.path or Path(file.name).absolute()
        self._folder = self._folder or path.resolve().parent
        context = SubstitutionContext(path, self._prefixes, dict(file.arguments), dict(self._environment))
        self._file(file, path, _Scope(context))

    def _file(self, file: ForeignFile, path: Path, scope: _Scope) -> None:
        if file.name.endswith(".py"):
            self._python -= 1
        if self._python < 0:
            self._report.add(TOO_LARGE.at(None, f"more than {_MOST_PYTHON} launch files in Python are included"))
            return
        self._open.append(path.resolve())
        scope.context.file = path
        self._all(entities_of(file, scope.context, self._report), scope)
        self._open.pop()

    def _all(self, entities: tuple[LaunchEntity, ...], scope: _Scope) -> None:
        self._depth += 1
        for entity in entities:
            self._left -= 1 if self._depth < _DEEPEST else self._left + 1
            if self._left == -1:
                words = f"more than {_MOST_ENTITIES:,} actions are included, or they are nested too deep"
                self._report.add(TOO_LARGE.at(entity.span, words))
            if self._left < 0:
                break
            if not self._holds(entity, scope):
                continue
            if entity.kind in _ACTIONS:
                self._check(entity)
                _ACTIONS[entity.kind].act(self, entity, scope)
            else:
                words = f"'{plain(entity.kind, 60)}'{self._shown(entity, scope)}"
                self._leave(entity.span, words, _WHY.get(entity.kind, "it is not known here"))
        self._depth -= 1

    def _leave(self, span: Span, what: str, why: str, help_text: str = "") -> None:
        verb = "are" if what.startswith(_MANY) else "is"
        self._report.add(NOT_CARRIED_OVER.at(span, f"{what} {verb} not carried over: {why}", help=help_text))

    def _shown(self, entity: LaunchEntity, scope: _Scope) -> str:
        """Return in brackets what an action is about, where it says so."""
        name = next((name for name in ("target", "name", "message") if name in entity.attributes), "")
        return f" ({plain(text, 200)})" if (text := self._text(entity, name, scope)) else ""

    @contextmanager
    def _reporting(self, what: str, given: Given[LaunchText] | None) -> Iterator[None]:
        """Report what is not known; an argument without a value was reported where it is declared."""
        try:
            yield
        except UnknownValueError as error:
            if given is not None and not any(name in self._unset for name in _variables(given.value)):
                help_text = _BODY if "(robot_description)" in what else ""
                self._report.add(NOT_KNOWN.at(given.span, f"{what} is not known: {error}", help=help_text))

    def _holds(self, entity: LaunchEntity, scope: _Scope) -> bool:
        return self._flag(entity, "if", scope) is not False and self._flag(entity, "unless", scope) is not True

    def _flag(self, entity: LaunchEntity, name: str, scope: _Scope) -> bool | None:
        """Return whether an attribute is true; None without it. A condition that is not known keeps an action out."""
        given = entity.attributes.get(name)
        if given is None:
            return None
        found = [{"if": False, "unless": True}.get(name)]
        with self._reporting(f"'{name}' of '{entity.kind}'", given):
            found.append(scope.context.holds(given.value))
        return found[-1]

    def _check(self, entity: LaunchEntity) -> None:
        """Report the attributes and parts of an entity that nobody knows."""
        known, shown = _KNOWN[entity.kind], f"'{entity.kind}'"
        for name, given in entity.attributes.items():
            if name in _LEFT:
                self._leave(given.span, f"'{name}' of {shown}", "nothing here has the same effect")
            elif name == TEXT:
                self._leave(given.span, f"the text in {shown}", "only elements count")
            elif name not in known.attributes:
                words = f"unknown attribute '{plain(name, 60)}' of {shown}"
                self._report.add(UNKNOWN_KEY.misspelt(given.span, words, name, known.attributes, KEYS))
        for child in entity.children if entity.kind not in ("group", "timer") else ():
            if child.kind not in known.parts:
                self._leave(child.span, f"'{plain(child.kind, 60)}' in {shown}", "it is not known here")
            elif child.kind in _KNOWN and child.kind != "arg":
                self._check(child)

    def _text(self, entity: LaunchEntity, name: str, scope: _Scope) -> str | None:
        """Return an attribute with all of it filled in; None if it is not given, or after a finding."""
        given = entity.attributes.get(name)
        if given is None:
            return None
        found, words = None, f"'{name}' of '{entity.kind}'"
        if name in ("value", "default") and (of := entity.attributes.get("name")) is not None:
            words += f" ({plain(''.join(one for one in of.value if isinstance(one, str)), 60)})"
        with self._reporting(words, given):
            found = scope.context.perform(given.value)
        for note in scope.context.notes:
            self._report.add(NOT_CARRIED_OVER.at(given.span, note))
        scope.context.notes.clear()
        if found is not None and FORBIDDEN.search(found):
            self._report.add(NOT_KNOWN.at(given.span, f"{words} has characters that no manifest may have"))
            return None
        return found

    def _needed(self, entity: LaunchEntity, name: str, scope: _Scope) -> str | None:
        return None if attribute(entity, name, self._report) is None else self._text(entity, name, scope)

    def _pair(self, entity: LaunchEntity, scope: _Scope, first: str = "name", second: str = "value") -> _Pair:
        """Return two attributes that belong together, as a map of one entry; empty if one is missing."""
        left, right = self._needed(entity, first, scope), self._needed(entity, second, scope)
        return {} if left is None or right is None else {left: right}

    def _argument(self, entity: LaunchEntity, scope: _Scope) -> None:
        name = self._needed(entity, "name", scope)
        if name is None:
            return
        values = scope.context.values
        if name not in values and (default := self._text(entity, "default", scope)) is not None:
            values[name] = default
        if name not in values:
            if "default" not in entity.attributes:
                words = f"the argument '{plain(name, 60)}' has no value: what uses it is left out"
                self._report.add(NO_VALUE.at(entity.span, words, help=f"write '{plain(name, 60)}:=VALUE' behind FILE"))
            self._unset.add(name)
            return
        self._unset.discard(name)
        choices = [self._text(each, "value", scope) for each in entity.all("choice")]
        if choices and values[name] not in choices:
            words = f"'{plain(values[name], 60)}' is no choice for the argument '{plain(name, 60)}'"
            names = [each for each in choices if each is not None]
            self._report.add(NO_VALUE.misspelt(entity.span, words, values[name], names, "its choices"))
        description = self._text(entity, "description", scope) or ""
        self.arguments.setdefault(name, LaunchArgument(values[name], entity.span, description))

    def _let(self, entity: LaunchEntity, scope: _Scope) -> None:
        found = self._pair(entity, scope)
        scope.context.values |= found
        self._unset -= found.keys()
        if not found and (name := self._text(entity, "name", scope)) is not None:
            self._unset.add(name)

    def _group(self, entity: LaunchEntity, scope: _Scope) -> None:
        self._all(entity.children, scope if self._flag(entity, "scoped", scope) is False else scope.copy())

    def _timer(self, entity: LaunchEntity, scope: _Scope) -> None:
        help_text = "say what it waits for: 'starts_after: [NAME]'"
        self._leave(entity.span, "'timer'", "what it delays starts with the others", help_text)
        self._all(entity.children, scope)

    def _push(self, entity: LaunchEntity, scope: _Scope) -> None:
        scope.namespace = _namespace(scope.namespace, self._needed(entity, "namespace", scope) or "")

    def _set_env(self, entity: LaunchEntity, scope: _Scope) -> None:
        found = self._pair(entity, scope)
        scope.environment |= found
        scope.context.environment |= found

    def _unset_env(self, entity: LaunchEntity, scope: _Scope) -> None:
        name = self._needed(entity, "name", scope) or ""
        scope.environment.pop(name, None)
        scope.context.environment.pop(name, None)

    def _set_parameter(self, entity: LaunchEntity, scope: _Scope) -> None:
        name, value = self._needed(entity, "name", scope), self._value(entity, scope)
        if name is not None and value is not None:
            scope.parameters[name] = value

    def _set_remap(self, entity: LaunchEntity, scope: _Scope) -> None:
        scope.remaps = self._pair(entity, scope, "from", "to") | scope.remaps

    def _include(self, entity: LaunchEntity, scope: _Scope) -> None:
        written = self._needed(entity, "file", scope)
        if written is None:
            return
        for argument in entity.all("arg", "let"):
            self._let(argument, scope)
        here, path = scope.context.file, scope.context.file.parent / written
        problem = ""
        if not path.is_file():
            problem = f"there is no file '{plain(shown_name(path))}'"
        elif path.resolve() in self._open:
            problem = f"'{plain(shown_name(path))}' includes itself"
        elif len(self._open) > INCLUDE_DEPTH:
            problem = f"files include each other more than {INCLUDE_DEPTH} levels deep"
        if problem:
            self._report.add(NOT_INCLUDED.at(entity.attributes["file"].span, problem))
            return
        for file in read_files([path], self._report, self.sources):
            self._file(file, path, scope)
        scope.context.file = here

    def _executable(self, entity: LaunchEntity, scope: _Scope) -> None:
        words = self._words(entity, "cmd", scope)
        if not words:
            if "cmd" not in entity.attributes and not list(entity.all("argument")):
                attribute(entity, "cmd", self._report)
            return
        words += self._words(replace(entity, children=()), "args", scope) or []
        if self._flag(entity, "shell", scope):
            joined = self._text(entity, "cmd", scope)
            words = ["sh", "-c", " ".join(words) if joined is None else joined]
        wanted = self._text(entity, "name", scope) or PurePath(words[0]).stem
        program = LaunchedProgram(wanted, entity.span, words=words)
        program.folder = self._path(entity, "cwd", scope) or ""
        self._common(program, entity, scope)

    def _node(self, entity: LaunchEntity, scope: _Scope) -> None:
        package, executable = self._needed(entity, "pkg", scope), self._needed(entity, "exec", scope)
        words = self._words(entity, "args", scope)
        if package is None or executable is None or words is None:
            return
        name = self._text(entity, "name", scope) or ""
        wanted = name or self._text(entity, "exec_name", scope) or PurePath(executable).stem
        name = name if _NODE_NAME.fullmatch(name) else self._no_name(name, entity)
        program = LaunchedProgram(wanted, entity.span, package, executable, name, words=words)
        if ros := self._words(replace(entity, children=()), "ros_args", scope):
            program.words += ["--ros-args", *ros, "--"]
        given = self._text(entity, "namespace", scope) or ""
        namespace = _namespace(scope.namespace, given)
        program.namespace = namespace if _NAMESPACE.fullmatch(namespace) else self._no_name(namespace, entity)
        if "cwd" in entity.attributes:
            self._leave(entity.attributes["cwd"].span, "'cwd' of 'node'", "a node runs in the folder of the robot")
        program.remaps = dict(scope.remaps)
        for remap in entity.all("remap"):  # the first one of a name counts
            program.remaps = {**self._pair(remap, scope, "from", "to"), **program.remaps}
        self._parameters(program, entity, scope)
        self._common(program, entity, scope)
        self._report_rest_of(program, entity, scope)

    def _no_name(self, name: str, entity: LaunchEntity) -> str:
        """Return nothing in place of a name, after the finding that no node can have it."""
        self._leave(entity.span, f"the name '{plain(name, 60)}'", "names in ROS 2 have letters, digits and '_' only")
        return ""

    def _report_rest_of(self, program: LaunchedProgram, entity: LaunchEntity, scope: _Scope) -> None:
        """Report what a node needs beside its process."""
        shown = f"'{plain(program.wanted, 60)}'"
        if entity.kind == "lifecycle_node":
            help_text = "send them by 'ros2 lifecycle set', or by a lifecycle manager"
            self._leave(entity.span, f"the transitions of {shown}", "nobody configures and activates it", help_text)
        self._report_plugins(entity, f"{program.namespace}/{program.name or program.wanted}", scope)

    def _load(self, entity: LaunchEntity, scope: _Scope) -> None:
        self._report_plugins(entity, self._needed(entity, "target", scope) or "CONTAINER", scope)

    def _report_plugins(self, entity: LaunchEntity, target: str, scope: _Scope) -> None:
        for child in entity.all("composable_node"):
            plugin, package = self._text(child, "plugin", scope), self._text(child, "pkg", scope)
            load = " ".join(plain(each, 60) for each in (target, package or "PACKAGE", plugin or "PLUGIN"))
            help_text = f"load it by 'ros2 component load {load}', or run its own executable as another 'ros2_node'"
            words = f"the plug-in '{plain(plugin or '?', 60)}'"
            self._leave(child.span, words, f"nobody loads it into '{plain(target, 60)}'", help_text)

    def _common(self, program: LaunchedProgram, entity: LaunchEntity, scope: _Scope) -> None:
        """Add what all programs may have, and the program."""
        program.environment = dict(scope.environment)
        for variable in entity.all("env"):
            program.environment |= self._pair(variable, scope)
        if "output" in entity.attributes:
            self.outputs.append(entity.attributes["output"].span)
        if (respawn := self._flag(entity, "respawn", scope)) is not None:
            program.restart = {"when": "always" if respawn else "never"}
        self._pauses(program, entity, scope)
        self.programs.append(program)

    def _pauses(self, program: LaunchedProgram, entity: LaunchEntity, scope: _Scope) -> None:
        delay = self._text(entity, "respawn_delay", scope)
        if delay is not None:
            try:
                seconds = float(delay)
            except ValueError:
                seconds = -1.0
            if not 0 <= seconds < MOST:
                words = f"'respawn_delay' must be a number of seconds, not '{plain(delay, 60)}'"
                self._report.add(NOT_KNOWN.at(entity.attributes["respawn_delay"].span, words))
            elif program.restart.get("when") == "always":
                program.restart["backoff"] = f"{seconds:g} s"
        if (retries := self._text(entity, "respawn_max_retries", scope)) not in (None, "-1"):
            span = entity.attributes["respawn_max_retries"].span
            help_text = "write 'when: on_failure' with 'max'"
            self._leave(span, f"'respawn_max_retries' {plain(str(retries), 60)}", "it starts again for ever", help_text)

    def _words(self, entity: LaunchEntity, name: str, scope: _Scope) -> list[str] | None:
        """Return the words of a command line, from a text or listed; None after a finding."""
        words: list[str] = []
        if (given := entity.attributes.get(name)) is not None:
            text = self._text(entity, name, scope)
            try:
                words = shlex.split(text or "")
            except ValueError as error:
                self._report.add(NOT_KNOWN.at(given.span, f"the words of '{name}' are not known: {error}"))
                return None
            if text is None:
                return None
        for word in entity.all("argument"):
            if (found := self._text(word, "value", scope)) is None:
                return None
            words.append(found)
        return words

    def _path(self, entity: LaunchEntity, name: str, scope: _Scope) -> str | None:
        """Return a path as the manifest has it: relative if it lies below the folder of the given file."""
        text = self._text(entity, name, scope)
        if text is None:
            return None
        path = scope.context.file.parent.resolve() / text
        return os.path.relpath(path, self._folder) if path.is_relative_to(self._open[0].parent) else str(path)

    def _parameters(self, program: LaunchedProgram, entity: LaunchEntity, scope: _Scope) -> None:
        program.parameters = dict(scope.parameters)
        first: Span | None = None
        for param in entity.all("param"):
            if "from" not in param.attributes:
                first = first or param.span
                self._parameter(program.parameters, param, scope)
                continue
            span = param.attributes["from"].span
            path = self._path(param, "from", scope)
            if path is None:
                continue
            if not Path(os.path.normpath(os.path.join(self._folder or "", path))).is_file():
                self._report.add(NOT_KNOWN.at(span, f"there is no file of parameters '{plain(path)}'"))
                continue
            program.files.append(path)
            if first is not None:
                words = "the order of these parameters is not carried over: this file counts less than single values"
                related = [Related(first, "a single value before it")]
                self._report.add(NOT_CARRIED_OVER.at(span, words, related=related))
            if "allow_substs" in param.attributes:
                self._leave(span, "substitutions in this file", "it is read as it is")

    def _parameter(self, known: dict[str, Parameter], param: LaunchEntity, scope: _Scope, depth: int = 0) -> None:
        name = self._needed(param, "name", scope)
        if name is None or depth > DEPTH:
            return
        below = list(param.all("param"))
        if not below:
            if (value := self._value(param, scope)) is not None:
                known[name] = value
            return
        inner: dict[str, Parameter] = {}
        for child in below:
            self._parameter(inner, child, scope, depth + 1)
        known[name] = inner

    def _value(self, param: LaunchEntity, scope: _Scope) -> Parameter | None:
        """Return the value of a parameter; None after a finding."""
        items = list(param.all("item"))
        if items:
            found = [self._value(item, scope) for item in items]
            return None if None in found else [each for each in found if each is not None]
        text, type_ = self._needed(param, "value", scope), self._text(param, "type", scope) or "auto"
        if text is None:
            return None
        between = self._text(param, "value-sep", scope)
        texts = text.split(between) if between else [text]
        try:
            values = [_typed(each, type_) for each in texts]
        except (ValueError, TypeError, KeyError, RecursionError):
            words = f"'{plain(text, 60)}' is no value of a parameter of type '{plain(type_, 60)}'"
            self._report.add(NOT_KNOWN.at(param.attributes["value"].span, words))
            return None
        return values if between else values[0]


class _Kind(NamedTuple):
    """A kind of entities: its attributes, the children that are parts of it, and what carries out an action."""

    attributes: tuple[str, ...]
    parts: tuple[str, ...] = ()
    act: Callable[[Evaluation, LaunchEntity, _Scope], None] = lambda *_: None


_ACTIONS = {
    "arg": _Kind((*_OF_ALL, "name", "default", "description"), ("choice",), Evaluation._argument),
    "let": _Kind((*_OF_ALL, "name", "value"), (), Evaluation._let),
    "node": _Kind(_OF_NODES, _PARTS_OF_NODES, Evaluation._node),
    "lifecycle_node": _Kind(_OF_NODES, _PARTS_OF_NODES, Evaluation._node),
    "node_container": _Kind(_OF_NODES, (*_PARTS_OF_NODES, "composable_node"), Evaluation._node),
    "executable": _Kind((*_OF_PROGRAMS, "cmd", "args", "shell"), ("env", "argument"), Evaluation._executable),
    "include": _Kind((*_OF_ALL, "file"), ("arg", "let"), Evaluation._include),
    "group": _Kind((*_OF_ALL, "scoped"), (), Evaluation._group),
    "timer": _Kind((*_OF_ALL, "period"), (), Evaluation._timer),
    "push_ros_namespace": _Kind((*_OF_ALL, "namespace"), (), Evaluation._push),
    "set_env": _Kind((*_OF_ALL, "name", "value"), (), Evaluation._set_env),
    "unset_env": _Kind((*_OF_ALL, "name"), (), Evaluation._unset_env),
    "set_parameter": _Kind((*_OF_ALL, "name", "value", "type"), (), Evaluation._set_parameter),
    "set_remap": _Kind((*_OF_ALL, "from", "to"), (), Evaluation._set_remap),
    "load_composable_node": _Kind((*_OF_ALL, "target"), ("composable_node",), Evaluation._load),
}
_KNOWN = {
    **_ACTIONS,
    "param": _Kind(("name", "value", "value-sep", "from", "type", "allow_substs"), ("param", "item")),
    "remap": _Kind(("from", "to")),
    "env": _Kind(("name", "value")),
}
"""Actions, and those of their parts that have attributes."""


def _variables(text: LaunchText) -> Iterator[str]:
    """Yield the names of the arguments that a text asks for."""
    for piece in text:
        if isinstance(piece, SubstitutionCall):
            if piece.name == "var" and piece.arguments:
                yield "".join(each for each in piece.arguments[0] if isinstance(each, str))
            for argument in piece.arguments:
                yield from _variables(argument)


def _namespace(above: str, below: str) -> str:
    """Return a namespace below another one, unless it is absolute; always with a slash in front."""
    if below.startswith("/"):
        return below.rstrip("/")
    return f"{above}/{below.rstrip('/')}" if below else above


def _typed(text: str, type_: str) -> Parameter:
    """Return the value that ROS takes a text for: as YAML 1.1 does, or as its type says.

    Raises:
        ValueError: if it is none that a parameter may have.
    """
    if type_ in ("str", "string"):
        return text
    if "&" in text and text.lstrip()[:1] in ("[", "{"):
        raise ValueError("no anchors")  # a few of them could stand for any number of values
    value: object = None
    if type_ in ("auto", "yaml") or type_.startswith("list"):
        try:
            value = yaml.safe_load(text)
        except yaml.YAMLError:
            value = text
    match type_:
        case "bool":
            value = _FLAGS[text.strip().lower()]
        case "int":
            value = int(text)
        case "float" | "double":
            value = float(text)
    return [_single(each, str(each)) for each in value] if isinstance(value, list) else _single(value, text)


_FLAGS = {"true": True, "false": False}


def _single(value: object, text: str) -> Parameter:
    match value:
        case bool() | str():
            return value
        case int() if -_INTEGERS <= value < _INTEGERS:
            return value
        case float() if math.isfinite(value) and abs(value) < MOST:
            return value
        case int() | float() | list():
            raise ValueError("no value")
    return text  # of other types, such as dates and maps, ROS makes texts
