"""Filling in `${...}` after composition: arguments, secrets, the robot's name, the environment, expressions."""

import errno
import os
import re
import stat
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import field, replace
from itertools import islice
from operator import is_
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, TypeVar

from rbxcompose.base.config import Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import types
from rbxcompose.base.expressions.check import StaticScope, check
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.parser import parse_fill
from rbxcompose.base.expressions.tree import Expression, ExpressionError
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.expressions.values import EvaluationError, Scope
from rbxcompose.base.files import NotRegularError, open_regular
from rbxcompose.base.findings import DID_YOU_MEAN, Report, Span, correction, kind, nearest, once, replacement, suggest
from rbxcompose.base.printable import plain
from rbxcompose.base.units import NUMBER, QUOTIENT, Quantity
from rbxcompose.manifest import tree
from rbxcompose.manifest.arguments import given_span, show
from rbxcompose.manifest.foreign_words import PATTERN, Cure, cure_of, cure_of_variable
from rbxcompose.manifest.tree import (
    ALL_BYTES,
    BROKEN,
    Entry,
    ScalarNode,
    SequenceNode,
    TreeNode,
    describe,
    part_span,
    size,
)
from rbxcompose.manifest.validate import to_plain
from rbxcompose.manifest.yaml_nodes import TOO_LARGE

SECRETS_FOLDER = "secrets"
VARIABLE = "RBX_SECRET_"  # how the environment variables begin that hold secrets
_MOST_NAMES = 1000  # of secrets


class NoSecretError(Exception):
    """Raised when a secret is not available; `help` says what to do, `near` is a secret with a similar name."""

    def __init__(self, message: str, help: str, near: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.help = help
        self.near = near


@dataclass(frozen=True, slots=True)
class Secrets:
    """The sources of secrets: the environment (`RBX_SECRET_NAME`), else the files `secrets/NAME` of a project."""

    project: Path
    environment: Mapping[str, str]

    def get(self, name: str) -> Secret:
        """Return a secret.

        Raises:
            NoSecretError: if it does not exist, or others could read it.
        """
        value = self.environment.get(f"{VARIABLE}{name.upper()}")
        return Secret(value if value is not None else self._read(name), name)

    def _read(self, name: str) -> str:
        shown = f"{SECRETS_FOLDER}/{name}"
        try:
            with open_regular(self.project / SECRETS_FOLDER / name, follow=False) as file:  # a link could lead anywhere
                status = os.fstat(file.fileno())
                if stat.S_IMODE(status.st_mode) & 0o077 or status.st_uid != os.getuid():
                    raise NoSecretError(f"others may read the secret in '{shown}'", f"chmod 600 {shown}")
                data = file.read(tree.SECRET + 1)
        except NotRegularError:
            message = f"'{shown}' is not a regular file"
            raise NoSecretError(message, f"put the secret into the file '{shown}'") from None
        except OSError as error:
            is_missing = error.errno in (errno.ENOENT, errno.ENOTDIR)
            reason = "does not exist" if is_missing else f"cannot be read: {os.strerror(error.errno or 0)}"
            message = f"the secret '{name}' is not available: the file '{shown}' {reason}"
            near = next(iter(nearest(name, self._names())), "") if is_missing else ""
            there = f"put it into '{shown}' with mode 0600, or into the variable {VARIABLE}{name.upper()}; a value "
            there += "that is no secret is written here, or filled in by '${args.NAME}'"
            raise NoSecretError(message, f"{DID_YOU_MEAN} '{near}'?" if near else there, near) from None
        if len(data) > tree.SECRET:
            raise NoSecretError(f"'{shown}' is larger than {tree.SECRET:,} bytes", "a secret is one short text")
        return _text(data, shown)

    def _names(self) -> list[str]:
        """Return the names of the secrets that there are."""
        given = [name.removeprefix(VARIABLE).lower() for name in self.environment if name.startswith(VARIABLE)]
        try:
            with os.scandir(self.project / SECRETS_FOLDER) as entries:
                return sorted([*given, *(entry.name for entry in islice(entries, _MOST_NAMES))])
        except OSError:
            return given


def _text(data: bytes, shown: str) -> str:
    try:
        return data.decode("utf-8").removesuffix("\n").removesuffix("\r")
    except UnicodeDecodeError:
        raise NoSecretError(f"'{shown}' is not UTF-8 text", "write it as text, such as base64") from None


T = TypeVar("T")


class OpenNames(Mapping[str, T]):
    """Things by name; one that may have been among those that could not be read is there, too, with a stand-in."""

    def __init__(self, known: Mapping[str, T], may_have: Callable[[str], bool], stand_in: Callable[[str], T]) -> None:
        self._known, self._may_have, self._stand_in = known, may_have, stand_in

    def __getitem__(self, name: str) -> T:
        if name in self._known:
            return self._known[name]
        if not self._may_have(name):
            raise KeyError(name)
        return self._stand_in(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


_ARGS = "args."


class Typed(NamedTuple):
    """A type and a value of it; `given` is the place where it was given, None for a default."""

    type: Type
    value: object
    given: Span | None = None


@dataclass(frozen=True, slots=True)
class Names:
    """The names that `${...}` may use: a type and a typed value by dotted name, the environment and the secrets.

    `arguments` holds those of each scope: of the robot (the empty scope), and of each instance of a part; `may_have`
    tells of some scopes which arguments may be among those that could not be read.
    """

    values: Mapping[str, Typed] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    secrets: Secrets | None = None
    arguments: Mapping[str, Mapping[str, Typed]] = field(default_factory=dict)
    may_have: Mapping[str, Callable[[str], bool]] = field(default_factory=dict)

    def known(self, scope: str) -> Mapping[str, Typed]:
        """Return all that a file of this scope may name in an expression."""
        known = {**self.values, **self.arguments.get(scope, {})}
        may_have = self.may_have.get(scope)
        return known if may_have is None else OpenNames(known, may_have, lambda name: Typed(types.UNKNOWN, tree.BROKEN))


def names_of(robot: str, sim: bool, environment: Mapping[str, str], secrets: Secrets | None = None) -> Names:
    """Return the names that every file of a robot knows."""
    return Names({"robot.name": Typed(types.TEXT, robot), "sim": Typed(types.FLAG, sim)}, environment, secrets)


def with_arguments(
    names: Names, arguments: Mapping[str, Typed], scope: str = "", may_have: Callable[[str], bool] | None = None
) -> Names:
    """Return `names` with `args.NAME` for each argument of a scope; a broken argument has the value `BROKEN`.

    `may_have` tells which arguments may be among those that could not be read, if there are any.
    """
    known = {f"{_ARGS}{name}": value for name, value in arguments.items()}
    names = replace(names, arguments={**names.arguments, scope: known})
    if may_have is None:
        return names

    def may_have_argument(name: str) -> bool:
        return name.startswith(_ARGS) and may_have(name.removeprefix(_ARGS))

    return replace(names, may_have={**names.may_have, scope: may_have_argument})


@dataclass(frozen=True, slots=True)
class NameTypes(StaticScope):
    """The names as the static check of an expression sees them; nothing is known as `$name` yet."""

    names: Mapping[str, Typed]

    def word(self, name: str) -> Type | None:
        """Return the type of a name."""
        return self.names[name].type if name in self.names else None

    def words(self) -> Iterable[str]:
        """Return all names."""
        return self.names


@dataclass(frozen=True, slots=True)
class NameValues(Scope):
    """The names as the evaluation of an expression sees them: numbers in SI, lists and maps as plain data."""

    names: Mapping[str, Typed]

    def word(self, name: str) -> object:
        """Return the value of a name."""
        value = self.names[name].value
        if isinstance(value, Quantity):
            return value.value
        return to_plain(value) if isinstance(value, ScalarNode | SequenceNode | tree.MappingNode) else value


SYNTAX = kind("RBX1201", is_fixable=True)
UNKNOWN_NAME = kind("RBX1202", is_fixable=True)
WRONG_OPERATION = kind("RBX1203")
ENVIRONMENT = kind("RBX1204")
NOT_RUNNING = kind("RBX1205", is_fixable=True)

SECRET = kind("RBX1207")
SHOWN_SECRET = kind("RBX1208")

_PIECE = re.compile(
    r"\$\$|\$\{(?P<body>[^}]*)(?P<end>\}?)|\$(?P<name>[A-Za-z][A-Za-z0-9_.]*)"
    rf"|{PATTERN}"
)
_ARGUMENT = re.compile(r"\bargs\.\w+")
_SECRET = re.compile(r"\s*secret\.(?P<name>[a-z][a-z0-9_]{0,59})\s*")
_ENVIRONMENT = re.compile(r"\s*env\.(?P<name>[A-Za-z_][A-Za-z0-9_]*)(:(?P<mode>[-?])(?P<rest>.*))?\s*", re.DOTALL)


_parsed = once(parse_fill)  # many settings name the same argument


def fill(
    root: tree.MappingNode,
    names: Names,
    report: Report,
    *,
    runs: bool = False,
    running: Mapping[str, Collection[str]] = MappingProxyType({}),
) -> tree.MappingNode:
    """Return the tree with every `${...}` filled in; `runs` means that `$name` has a meaning in it (missions).

    `running` are the keys in entries of sections in which it has a meaning as well.

    A scalar that is nothing but `${...}` holds the typed value in `filled`, or becomes the list or map that it names;
    one that could not be filled in holds `BROKEN`.
    """
    filler = _Filler(names, report, runs)
    filler.running = {id(node) for section, keys in running.items() for node in _values_at(root.get(section), keys)}
    return filler.mapping(root)


def _values_at(section: TreeNode | None, keys: Collection[str]) -> Iterator[TreeNode]:
    entries = tree.entries_of(section).values()
    inner = (entry.value for entry in entries if isinstance(entry.value, tree.MappingNode))
    yield from (node.entries[key].value for node in inner for key in keys if key in node)


class _Filler:
    """One pass over a tree; a node without `$` stays the same object."""

    def __init__(self, names: Names, report: Report, runs: bool) -> None:
        self.names = names
        self.report = report
        self.runs = runs
        self.running: set[int] = set()  # identities of scalars in which `$name` has a meaning
        self.scope = ""
        self.known = names.known("")
        self.left = ALL_BYTES  # how much the tree may still grow

    def node(self, node: TreeNode) -> TreeNode:
        match node:
            case ScalarNode():
                return self.scalar(node) if "$" in node.text else node
            case SequenceNode(items=items):
                filled = tuple(map(self.node, items))
                return node if all(map(is_, filled, items)) else replace(node, items=filled)
        return self.mapping(node)

    def mapping(self, mapping: tree.MappingNode) -> tree.MappingNode:
        changed = {}
        for name, entry in mapping.entries.items():
            if (value := self.node(entry.value)) is not entry.value:
                changed[name] = Entry(entry.key, value)
        return replace(mapping, entries={**mapping.entries, **changed}) if changed else mapping

    def scalar(self, scalar: ScalarNode) -> TreeNode:
        if scalar.scope != self.scope:
            self.scope, self.known = scalar.scope, self.names.known(scalar.scope)
        pieces = list(_PIECE.finditer(scalar.text))
        values = {piece: value for piece in pieces if (value := self.piece(scalar, piece)) is not None}
        is_whole = len(pieces) == 1 and pieces[0].group() == scalar.text and pieces[0]["body"] is not None
        if any(value is BROKEN for value in values.values()):
            return replace(scalar, filled=BROKEN)
        if is_whole and values:
            return self.within(scalar, self.where_given(_typed(scalar, values[pieces[0]]), pieces[0]))
        for piece, value in values.items():
            if isinstance(value, Secret):
                broken = self.shown_secret(scalar, piece, "a secret cannot be part of a text")
                return replace(scalar, filled=broken)
        for piece, value in values.items():
            if isinstance(value, SequenceNode | tree.MappingNode):
                span = part_span(scalar, piece.start(), piece.end())
                message = f"{describe(to_plain(value)).removeprefix('this is ')} cannot be part of a text"
                self.report.add(WRONG_OPERATION.at(span, message))
                return replace(scalar, filled=BROKEN)
        if not values:
            return scalar
        parts, position = [], 0
        for piece, value in values.items():
            parts += [scalar.text[position : piece.start()], _as_text(value)]
            position = piece.end()
        parts.append(scalar.text[position:])
        if (room := self.room(scalar, sum(map(len, parts)) - len(scalar.text))) is not None:
            return room
        return replace(scalar, text="".join(parts))

    def where_given(self, filled: TreeNode, piece: re.Match[str]) -> TreeNode:
        """Return what was filled in for one `${...}`, with the place of its value if one given argument decides it."""
        names = {*_ARGUMENT.findall(piece["body"] or "")}
        given = [self.known[name].given for name in names if name in self.known]
        if len(given) != 1 or given[0] is None or not isinstance(filled, ScalarNode):
            return filled  # lists and maps keep the places where they were written
        return replace(filled, span=given_span(given[0], filled.span))

    def within(self, scalar: ScalarNode, filled: TreeNode) -> TreeNode:
        """Return what was filled in, or `BROKEN` after a finding if everything filled in is too large together."""
        return self.room(scalar, size(filled) - size(scalar)) or filled

    def room(self, scalar: ScalarNode, growth: int) -> TreeNode | None:
        """Return None if the tree may grow by so many bytes where this scalar is, else what is left of it."""
        if self.left >= 0:
            self.left -= growth
            if self.left >= 0:
                return None
            message = f"what is filled in from here on makes this robot larger than {ALL_BYTES:,} bytes"
            self.report.add(TOO_LARGE.at(scalar.span, message))
        return replace(scalar, filled=BROKEN)

    def piece(self, scalar: ScalarNode, piece: re.Match[str]) -> object:
        """Return the value of one `${...}`, None if it stays as it is, `BROKEN` after a finding."""
        if piece["verb"]:
            message = f"'{plain(piece.group(), 60)}' is a substitution of ROS launch files"
            cure = cure_of(piece["verb"], piece["of"], self.known, runs=self.runs)
            return self.foreign(scalar, piece, message, cure)
        body, name = piece["body"], piece["name"]
        runs = self.runs or id(scalar) in self.running
        if body is None and name:
            return None if runs else self.running_name(scalar, piece)
        if body is None:
            return None if runs else "$"
        span = part_span(scalar, piece.start(), piece.end())
        if not piece["end"]:
            self.report.add(SYNTAX.at(span, "this '${' is never closed", help="write '}' at its end"))
            return BROKEN
        if variable := _ENVIRONMENT.fullmatch(body):
            return self.variable(scalar, piece, variable)
        if secret := _SECRET.fullmatch(body):
            return self.secret(scalar, piece, secret["name"])
        try:
            expression = _parsed(body)
        except ExpressionError as error:
            if other := cure_of_variable(body):
                return self.foreign(scalar, piece, "this is the syntax of a shell", other)
            span = part_span(scalar, piece.start("body") + error.start, piece.start("body") + error.end)
            self.report.add(SYNTAX.at(span, error.message, help=error.help))
            return BROKEN
        return self.expression(scalar, piece.start("body"), expression)

    def foreign(self, scalar: ScalarNode, piece: re.Match[str], message: str, cure: Cure) -> object:
        """Report what has the syntax of another tool."""
        span = part_span(scalar, piece.start(), piece.end())
        fix = replacement(span, piece.group(), cure.meant) if cure.meant else None
        self.report.add(SYNTAX.at(span, message, help=cure.help, fix=fix))
        return BROKEN

    def running_name(self, scalar: ScalarNode, piece: re.Match[str]) -> object:
        name = piece["name"].rstrip(".")
        known = [key for key in (name, f"args.{name}") if key in self.known]
        help_text = f"write '${{{known[0]}}}'" if known else "use braces to fill in a value; write '$$' for a dollar"
        message = f"'${plain(name, 60)}' is looked up while the robot runs, but this is filled in earlier"
        span = part_span(scalar, piece.start(), piece.start() + 1 + len(name))
        fix = replacement(span, f"${name}", f"${{{known[0]}}}") if known else None
        self.report.add(NOT_RUNNING.at(span, message, help=help_text, fix=fix))
        return BROKEN

    def variable(self, scalar: ScalarNode, piece: re.Match[str], variable: re.Match[str]) -> object:
        name, mode, rest = variable["name"], variable["mode"], variable["rest"]
        if name.startswith(VARIABLE):
            own = f"${{secret.{plain(name.removeprefix(VARIABLE).lower(), 60)}}}"
            return self.shown_secret(scalar, piece, f"this variable holds a secret, which is named '{own}'")
        value = self.names.environment.get(name)
        if value or (value is not None and not mode):
            return _FromEnvironment(value)
        if mode == "-":
            return _FromEnvironment(rest)
        why = plain(rest) if mode and rest else ""
        span = part_span(scalar, piece.start(), piece.end())
        message = f"the environment variable '{name}' is not set"
        self.report.add(ENVIRONMENT.at(span, message, label=why, help=f"set it, or write '${{env.{name}:-DEFAULT}}'"))
        return BROKEN

    def secret(self, scalar: ScalarNode, piece: re.Match[str], name: str) -> object:
        if piece.group() != scalar.text:
            return self.shown_secret(scalar, piece, "a secret cannot be part of a text")
        if self.names.secrets is None:
            return self.shown_secret(scalar, piece, "a mission cannot hold a secret: what it does is logged")
        try:
            return self.names.secrets.get(name)
        except NoSecretError as error:
            span = part_span(scalar, piece.start(), piece.end())
            meant = piece.group().replace(name, error.near)
            fix = replacement(span, piece.group(), meant, is_safe=False) if error.near else None
            self.report.add(SECRET.at(span, error.message, help=error.help, fix=fix))
            return BROKEN

    def shown_secret(self, scalar: ScalarNode, piece: re.Match[str], message: str) -> object:
        help_text = "give it, alone, to a setting of a component that takes a secret"
        self.report.add(SHOWN_SECRET.at(part_span(scalar, piece.start(), piece.end()), message, help=help_text))
        return BROKEN

    def expression(self, scalar: ScalarNode, offset: int, expression: Expression) -> object:
        known = self.known
        unknown = [word for word in expression.words if word.name not in known]
        for word in unknown:
            span = part_span(scalar, offset + word.start, offset + word.end)
            fix = correction(word.name, known, span)
            message = f"unknown name '{word.name}'"
            self.report.add(UNKNOWN_NAME.at(span, message, help=self.name_help(word.name), fix=fix))
        if unknown or any(known[word.name].value is BROKEN for word in expression.words):
            return BROKEN
        if expression.text.strip() in known:
            return known[expression.text.strip()].value
        if secret := next((word for word in expression.words if isinstance(known[word.name].value, Secret)), None):
            span = part_span(scalar, offset + secret.start, offset + secret.end)
            message = "nothing can be computed with a secret"
            self.report.add(SHOWN_SECRET.at(span, message, help="a secret must stand alone"))
            return BROKEN
        type_, problems = check(expression, NameTypes(known))
        for problem in problems:
            span = part_span(scalar, offset + problem.start, offset + problem.end)
            self.report.add(WRONG_OPERATION.at(span, problem.message, help=problem.help))
        if problems:
            return BROKEN
        try:
            return _with_type(evaluate(expression, NameValues(known)), type_)
        except EvaluationError as error:
            span = part_span(scalar, offset + error.start, offset + error.end)
            self.report.add(WRONG_OPERATION.at(span, error.message))
            return BROKEN

    def name_help(self, name: str) -> str:
        if name.startswith("env."):
            return "an environment variable must stand alone: '${" + name + "}'"
        if name.startswith("secret."):
            return "a secret must stand alone: '${" + name.lower() + "}'"
        if name.isupper():
            return f"an environment variable is written '${{env.{name}}}'"
        fix = suggest(name, self.known, "names that can be filled in")
        if name.startswith("args.") and not fix.startswith(DID_YOU_MEAN):
            given = ", and give it a value by 'with' where this file is included" if self.scope else ""
            return f"declare '{name.removeprefix('args.')}' below 'args' of this file{given}"
        if self.runs and not fix.startswith(DID_YOU_MEAN):
            return f"what is known while the robot runs is written '${name}'"
        return fix


@dataclass(frozen=True, slots=True)
class _FromEnvironment:
    """Text of unknown type: it is treated as if it were written in the manifest without quotes."""

    text: str


def _typed(scalar: ScalarNode, value: object) -> TreeNode:
    if isinstance(value, _FromEnvironment):
        return replace(scalar, text=value.text, plain=True)
    if isinstance(value, ScalarNode | SequenceNode | tree.MappingNode):
        return value
    return replace(scalar, filled=value)


def _as_text(value: object) -> str:
    return value.text if isinstance(value, _FromEnvironment) else show(value)


def _with_type(value: object, type_: Type) -> object:
    """Return a computed value as manifests hold it: with its dimension, whole numbers as such."""
    if isinstance(value, float) and type_.dimension and type_.dimension not in (NUMBER, QUOTIENT):
        return Quantity(value, type_.dimension)
    is_whole = isinstance(value, float) and type_.kind is TypeKind.COUNT and value.is_integer()
    return int(value) if is_whole and isinstance(value, float) else value
