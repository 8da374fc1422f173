"""Filling in `${...}` after composition: arguments, the robot's name, the environment, expressions over them."""

from __future__ import annotations

import re
from dataclasses import replace
from operator import is_

from rbxcompose.config import Secret
from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.check import check
from rbxcompose.expressions.evaluate import evaluate
from rbxcompose.expressions.parser import parse_fill
from rbxcompose.expressions.tree import Expression, ExpressionError
from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.expressions.values import EvaluationError
from rbxcompose.findings import DID_YOU_MEAN, Report, correction, kind, replacement, suggest
from rbxcompose.manifest import tree
from rbxcompose.manifest.arguments import show
from rbxcompose.manifest.fill_names import Names, NameTypes, NameValues
from rbxcompose.manifest.given_values import given_span
from rbxcompose.manifest.launch_syntax import PATTERN, Cure, cure_of, cure_of_variable
from rbxcompose.manifest.limits import ALL_BYTES
from rbxcompose.manifest.scalar_parts import part_span
from rbxcompose.manifest.scalars import describe
from rbxcompose.manifest.secrets import NoSecretError
from rbxcompose.manifest.tree import BROKEN, Entry, ScalarNode, SequenceNode, TreeNode, size
from rbxcompose.manifest.validate import to_plain
from rbxcompose.manifest.yaml_nodes import TOO_LARGE
from rbxcompose.printable import plain
from rbxcompose.units import NUMBER, QUOTIENT, Quantity

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


def fill(root: tree.MappingNode, names: Names, report: Report, *, runs: bool = False) -> tree.MappingNode:
    """Return the tree with every `${...}` filled in; `runs` means that `$name` has a meaning in it (missions).

    A scalar that is nothing but `${...}` holds the typed value in `filled`, or becomes the list or map that it names;
    one that could not be filled in holds `BROKEN`.
    """
    return _Filler(names, report, runs).mapping(root)


class _Filler:
    """One pass over a tree; a node without `$` stays the same object."""

    def __init__(self, names: Names, report: Report, runs: bool) -> None:
        self.names = names
        self.report = report
        self.runs = runs
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
        if body is None and name:
            return None if self.runs else self.running_name(scalar, piece)
        if body is None:
            return None if self.runs else "$"
        span = part_span(scalar, piece.start(), piece.end())
        if not piece["end"]:
            self.report.add(SYNTAX.at(span, "this '${' is never closed", help="write '}' at its end"))
            return BROKEN
        if variable := _ENVIRONMENT.fullmatch(body):
            return self.variable(scalar, piece, variable)
        if secret := _SECRET.fullmatch(body):
            return self.secret(scalar, piece, secret["name"])
        try:
            expression = parse_fill(body)
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
