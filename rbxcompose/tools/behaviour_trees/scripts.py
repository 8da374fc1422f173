"""Scripts of BehaviorTree.CPP from and to expressions of missions: one tree, two spellings."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, fields, replace
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.parser import LEVELS, LONGEST
from rbxcompose.base.units import NUMBER

ScriptTree = syntax.ExpressionNode
TERNARY, OR, AND, NOT, COMPARED, SUM, PRODUCT, MINUS, ATOM = range(9)
COMPARISONS = ("==", "!=", "<", ">", "<=", ">=")
_BINDING: Mapping[str, int] = {
    **{"||": OR, "&&": AND, "+": SUM, "-": SUM, "..": SUM, "*": PRODUCT, "/": PRODUCT},
    **dict.fromkeys(COMPARISONS, COMPARED),
}
_ASSIGNED = (":=", "=", "+=", "-=", "*=", "/=")
_FOREIGN: Mapping[str, str] = {
    **dict.fromkeys(("&", "|", "^", "~"), "there are no operators for bits"),
    "?": "there is no '? :' in expressions; write 'if' with 'then' and 'else'",
}
_TOKEN = re.compile(
    r"\s*(?:(?P<hex>0[xX][0-9a-fA-F]+)|(?P<number>\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)(?![\w.])"
    r"|(?P<text>'[^']*')|(?P<name>[A-Za-z_@]\w*)"
    r"|(?P<symbol>\.\.|&&|\|\||[=!<>:+*/-]=|[-+*/&|^~!<>=?:();])|(?P<end>\Z))"
)


class ScriptError(ValueError):
    """Raised when a script is none, or says what expressions cannot; the text is the reason."""


@dataclass(frozen=True, slots=True)
class Statement:
    """An expression, and the entry to which its value is given; empty for a condition."""

    to: str
    value: ScriptTree


def statements(text: str) -> list[Statement]:
    """Return the statements of a script.

    Raises:
        ScriptError: if it is none, or cannot be said here.
    """
    if len(text) > LONGEST:
        raise ScriptError(f"a script may have {LONGEST:,} characters here; this one has {len(text):,}")
    return list(_ScriptParser(text).statements())


def condition(text: str) -> ScriptTree:
    """Return the expression that a script is, if it assigns nothing.

    Raises:
        ScriptError: if it is none.
    """
    found = statements(text)
    if len(found) != 1 or found[0].to:
        raise ScriptError("it must be one condition, which assigns nothing")
    return found[0].value


def number(value: float) -> syntax.Number:
    """Return a number without a unit."""
    return syntax.Number(0, 0, value, NUMBER)


class _ScriptParser:
    def __init__(self, text: str) -> None:
        self.text, self.position, self.level = text, 0, 0
        self.kind, self.now = "", ""
        self.take()

    def take(self) -> tuple[str, str]:
        taken = self.kind, self.now
        match = _TOKEN.match(self.text, self.position)
        if not match or not match.lastgroup:
            raise ScriptError(f"{self.text[self.position :].strip()[:1]!r} does not belong into a script")
        self.kind, self.now, self.position = match.lastgroup, match[match.lastgroup], match.end()
        return taken

    def at(self, *symbols: str) -> bool:
        return self.kind == "symbol" and self.now in symbols

    def statements(self) -> Iterator[Statement]:
        while self.kind != "end":
            if self.at(";"):
                self.take()
                continue
            left = self.expression(TERNARY)
            if self.at(*_ASSIGNED):
                if not isinstance(left, syntax.Variable):
                    raise ScriptError(f"'{self.now}' needs the name of an entry before it")
                operator = self.take()[1]
                right = self.expression(TERNARY)
                if operator not in (":=", "="):
                    right = syntax.Arithmetic(0, 0, operator[0], left, right)
                yield Statement(left.name, right)
            else:
                yield Statement("", left)
            if self.kind != "end" and not self.at(";"):
                raise ScriptError(_FOREIGN.get(self.now, f"'{self.now[:20]}' does not belong here"))

    def expression(self, binding: int) -> ScriptTree:
        self.level += 1
        if self.level > LEVELS:
            raise ScriptError(f"an expression may have {LEVELS} levels")
        left = self.operand()
        while self.kind == "symbol" and (strength := _BINDING.get(self.now, TERNARY)) > binding:
            left = self.operation(left, strength)
        self.level -= 1
        return left

    def operation(self, left: ScriptTree, strength: int) -> ScriptTree:
        operator = self.take()[1]
        operands = [left, self.expression(strength)]
        if strength in (OR, AND):
            while self.at(operator):
                self.take()
                operands.append(self.expression(strength))
            return syntax.Junction(0, 0, "and" if strength == AND else "or", tuple(operands))
        if strength == COMPARED:
            operators = [operator]
            while self.at(*COMPARISONS):
                operators.append(self.take()[1])
                operands.append(self.expression(strength))
            pairs = [syntax.Comparison(0, 0, each, operands[i], operands[i + 1]) for i, each in enumerate(operators)]
            return pairs[0] if len(pairs) == 1 else syntax.Junction(0, 0, "and", tuple(pairs))
        return syntax.Arithmetic(0, 0, "+" if operator == ".." else operator, *operands)

    def operand(self) -> ScriptTree:
        kind, text = self.take()
        match kind, text:
            case "hex", _:
                return number(float(int(text, 16)))
            case "number", _:
                return number(float(text))
            case "text", _:
                return syntax.Text(0, 0, text[1:-1])
            case "name", "true" | "false":
                return syntax.Flag(0, 0, text == "true")
            case "name", _:
                return syntax.Variable(0, 0, text)
            case "symbol", "-":
                return syntax.Minus(0, 0, self.expression(MINUS))
            case "symbol", "!":
                return syntax.Not(0, 0, self.expression(MINUS))
            case "symbol", "(":
                inner = self.expression(TERNARY)
                if not self.at(")"):
                    raise ScriptError(_FOREIGN.get(self.now, "a bracket is not closed"))
                self.take()
                return inner
        raise ScriptError(_FOREIGN.get(text, f"a value is missing before '{text}'" if text else "a value is missing"))


@dataclass(frozen=True, slots=True)
class _Spelling:
    """How a language writes an expression; `words` are its operators, `variable` writes a name."""

    variable: Callable[[str], str]
    words: Mapping[str, str] = field(default_factory=dict)
    not_: str = "not "
    not_binds: int = NOT
    is_script: bool = False


OURS = _Spelling("${}".format)


def text_of(tree: ScriptTree, spelling: _Spelling = OURS) -> str:
    """Return an expression as a text that reads back as the same tree.

    Raises:
        ScriptError: if the language has no words for it.
    """
    return _spelt(tree, spelling)[0]


def script_of(tree: ScriptTree, variable: Callable[[str], str] = str) -> str:
    """Return an expression as a script.

    Raises:
        ScriptError: if scripts have no words for it.
    """
    return text_of(tree, _Spelling(variable, {"and": "&&", "or": "||"}, "!", MINUS, is_script=True))


def _spelt(tree: ScriptTree, how: _Spelling) -> tuple[str, int]:
    def inner(node: ScriptTree, least: int) -> str:
        text, strength = _spelt(node, how)
        return text if strength >= least else f"({text})"

    match tree:
        case syntax.Number(value=value):
            text = str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
            return text, ATOM if value >= 0 else MINUS
        case syntax.Text(value=value):
            quote = '"' if "'" in value and not how.is_script else "'"
            if quote in value:
                raise ScriptError("a text with quotes in it cannot be said")
            return f"{quote}{value}{quote}", ATOM
        case syntax.Flag(value=value):
            return ("true" if value else "false"), ATOM
        case syntax.Variable(name=name):
            return how.variable(name), ATOM
        case syntax.Not(operand=operand):
            return how.not_ + inner(operand, how.not_binds), how.not_binds
        case syntax.Minus(operand=operand):
            return f"-{inner(operand, MINUS)}", MINUS
        case syntax.Junction(operator=operator, operands=operands):
            strength = AND if operator == "and" else OR
            word = f" {how.words.get(operator, operator)} "
            return word.join(inner(each, strength + 1) for each in operands), strength
        case syntax.Comparison(operator=operator, left=left, right=right):
            return f"{inner(left, SUM)} {operator} {inner(right, SUM)}", COMPARED
        case syntax.Arithmetic(operator=operator, left=left, right=right):
            strength = SUM if operator in "+-" else PRODUCT
            return f"{inner(left, strength)} {operator} {inner(right, strength + 1)}", strength
        case syntax.FunctionCall(function=function):
            raise ScriptError(f"scripts have no function '{function}'")
        case syntax.Word(name=name):
            raise ScriptError(f"scripts have no word '{name}'; a text has quotes")
        case syntax.Membership():
            raise ScriptError("scripts have no 'in'")
        case _:
            raise ScriptError("scripts have no lists and no fields")
    raise AssertionError


def unplaced(tree: ScriptTree, names: Callable[[str], str] = str) -> ScriptTree:
    """Return an expression's tree without places in the text, to compare two, and with other `names` for variables."""

    def changed(value: Any) -> Any:
        if isinstance(value, syntax.Variable):
            return syntax.Variable(0, 0, names(value.name))
        if isinstance(value, tuple):
            return tuple(map(changed, value))
        if isinstance(value, syntax._Placed):
            inner = {each.name: changed(getattr(value, each.name)) for each in fields(value)}
            return replace(value, **{**inner, "start": 0, "end": 0})
        return value

    found: ScriptTree = changed(tree)
    return found
