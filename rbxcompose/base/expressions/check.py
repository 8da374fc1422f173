"""Expressions before any value is known: names, dimensions, arguments."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Protocol

from rbxcompose.base import units
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree
from rbxcompose.base.expressions.types import (
    COUNT,
    FLAG,
    POSE,
    STEP,
    TEXT,
    UNKNOWN,
    Type,
    TypeKind,
    accepts,
    are_comparable,
    common,
    list_of,
    list_with,
    quantity_of,
    wider,
)
from rbxcompose.base.expressions.values import FUNCTIONS
from rbxcompose.base.findings import DID_YOU_MEAN, clauses, suggest, surely_meant


def _written(node: tree.ExpressionNode) -> tree.Number | None:
    """Return the literal number of a node; None if it is something else."""
    while isinstance(node, tree.Minus):
        node = node.operand
    return node if isinstance(node, tree.Number) else None


def is_bare(node: tree.ExpressionNode) -> bool:
    """Return whether a node is a literal number without a unit."""
    number = _written(node)
    return number is not None and number.dimension == units.NUMBER


def missing_unit(node: tree.ExpressionNode, dimension: units.Dimension) -> str:
    """Return what to write instead of a bare number, or nothing if it is read as SI."""
    sign = 1.0
    while isinstance(node, tree.Minus):
        node, sign = node.operand, -sign
    return units.bare_number_help(dimension, sign * node.value) if isinstance(node, tree.Number) else ""


class _Typed(NamedTuple):
    """A node with its type."""

    node: tree.ExpressionNode
    type: Type


def other_unit(left: _Typed, right: _Typed) -> str:
    """Return the units of a literal quantity next to one that is not, or where a name gets its unit."""
    for (written, bare), (other, kind) in ((left, right), (right, left)):
        dimension = kind.dimension
        if dimension not in units.DIMENSIONS.values() or not dimension or _written(other):
            continue
        if _written(written):
            return f"units of {kind.phrase}: {', '.join(units.units_of(dimension)) or 'none'}"
        if isinstance(written, tree.Variable) and bare.measure == units.NUMBER and dimension != units.NUMBER:
            return f"give '{written.name}' a unit where it is declared, such as '{units.example(dimension)}'"
    return ""


def quotes_needed(text: str) -> str:
    """Return the help for a text without quotes: those of the expression, within those of YAML."""
    return f"a text needs quotes: write '\"{text}\"'"


_DECLARED = "'inputs' or 'data' of the mission, as 'save' of a step, or as 'values' of the robot"


class StaticScope(Protocol):
    """The names that exist, and their types; a subclass knows what it overrides, and nothing else."""

    def variable(self, name: str) -> Type | None:
        """Return the type of `$name`; None if there is no such name."""
        return None

    def word(self, name: str) -> Type | None:
        """Return the type of what a bare word names; None if it names nothing. Choices need not be known."""
        return None

    def variables(self) -> Iterable[str]:
        """Return the names that `variable` knows, without '$'."""
        return ()

    def words(self) -> Iterable[str]:
        """Return the names that `word` knows."""
        return ()


@dataclass(frozen=True, slots=True)
class ExpressionProblem:
    """A problem at `start` to `end` of an expression's text."""

    message: str
    start: int
    end: int
    help: str = ""
    meant: str = ""
    """The only possible correction, if there is one."""
    is_choice: bool = False
    """Whether it is about a word that had to be one of a few."""


def check(expression: tree.Expression, scope: StaticScope) -> tuple[Type, list[ExpressionProblem]]:
    """Return the type of an expression, unknown if it is wrong, and its problems in the order of the text."""
    checker = _Checker(scope)
    found = checker.type_of(expression.tree)
    return found, checker.sorted()


def check_value(expression: tree.Expression, scope: StaticScope, expected: Type) -> list[ExpressionProblem]:
    """Return the problems of an expression that must give a value of the type `expected`."""
    checker = _Checker(scope)
    checker.require(expression.tree, expected)
    return checker.sorted()


def check_condition(expression: tree.Expression, scope: StaticScope) -> list[ExpressionProblem]:
    """Return the problems of an expression that must be true or false."""
    return check_value(expression, scope, FLAG)


class _Checker:
    """Walks one tree; a wrong node has an unknown type for those above it, so that nothing is reported twice."""

    def __init__(self, scope: StaticScope) -> None:
        self.scope = scope
        self.problems: list[ExpressionProblem] = []

    def sorted(self) -> list[ExpressionProblem]:
        return sorted(self.problems, key=lambda problem: (problem.start, problem.end))

    def wrong(self, node: tree.ExpressionNode, message: str, fix: str = "", meant: str | None = "") -> Type:
        self.problems.append(ExpressionProblem(message, node.start, node.end, fix, meant or ""))
        return UNKNOWN

    def type_of(self, node: tree.ExpressionNode, expected: Type = UNKNOWN) -> Type:
        """Return the type of a node; `expected` has the choices that a bare word may be."""
        match node:
            case tree.Number(value=value, dimension=dimension):
                return COUNT if dimension == units.NUMBER and value.is_integer() else quantity_of(dimension)
            case tree.Text(value=name) | tree.Word(name=name) if name in expected.choices:
                return expected
            case tree.Text():
                return self.text(node, expected)
            case tree.Flag():
                return FLAG
            case tree.Variable():
                return self.variable(node)
            case tree.Word():
                return self.word(node, expected)
            case tree.Items(items=nodes):
                return list_with([self.type_of(item, expected.entry) for item in nodes])
            case tree.FieldAccess() | tree.Index():
                return self.part(node)
            case tree.FunctionCall():
                return self.call(node)
            case tree.Minus(operand=operand):
                return self.measured(operand)
            case tree.Not(operand=operand):
                return self.require(operand, FLAG)
            case tree.Junction(operands=operands):
                for operand in operands:
                    self.require(operand, FLAG)
                return FLAG
            case tree.Comparison():
                return self.comparison(node)
            case tree.Membership():
                return self.membership(node)
            case tree.Arithmetic():
                return self.arithmetic(node)

    def require(self, node: tree.ExpressionNode, expected: Type) -> Type:
        """Report a node that is not of the type `expected`; return that type."""
        found = self.type_of(node, expected)
        if accepts(expected, found):
            return expected
        if expected.dimension and is_bare(node):
            if fix := missing_unit(node, expected.dimension):
                self.wrong(node, f"this must be {expected.phrase}; the unit is missing", fix)
            return expected
        what = "true or false" if expected == FLAG else expected.detail
        self.wrong(node, f"this must be {what}; it is {found.detail}", _HELP.get(expected.kind, ""))
        return expected

    def text(self, node: tree.Text, expected: Type) -> Type:
        if expected.kind is TypeKind.CHOICE:
            return self.wrong(node, f"unknown choice '{node.value}'", suggest(node.value, expected.choices, "choices"))
        return TEXT

    def variable(self, node: tree.Variable) -> Type:
        if found := self.scope.variable(node.name):
            return found
        if self.scope.word(node.name):
            return self.wrong(node, f"unknown name '${node.name}'", f"write '{node.name}' without '$'", node.name)
        names = [f"${name}" for name in self.scope.variables()]
        meant = surely_meant(node.name, self.scope.variables())
        fix = suggest(f"${node.name}", names, "names")
        if not fix.startswith(DID_YOU_MEAN):
            fix = clauses(fix, f"new ones are declared as {_DECLARED}")
        return self.wrong(node, f"unknown name '${node.name}'", fix, f"${meant}" if meant else "")

    def word(self, node: tree.Word, expected: Type) -> Type:
        if found := self.scope.word(node.name):
            return found
        if self.scope.variable(node.name):
            fix, meant = f"write '${node.name}'", f"${node.name}"
        elif expected == TEXT:
            fix, meant = quotes_needed(node.name), ""
        elif expected.choices:
            return self.choice(node, expected)
        else:
            known = [] if expected == STEP else list(self.scope.words())
            fix = suggest(node.name, known, "places") or _HELP.get(expected.kind, "")
            meant = surely_meant(node.name, known) or ""
            if expected == UNKNOWN and not fix.startswith(DID_YOU_MEAN):
                fix = clauses(quotes_needed(node.name), fix)
            variable = "" if meant else surely_meant(node.name, self.scope.variables())
            if variable:
                fix, meant = f"did you mean '${variable}'?", f"${variable}"
        return self.wrong(node, f"unknown name '{node.name}'", fix, meant)

    def choice(self, node: tree.Word, expected: Type) -> Type:
        message = f"'{node.name}' is none of {', '.join(expected.choices)}"
        fix, meant = suggest(node.name, expected.choices, "choices"), surely_meant(node.name, expected.choices) or ""
        fix = fix if fix.startswith(DID_YOU_MEAN) else ""  # the message lists them
        self.problems.append(ExpressionProblem(message, node.start, node.end, fix, meant, is_choice=True))
        return UNKNOWN

    def part(self, node: tree.FieldAccess | tree.Index) -> Type:
        whole = self.type_of(node.of)
        if isinstance(node, tree.FieldAccess):
            if whole.names and node.name not in whole.names:
                return self.wrong(node, f"there is no entry '{node.name}'", f"entries: {', '.join(whole.names)}")
            if whole.kind in (TypeKind.MAP, TypeKind.UNKNOWN):
                return whole.part(node.name)
            return self.wrong(node, f"{whole.phrase} has no fields")
        key = self.type_of(node.index, TEXT if whole.kind is TypeKind.MAP else UNKNOWN)
        match whole.kind:
            case TypeKind.UNKNOWN:
                return UNKNOWN
            case TypeKind.MAP if key.kind in _NAMES:
                match node.index:
                    case tree.Word(name=name) | tree.Text(value=name):
                        return whole.part(name)
                return whole.entry
            case TypeKind.LIST if key == UNKNOWN or key.measure in (units.NUMBER, units.QUOTIENT):
                number = node.index.value if isinstance(node.index, tree.Number) else 0.5
                return whole.parts.get(f"{number:.0f}", whole.entry) if number.is_integer() else whole.entry
            case TypeKind.MAP:
                return self.wrong(node.index, f"an entry of a map is found by a name; this is {key.phrase}")
            case TypeKind.LIST:
                return self.wrong(node.index, f"an item of a list is found by a number; this is {key.phrase}")
        return self.wrong(node, f"{whole.phrase} has no items")

    def comparison(self, node: tree.Comparison) -> Type:
        left, right = self.pair(node.left, node.right)
        if node.operator in ("==", "!="):
            self.equality(node, left, right)
        elif self.is_measured(left) and self.is_measured(right):
            self.joined(node, left, right, "is compared with")
        return FLAG

    def pair(self, left: tree.ExpressionNode, right: tree.ExpressionNode) -> tuple[_Typed, _Typed]:
        """Return two nodes with their types; a bare word may be a choice of the other one's type."""
        if isinstance(left, tree.Word | tree.Text):
            other = self.type_of(right)
            return _Typed(left, self.type_of(left, other)), _Typed(right, other)
        type_ = self.type_of(left)
        return _Typed(left, type_), _Typed(right, self.type_of(right, type_))

    def membership(self, node: tree.Membership) -> Type:
        if isinstance(node.group, tree.Items):
            for one in node.group.items:
                self.equality(one, *self.pair(node.item, one))
            return FLAG
        group = self.type_of(node.group)
        item = self.type_of(node.item, group.entry if group.kind is TypeKind.LIST else TEXT)
        match group.kind:
            case TypeKind.LIST:
                self.equality(node, _Typed(node.item, item), _Typed(node.group, group.entry))
            case TypeKind.MAP:
                if item.kind not in _NAMES:
                    self.wrong(node.item, f"a map holds names; this is {item.phrase}")
            case TypeKind.UNKNOWN:
                pass
            case _:
                self.wrong(node.group, f"'in' needs a list or a map; this is {group.phrase}")
        return FLAG

    def equality(self, node: tree.ExpressionNode, left: _Typed, right: _Typed) -> None:
        if left.type.measure and right.type.measure:
            self.joined(node, left, right, "is compared with")
        elif not are_comparable(left.type, right.type):
            poses = TypeKind.POSE in (left.type.kind, right.type.kind)
            fix = "write 'distance(a, b) < 10 cm'" if poses else ""
            self.wrong(node, f"{left.type.phrase} is compared with {right.type.phrase}", fix)

    def joined(self, node: tree.ExpressionNode, left: _Typed, right: _Typed, verb: str) -> Type:
        """Return the type of the sum, the least or the greatest of two measured values."""
        dimension, other = left.type.measure, right.type.measure
        if not dimension or not other:
            return UNKNOWN
        if dimension.is_comparable(other):
            return wider(left.type, right.type)
        for bare, measured in ((left, right), (right, left)):
            if is_bare(bare.node) and measured.type.dimension:
                if fix := missing_unit(bare.node, measured.type.dimension):
                    return self.wrong(node, f"{measured.type.phrase} {verb} a bare number", fix)
                return measured.type
        return self.wrong(node, f"{left.type.phrase} {verb} {right.type.phrase}", other_unit(left, right))

    def is_measured(self, typed: _Typed) -> bool:
        """Return whether a value can be computed with; report it if not."""
        if typed.type != UNKNOWN and not typed.type.measure:
            name = typed.node.name if isinstance(typed.node, tree.Variable) and typed.type.kind is TypeKind.MAP else ""
            fix = f"read an entry of it: '${name}.NAME'" if name else ""
            wanted = "one quantity" if typed.type.members else "a number"
            self.wrong(typed.node, f"this must be {wanted}; it is {typed.type.phrase}", fix)
        return typed.type.measure is not None

    def measured(self, node: tree.ExpressionNode) -> Type:
        found = self.type_of(node)
        return found if self.is_measured(_Typed(node, found)) else UNKNOWN

    def arithmetic(self, node: tree.Arithmetic) -> Type:
        left = _Typed(node.left, self.type_of(node.left))
        right = _Typed(node.right, self.type_of(node.right))
        kinds = {left.type.kind, right.type.kind}
        if node.operator == "+" and kinds <= {TypeKind.TEXT, TypeKind.CHOICE}:
            return TEXT
        if node.operator == "+" and kinds == {TypeKind.LIST}:
            return list_of(common((left.type.entry, right.type.entry)))
        if node.operator == "+" and TypeKind.UNKNOWN in kinds:
            return UNKNOWN
        # Check both, so that both are reported.
        if not all([self.is_measured(left), self.is_measured(right)]):
            return UNKNOWN
        if node.operator in _SUMS:
            return self.joined(node, left, right, _SUMS[node.operator])
        return _product(node.operator, left.type, right.type)

    def call(self, node: tree.FunctionCall) -> Type:
        name, arguments = node.function, node.arguments
        if wrong := FUNCTIONS[name].wrong_count(len(arguments)):
            self.wrong(node, f"{name}() {wrong}")
            return _RESULTS.get(name, UNKNOWN)
        match name:
            case "age" | "new":
                if isinstance(arguments[0], tree.Variable):
                    self.type_of(arguments[0])
                else:
                    self.wrong(arguments[0], f"{name}() needs a name with '$'", f"such as {name}($scan)")
            case "count":
                found = self.type_of(arguments[0])
                if found.kind not in (TypeKind.LIST, TypeKind.MAP, TypeKind.UNKNOWN):
                    self.wrong(arguments[0], f"count() needs a list or a map; this is {found.phrase}")
            case "distance":
                for argument in arguments:
                    self.require(argument, POSE)
            case "round":
                found = self.measured(arguments[0])
                if found.measure not in (None, units.NUMBER, units.QUOTIENT):
                    fix = "divide by a unit first, such as '1 cm' or '1 %'"
                    self.wrong(arguments[0], f"round() needs a number without a unit; this is {found.phrase}", fix)
            case "abs":
                return self.measured(arguments[0])
            case _:
                return self.extreme(node)
        return _RESULTS[name]

    def extreme(self, node: tree.FunctionCall) -> Type:
        """Return the type of the least or the greatest of several values, or of the items of one list."""
        first, *others = node.arguments
        if others:
            found = self.measured(first)
            for other in others:
                found = self.joined(node, _Typed(first, found), _Typed(other, self.measured(other)), "is compared with")
            return found
        group = self.type_of(first)
        if group.kind not in (TypeKind.LIST, TypeKind.UNKNOWN):
            return self.wrong(first, f"{node.function}() needs several values or a list; this is {group.phrase}")
        return group.entry if self.is_measured(_Typed(first, group.entry)) else UNKNOWN


_NAMES = frozenset({TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE, TypeKind.UNKNOWN})
_SUMS = {"+": "is added to", "-": "is reduced by"}
_HELP = {
    TypeKind.COUNT: "write round(...) for a whole number",
    TypeKind.STEP: "write it under 'data', and its name here, such as '$chore'",
}
_RESULTS = {
    "age": quantity_of(units.TIME),
    "new": FLAG,
    "count": COUNT,
    "distance": quantity_of(units.LENGTH),
    "round": COUNT,
}


def _product(operator: str, left: Type, right: Type) -> Type:
    if operator == "*" and left == right == COUNT:
        return COUNT
    dimension, other = left.measure or units.NUMBER, right.measure or units.NUMBER
    return quantity_of(dimension * other if operator == "*" else dimension / other)
