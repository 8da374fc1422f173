"""The reference of expressions: units, types, operators, functions, limits."""

from __future__ import annotations

from docs.generating.markdown import code, page, table
from rbxcompose.base.expressions.parser import LEVELS, LONGEST, OPERATORS, STEPS
from rbxcompose.base.expressions.values import FUNCTIONS, LONGEST_TEXT, MOST_ITEMS
from rbxcompose.base.units import DIMENSIONS, Dimension, example, needs_unit, units_of

UNITS = """## Types and units
A quantity is a number with a unit. A bare number is in the first unit of its row; where the row says
*must have its unit*, a bare number is an error. Arguments and inputs have these types, too.

"""
OTHER_TYPES = {
    "count": "a whole number, not below 0",
    "text": "text; in an expression it has quotes",
    "flag": "`true` or `false`",
    "place": "the name of a place",
    "pose": "a place, or a pose that arrives while the robot runs",
    "list": "several values in order: `[1, 2]`",
    "map": "values by name",
    "choice": "one of the words in `choices`",
}
OPERANDS = """## Operands
| written | is |
| --- | --- |
| `0.3 m/s`, `2` | a quantity, a number |
| `'hello'` | a text |
| `true`, `false` | flags |
| `[1, 2]` | a list |
| `$name` | an input, a datum, a value, the item of a loop, `$pose` |
| `$name.field`, `$list[0]`, `$map[kitchen]` | a field; an item, counted from 0; an entry |
| `dock` | a place, or one of the words of a choice |
| `(...)` | brackets |
"""


def whole_page() -> str:
    """Return the page."""
    units = [(code(name), *of_dimension(dimension)) for name, dimension in DIMENSIONS.items()]
    others = [(code(name), words) for name, words in OTHER_TYPES.items()]
    return page(
        "Expressions, types and units",
        UNITS + table(("type", "units", "example", "a bare number"), units),
        table(("type", "its values"), others),
        OPERANDS,
        operators(),
        functions(),
        limits(),
    )


def of_dimension(dimension: Dimension) -> tuple[str, str, str]:
    """Return units, example and the meaning of a bare number."""
    units = units_of(dimension)
    bare = "*must have its unit*" if needs_unit(dimension) else f"counts in {code(units[0])}" if units else ""
    return " ".join(map(code, units)), code(example(dimension)), bare


def operators() -> str:
    """Return the operators."""
    rows = [(" ".join(map(code, operator.symbols)), operator.about, code(operator.example)) for operator in OPERATORS]
    return "## Operators\nFrom weakest to strongest binding.\n\n" + table(
        ("operators", "what they give", "example"), rows
    )


def functions() -> str:
    """Return the functions."""
    rows = [(code(function.form), function.about) for function in FUNCTIONS.values()]
    return "## Functions\nThere are no others.\n\n" + table(("function", "gives"), rows)


def limits() -> str:
    """Return what is too much."""
    sizes = f"at most {LONGEST:,} characters, {LEVELS} levels and {STEPS} parts"
    return f"## Limits\nAn expression has {sizes}, a text {LONGEST_TEXT:,} characters, a list {MOST_ITEMS:,} items.\n"
