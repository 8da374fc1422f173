"""Single values: numbers in words, flags, lists, names and assignments in one line."""

import re
from collections.abc import Mapping
from dataclasses import replace

from rbxcompose.base.findings import Edit, Fix, replacement
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.slips.lists import bracketed, without_brackets
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.asked import inner_span
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, placeholder
from rbxcompose.missions.language.value_reader import NAME, invalid_name
from rbxcompose.missions.program.program import RESTART
from rbxcompose.missions.slips import slip

_WRITTEN = re.compile(
    r"\$?(?P<name>[a-z][a-z0-9_]*)(?P<sign>\s*(?::=|[+-]=|=(?!=))\s*|:)(?P<value>[^\s=].*)", re.DOTALL
)
_EXAMPLE = "'name: value'"


@slip(Takes.ASSIGNMENTS)
def assigned_in_line(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a text below `set`; one that is no assignment is reported, too, and gets no further findings."""
    if not isinstance(node, ScalarNode):
        return None
    key = place.key
    found = _WRITTEN.fullmatch(node.text) if node.plain else None
    if found is None:
        message = f"'{key.text}' needs names and their values"
        help_text = f"write {_EXAMPLE} on the line below '{key.text}:', further right"
        return Repair(placeholder(node.span), (codes.WRONG_SHAPE.at(key.span, message, help=help_text),))
    name, sign, value = found["name"], found["sign"].strip(), found["value"]
    if node.span.line != node.span.end_line:
        message = f"below '{key.text}', write each name on a line of its own, followed by a colon"
        finding = codes.WRONG_SHAPE.at(node.span, message, help=f"write {_EXAMPLE}, such as '{name}: 1'")
        return Repair(placeholder(node.span), (finding,))
    if sign in ("+=", "-="):
        value = f"${name} {sign[0]} {value}" if value.split() == [value] else f"${name} {sign[0]} ({value})"
    meant = f"{name}: {value}"
    message = "a space is missing after the colon" if sign == ":" else f"'{key.text}' takes a colon, not '{sign}'"
    is_below = node.span.line > key.span.line
    where = "" if is_below else f" on the line below '{key.text}:', further right"
    fix = replacement(node.span, node.text, meant) if is_below else None
    finding = codes.WRONG_SHAPE.at(node.span, message, help=f"write '{meant}'{where}", fix=fix)
    left = ScalarNode(name, inner_span(node, found.start("name"), found.end("name")))
    right = ScalarNode(value, inner_span(node, found.start("value"), len(node.text)))
    return Repair(MappingNode({name: Entry(left, right)}, node.span), (finding,))


ENDLESS: Mapping[str, str] = {
    **dict.fromkeys(("always", "endless", "endlessly", "infinite", "unlimited", "inf", "true"), "forever"),
    "-1": "forever",
}
_NUMBERS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
NUMBERS: Mapping[str, str] = {
    **{word: str(number) for number, word in enumerate(_NUMBERS, start=1)},
    "once": "1",
    "twice": "2",
}
_TIMES = re.compile(r"(?P<digits>\d+)\s*(times?|x|rounds?|attempts?|tries)")


@slip(Takes.COUNT)
def count_in_words(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words for a number, and words for no end where `forever` is allowed."""
    if not isinstance(node, ScalarNode) or node.text in place.choices:
        return None
    key, forever = place.key.text, ENDLESS.get(node.text, "")
    if forever in place.choices:
        meant, finding = forever, codes.NOT_A_CHOICE.at(node.span, f"'{key}' cannot be '{node.text}'")
    elif meant := _digits(node):
        finding = codes.WRONG_TYPE.at(node.span, f"'{key}' takes only a number in digits")
    else:
        return None
    fix = replacement(node.span, node.text, meant)
    return Repair(replace(node, text=meant), (replace(finding, help=f"write '{meant}'", fix=fix),))


def _digits(node: ScalarNode) -> str:
    text = node.text.lower() if node.plain else ""
    found = _TIMES.fullmatch(text)
    return found["digits"] if found else NUMBERS.get(text, "")


@slip(Takes.ITEM_NAME)
def dollar_before_a_name(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a name written as in an expression that uses it."""
    bare = node.text[1:] if isinstance(node, ScalarNode) and node.text.startswith("$") else ""
    if not NAME.fullmatch(bare) or not isinstance(node, ScalarNode):
        return None
    fix = replacement(node.span, node.text, bare)
    finding = replace(invalid_name(node), help=f"write '{bare}' without '$'", fix=fix)
    return Repair(replace(node, text=bare), (finding,))


FLAGS: Mapping[str, str] = {"no": "false", "off": "false", "on": "true", "yes": "true"}


@slip(Takes.FLAG)
def foreign_flag(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise other words for true and false."""
    meant = FLAGS.get(node.text.lower(), "") if isinstance(node, ScalarNode) and node.filled is None else ""
    if not meant or not isinstance(node, ScalarNode):
        return None
    message, fix = f"'{place.key.text}' must be true or false", replacement(node.span, node.text, meant)
    finding = codes.NOT_A_CHOICE.at(node.span, message, help=f"write '{meant}'", fix=fix)
    return Repair(ScalarNode(meant, node.span), (finding,))


@slip(Takes.ITEMS)
def list_without_brackets(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise several items; a single one may be the name of a datum."""
    found = without_brackets(node)
    if len(found) < 2 or not isinstance(node, ScalarNode):
        return None
    help_text, fix = bracketed(node)
    items = tuple(ScalarNode(text, inner_span(node, start, start + len(text))) for text, start in found)
    finding = codes.WRONG_SHAPE.at(node.span, f"'{place.key.text}' needs a list", help=help_text, fix=fix)
    return Repair(SequenceNode(items, node.span), (finding,))


_IN_LINE = re.compile(rf"{RESTART}:?\s+(?P<name>[a-z][a-z0-9_]*)")
_DEEPER = "  "


@slip(Takes.AFTERWARDS)
def restart_in_line(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise `restart NAME` and `restart: NAME`."""
    found = _IN_LINE.fullmatch(node.text) if isinstance(node, ScalarNode) and node.plain else None
    if not found or not isinstance(node, ScalarNode):
        return None
    meant = f"{RESTART}: {found['name']}"
    message = f"'{RESTART}' and what it restarts need a line of their own"
    help_text = f"write '{meant}' on the line below '{place.key.text}:', further right"
    fix = _on_a_line_below(place.key, node, meant)
    key = ScalarNode(RESTART, inner_span(node, 0, len(RESTART)))
    name = ScalarNode(found["name"], inner_span(node, found.start("name"), len(node.text)))
    finding = codes.WRONG_SHAPE.at(node.span, message, help=help_text, fix=fix)
    return Repair(MappingNode({RESTART: Entry(key, name)}, node.span), (finding,))


def _on_a_line_below(key: ScalarNode, value: ScalarNode, meant: str) -> Fix:
    """Return the fix, which applies only to a key that begins its line: inside `{}`, lines mean nothing."""
    span, indent = key.span, " " * (key.span.column - 1)
    before = span._replace(column=1, end_line=span.line, end_column=span.column)
    place = value.span._replace(line=span.line, column=span.column)
    edit = Edit(place, f"{key.text}: {value.text}", f"{key.text}:\n{indent}{_DEEPER}{meant}")
    return Fix((Edit(before, indent, indent), edit), True, f"'{value.text}' -> '{meant}'")
