"""Text to tokens, and tokens to a tree, by binding strength."""

import re
from collections.abc import Iterator, Sequence
from enum import Enum, auto
from functools import lru_cache

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.values import FOREIGN, FUNCTIONS
from rbxcompose.base.findings import suggest
from rbxcompose.base.units import NUMBER_TEXT, UNITS, Quantity, UnitError, quantity, unit_help

KEYWORDS = frozenset({"true", "false", "and", "or", "not", "in"})
NAME = r"[A-Za-z][A-Za-z0-9_]*"


class TokenKind(Enum):
    """The kinds of tokens; their names are those of the groups in `_TOKEN`."""

    NUMBER = auto()
    TEXT = auto()
    VARIABLE = auto()
    WORD = auto()
    SYMBOL = auto()  # keywords, too
    END = auto()


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of the text; `text` is as written, for a variable without its `$`; numbers have a `quantity`."""

    kind: TokenKind
    text: str
    start: int
    end: int
    quantity: Quantity | None = None


_SPACE = re.compile(r"\s*")
_TOKEN = re.compile(
    rf"""(?P<NUMBER>{NUMBER_TEXT})
    | (?P<TEXT>'[^']*'|"[^"]*")
    | \$(?P<VARIABLE>{NAME})
    | (?P<SYMBOL>(?:{"|".join(sorted(KEYWORDS))})(?![A-Za-z0-9_.])|<=|>=|==|!=|\*(?!\*)|/(?!/)|[-+<>()\[\],.])
    | (?P<WORD>{NAME}(?:\.{NAME})*)
    | (?P<END>\Z)""",
    re.VERBOSE,
)
# The longest unit wins; a letter after it makes it another word: `6 m/step` is a division by `step`.
_LONGEST_FIRST = "|".join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))
_UNIT = re.compile(rf"\s*({_LONGEST_FIRST})(?![A-Za-z0-9_])")
_IN_BRACES = re.compile(rf"\{{{{1,2}}\s*\$?({NAME})\s*\}}")  # as templates and BehaviorTree.CPP write a name
_NO_UNIT = re.compile(r"\s*(?!(?:and|or|in|not)\b)((?:[^\W\d]|°)[\w/^]*)")
# `3 in $list` is a membership test, while `3 in` is a length: only in the first does a value follow the word.
_VALUE = re.compile(r"""\s*(?!(?:and|or|in|not)\b)[$\w'"(\[]""")

CURLY_QUOTES = "\u201c\u201d\u201e\u2018\u2019\u201a\u00ab\u00bb"  # those of books, which are letters to YAML
# Symbols that other languages have and this one lacks; longer ones first.
_FOREIGN = {
    "${": "'${...}' is filled in earlier; here write '$name', which is looked up while the robot runs",
    "$": "a name follows the '$', such as '$battery'",
    "&&": "write 'and'",
    "||": "write 'or'",
    "**": "there is no power operator; multiply",
    "^": "there is no power operator; multiply",
    "//": "write round(...) for whole numbers",
    "=>": "write '>='",
    "=<": "write '<='",
    "=": "write '==' to compare",
    "!": "write 'not'",
    "%": "a percentage is written with its number, such as '30 %'; there is no remainder operator",
    ":": "a time is a number with a unit, such as '5 s' or '2 min'",
    **dict.fromkeys(CURLY_QUOTES, "quotes are straight: write \" or '"),
    "{{": "no braces are needed here: '$name' is a value of the robot or the mission, such as '$battery < 30 %'",
    "{": "a map cannot be written here",
    "_": "names start with a letter",
    "'": "the quote is not closed",
    '"': "the quote is not closed",
}


def tokens(text: str) -> Iterator[Token]:
    """Yield the tokens of a text; the last one is END.

    Raises:
        ExpressionError: when the iteration reaches text that belongs to no expression.
    """
    position = 0
    kind = None
    while kind is not TokenKind.END:
        space = _SPACE.match(text, position)
        start = space.end() if space else position
        match = _TOKEN.match(text, start)
        if not match or not match.lastgroup:
            raise _unreadable(text, start)
        kind, position = TokenKind[match.lastgroup], match.end()
        read = None
        if kind is TokenKind.NUMBER:
            read, position = _with_unit(text, start, position)
        yield Token(kind, match[match.lastgroup], start, position, read)


def _with_unit(text: str, start: int, end: int) -> tuple[Quantity, int]:
    """Return the quantity whose number stands at `start` to `end`, and where its unit ends."""
    number = text[start:end]
    unit = _UNIT.match(text, end)
    if unit and unit[1] == "in" and _VALUE.match(text, unit.end()):
        unit = None
    elif not unit and (wrong := _NO_UNIT.match(text, end)):
        raise syntax.ExpressionError(
            f"unknown unit '{wrong[1]}'", wrong.start(1), wrong.end(1), unit_help(wrong[1], number)
        )
    if unit:
        end = unit.end()
    try:
        return quantity(number, UNITS[unit[1]] if unit else None), end
    except UnitError as error:
        raise syntax.ExpressionError(error.message, start, end) from None


def _unreadable(text: str, start: int) -> syntax.ExpressionError:
    foreign = next((symbol for symbol in _FOREIGN if text.startswith(symbol, start)), None)
    shown = foreign or text[start]
    fix = _FOREIGN[foreign] if foreign else ""
    if braces := _IN_BRACES.match(text, start):
        fix = f"write '${braces[1]}'"
    return syntax.ExpressionError(f"{shown!r} means nothing in an expression", start, start + len(shown), fix)


@dataclass(frozen=True, slots=True)
class Operator:
    """Operators that bind equally; with `is_prefix`, they come before their only operand."""

    symbols: tuple[str, ...]
    about: str
    example: str
    is_prefix: bool = False


OPERATORS: Sequence[Operator] = (
    Operator(("or",), "One of two conditions; the second is evaluated only if the first does not hold.", "$a or $b"),
    Operator(("and",), "Both conditions; the second is evaluated only if the first holds.", "$a and $b"),
    Operator(("not",), "The opposite of a condition.", "not $is_open", is_prefix=True),
    Operator(
        ("<", "<=", ">", ">=", "==", "!=", "in", "not in"),
        "Comparisons of values of one dimension; no chains. `in` looks for an item of a list or a key of a map.",
        "$battery < 30 %",
    ),
    Operator(
        ("+", "-"), "Sum and difference of values of one dimension; `+` also joins texts and lists.", "$timeout + 5 s"
    ),
    Operator(("*", "/"), "Product and quotient; the dimensions are computed too.", "2 * 0.3 m/s"),
    Operator(("-",), "The negative of a number or quantity.", "-$offset", is_prefix=True),
)


LONGEST = 1000  # characters
LEVELS = 50  # levels of the tree, and of brackets
_REMEMBERED = 1000  # texts; robots use the same ones again and again
STEPS = 500  # nodes; an expression has no loops, so this bounds its evaluation

_OR, _AND, _NOT, _COMPARED, _SUM, _PRODUCT, _MINUS = range(1, 8)  # as in OPERATORS
_BINDING = {
    symbol.split()[0]: strength  # 'not' as in 'not in'
    for strength, operator in enumerate(OPERATORS, start=_OR)
    if not operator.is_prefix
    for symbol in operator.symbols
}

# Words of other languages; the names of places and choices never look like these.
_PARSER_FOREIGN = {
    "True": "write 'true'",
    "False": "write 'false'",
    "AND": "write 'and'",
    "OR": "write 'or'",
    "NOT": "write 'not'",
    "is": "write '=='",
    "lambda": f"the functions are {', '.join(FUNCTIONS)}",
}


@lru_cache(_REMEMBERED)
def parse(text: str) -> syntax.Expression:
    """Read a condition, a value or an argument, in which `$name` is looked up while the robot runs.

    Raises:
        ExpressionError: if it is none, or exceeds a limit.
    """
    return _parse(text, running=True)


def parse_fill(text: str) -> syntax.Expression:
    """Read the text between `${` and `}`, which is filled in when the files are composed: it allows no `$name`.

    Raises:
        ExpressionError: if it is no expression, or exceeds a limit.
    """
    return _parse(text, running=False)


def _parse(text: str, *, running: bool) -> syntax.Expression:
    if len(text) > LONGEST:
        message = f"an expression may have {LONGEST:,} characters; this one has {len(text):,}"
        raise syntax.ExpressionError(message, LONGEST, len(text))
    parser = _Parser(tokens(text), running)
    tree = parser.expression()
    parser.end()
    for steps, (node, level) in enumerate(syntax.walk(tree), start=1):
        if level > LEVELS or steps > STEPS:
            raise _too_much(node.start, node.end)
    return syntax.Expression(text, tree)


def _too_much(start: int, end: int) -> syntax.ExpressionError:
    limits = f"an expression may have {LEVELS} levels and {STEPS} parts"
    return syntax.ExpressionError(limits, start, end, "compute a part of it with 'set' first")


class _Parser:
    """Reads the tokens from left to right; a method that returns a node takes its tokens."""

    def __init__(self, read: Iterator[Token], running: bool) -> None:
        self.tokens = read
        self.running = running
        self.level = 0
        self.now = next(read)

    def take(self) -> Token:
        token = self.now
        self.now = next(self.tokens, token)  # END is never passed
        return token

    def at(self, *symbols: str) -> bool:
        return self.now.kind is TokenKind.SYMBOL and self.now.text in symbols

    def close(self, symbol: str, opened: Token) -> Token:
        """Take the bracket that closes `opened`."""
        if self.now.kind is TokenKind.END:
            raise syntax.ExpressionError(
                f"'{opened.text}' is not closed", opened.start, opened.end, f"write '{symbol}'"
            )
        if not self.at(symbol):
            raise self.unexpected()
        return self.take()

    def end(self) -> None:
        if self.now.kind is not TokenKind.END:
            raise self.unexpected()

    def unexpected(self) -> syntax.ExpressionError:
        """Return what is wrong with a token in the place of an operator."""
        token = self.now
        if token.kind is TokenKind.SYMBOL:
            return syntax.ExpressionError(f"'{token.text}' does not belong here", token.start, token.end)
        message = f"an operator is missing before '{token.text}'"
        return syntax.ExpressionError(message, token.start, token.end, _PARSER_FOREIGN.get(token.text, ""))

    def expression(self, binding: int = 0) -> syntax.ExpressionNode:
        """Read operands and all operators between them that bind tighter than `binding`."""
        self.level += 1
        if self.level > LEVELS:
            raise _too_much(self.now.start, self.now.end)
        left = self.operand()
        compared = False
        while self.now.kind is TokenKind.SYMBOL and (strength := _BINDING.get(self.now.text, 0)) > binding:
            if compared and strength == _COMPARED:
                help_text = "write 'a < b and b < c'"
                raise syntax.ExpressionError("comparisons cannot be chained", self.now.start, self.now.end, help_text)
            compared = strength == _COMPARED
            left = self.operation(left, strength)
        self.level -= 1
        return left

    def operation(self, left: syntax.ExpressionNode, strength: int) -> syntax.ExpressionNode:
        operator = self.take()
        if operator.text in ("and", "or"):
            operands = [left, self.expression(strength)]
            while self.at(operator.text):
                self.take()
                operands.append(self.expression(strength))
            return syntax.Junction(left.start, operands[-1].end, operator.text, tuple(operands))
        if operator.text == "not":
            if not self.at("in"):
                raise self.unexpected()
            self.take()
        right = self.expression(strength)
        start, end = left.start, right.end
        match operator.text:
            case "in":
                return syntax.Membership(start, end, left, right)
            case "not":
                return syntax.Not(start, end, syntax.Membership(start, end, left, right))
            case "+" | "-" | "*" | "/":
                return syntax.Arithmetic(start, end, operator.text, left, right)
            case _:
                return syntax.Comparison(start, end, operator.text, left, right)

    def operand(self) -> syntax.ExpressionNode:
        token = self.take()
        match token.kind:
            case TokenKind.NUMBER if token.quantity:
                return syntax.Number(token.start, token.end, token.quantity.value, token.quantity.dimension)
            case TokenKind.TEXT:
                return syntax.Text(token.start, token.end, token.text[1:-1])
            case TokenKind.VARIABLE:
                return self.parts(self.variable(token))
            case TokenKind.WORD:
                return self.call(token) if self.at("(") else self.parts(self.word(token))
            case TokenKind.SYMBOL:
                return self.symbol(token)
        raise syntax.ExpressionError("a value is missing at the end", token.start, token.end)

    def symbol(self, token: Token) -> syntax.ExpressionNode:
        match token.text:
            case "true" | "false":
                return syntax.Flag(token.start, token.end, token.text == "true")
            case "-":
                operand = self.expression(_MINUS)
                return syntax.Minus(token.start, operand.end, operand)
            case "not":
                operand = self.expression(_NOT)
                return syntax.Not(token.start, operand.end, operand)
            case "(":
                inner = self.expression()
                self.close(")", token)
                return (
                    self.parts(inner)
                    if isinstance(inner, syntax.Variable | syntax.Word | syntax.FieldAccess | syntax.Index)
                    else inner
                )
            case "[":
                items, end = self.items("]", token)
                return syntax.Items(token.start, end, items)
        raise syntax.ExpressionError(f"a value is missing before '{token.text}'", token.start, token.end)

    def variable(self, token: Token) -> syntax.Variable:
        if not self.running:
            message = f"'${token.text}' is known only while the robot runs"
            help_text = "'${...}' is filled in earlier: write a name without '$', such as 'args.speed'"
            raise syntax.ExpressionError(message, token.start, token.end, help_text)
        return syntax.Variable(token.start, token.end, token.text)

    def word(self, token: Token) -> syntax.Word:
        if token.text in _PARSER_FOREIGN:
            message = f"'{token.text}' means nothing in an expression"
            raise syntax.ExpressionError(message, token.start, token.end, _PARSER_FOREIGN[token.text])
        return syntax.Word(token.start, token.end, token.text)

    def call(self, name: Token) -> syntax.FunctionCall:
        if name.text not in FUNCTIONS:
            help_text = FOREIGN.get(name.text) or suggest(name.text, FUNCTIONS, "the functions are")
            raise syntax.ExpressionError(f"unknown function '{name.text}'", name.start, name.end, help_text)
        arguments, end = self.items(")", self.take())
        return syntax.FunctionCall(name.start, end, name.text, arguments)

    def items(self, closing: str, opened: Token) -> tuple[tuple[syntax.ExpressionNode, ...], int]:
        """Read comma-separated values up to the closing bracket; return them and its end."""
        read: list[syntax.ExpressionNode] = []
        if not self.at(closing):
            read.append(self.expression())
            while self.at(","):
                self.take()
                read.append(self.expression())
        return tuple(read), self.close(closing, opened).end

    def parts(self, node: syntax.ExpressionNode) -> syntax.ExpressionNode:
        """Read the fields and indices that follow a value."""
        while self.at(".", "["):
            opened = self.take()
            if opened.text == "[":
                index = self.expression()
                node = syntax.Index(node.start, self.close("]", opened).end, node, index)
                continue
            names = self.take()
            if names.kind is not TokenKind.WORD and names.text not in KEYWORDS:
                raise syntax.ExpressionError("a field's name is missing after '.'", opened.start, names.end)
            end = names.start - 1
            for name in names.text.split("."):
                end += 1 + len(name)
                node = syntax.FieldAccess(node.start, end, node, name)
        return node
