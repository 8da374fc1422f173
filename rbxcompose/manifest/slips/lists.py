"""Slips in lists: brackets and dashes that are missing or misplaced, items without names."""

import re
from dataclasses import replace

from rbxcompose.base.findings import Edit, Finding, Fix, replacement
from rbxcompose.base.printable import plain
from rbxcompose.base.units import UnitError, parse_quantity
from rbxcompose.manifest import slips
from rbxcompose.manifest.section import entry_of, help_with_names, name_of
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, plain_value

_ITEM = re.compile(r"\s*+([A-Za-z0-9_.$+-]++(?: [A-Za-z0-9_.%/]++)?)\s*+")  # a word, a name, a number with its unit


def without_brackets(node: TreeNode | None) -> list[tuple[str, int]]:
    """Return the items, with their offsets, of a text that lacks only the brackets of a list; none of any other.

    Round brackets in their place are accepted, too.
    """
    if not isinstance(node, ScalarNode) or not node.plain or node.filled is not None or not node.text:
        return []
    start, end = (1, -1) if node.text[0] == "(" and node.text[-1] == ")" else (0, None)
    pieces = node.text[start:end].split(",")
    found = []
    for piece in pieces[:-1] if len(pieces) > 1 and not pieces[-1].strip() else pieces:
        item = _ITEM.fullmatch(piece)
        if item is None:
            return []
        found.append((item[1], start + item.start(1)))
        start += len(piece) + 1
    return found


def bracketed(node: ScalarNode) -> tuple[str, Fix]:
    """Return the help and the fix for a text that lacks the brackets of a list."""
    meant = f"[{', '.join(text for text, _ in without_brackets(node))}]"
    return f"a list needs brackets: write '{meant}'", replacement(node.span, node.text, meant)


@slips.value_slip("dict_type")
def list_of_named(place: slips.RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a list whose items tell how they are called, by `name` or by the file that they name."""
    if not isinstance(node, SequenceNode) or not node.items or not all(map(name_of, node.items)):
        return None
    entries = {name_of(item): Entry(ScalarNode(name_of(item), item.span), entry_of(item)) for item in node.items}
    return Repair(MappingNode(entries, node.span), (replace(place.finding, help=help_with_names(node)),))


@slips.value_slip("dict_type")
def names_without_entries(place: slips.RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words; they count only where an entry may be empty."""
    items = node.items if isinstance(node, SequenceNode) else ()
    names = [item for item in items if isinstance(item, ScalarNode) and isinstance(plain_value(item), str)]
    if not names or len(names) != len(items):
        return None
    entries = {name.text: Entry(name, MappingNode({}, name.span)) for name in names}
    first = plain(names[0].text, 60)
    help_text = f"each name needs a line of its own with what belongs to it below: '{first}:' instead of '[{first}]'"
    return Repair(MappingNode(entries, node.span), (replace(place.finding, help=help_text),))


_BARE = re.compile(r"(?P<indent> *+)(?P<word>[a-z][a-z0-9_]*)(?P<value>(?: ++[^\s:#]++){1,2})? *")


@slips.text_slip(slips.NO_COLON)
def missing_dash(trouble: slips.Trouble) -> Finding | None:
    """Recognise one to three words in the column of the dashes around them."""
    line = trouble.opening.line - 1
    text = trouble.lines[line]
    found = _BARE.fullmatch(text)
    if found is None or not _is_in_list(trouble, line, len(found["indent"])):
        return None
    word, value = found["word"], (found["value"] or "").strip()
    span = trouble.span(line, len(found["indent"]), len(text.rstrip()))
    meant = f"- {word}: {value}" if value else f"- {word}"
    goes_on = slips.indent(trouble.next_line(line)) > len(found["indent"])
    fix = None if value or goes_on else replacement(span, word, meant)
    return slips.NOT_YAML.at(span, "a dash is missing before this step", help=f"write '{meant}'", fix=fix)


def _is_in_list(trouble: slips.Trouble, line: int, column: int) -> bool:
    """Return whether the nearest line above that is not indented deeper is a list item in this column."""
    above = (trouble.lines[number] for number in trouble.above(line))
    nearest = next((text for text in above if slips.indent(text) <= column), "")
    return slips.indent(nearest) == column and nearest.lstrip().startswith("- ")


_TIGHT = re.compile(r"( *)-([a-z][a-z0-9_]*)(?=: |:? *$)")


@slips.text_slip(slips.ANY)
def tight_dashes(trouble: slips.Trouble) -> Finding | None:
    """Recognise them in the column where the parser failed."""
    near = {line for line in (trouble.line, trouble.opening.line - 1) if line < len(trouble.lines)}
    indents = {len(found[1]) for line in near if (found := _TIGHT.match(trouble.lines[line]))}
    if not indents or "block scalar" in trouble.context:
        return None
    edits = [
        Edit(trouble.span(line, len(found[1]), found.end()), f"-{found[2]}", f"- {found[2]}")
        for line in _siblings(trouble, indents.pop())
        if (found := _TIGHT.match(trouble.lines[line]))
    ]
    first = edits[0]
    fix = Fix(tuple(edits), True, f"'{first.old}' -> '{first.text}'")
    message = "a space is missing after this dash"
    return slips.NOT_YAML.at(first.span, message, help=f"write '{first.text}'", fix=fix)


def _siblings(trouble: slips.Trouble, column: int) -> list[int]:
    """Return the lines around the error that begin in a column, up to any line that begins before it."""
    first = last = min(trouble.line, len(trouble.lines) - 1)
    while first > 0 and not _leaves(trouble.lines[first - 1], column):
        first -= 1
    while last + 1 < len(trouble.lines) and not _leaves(trouble.lines[last + 1], column):
        last += 1
    return [line for line in range(first, last + 1) if slips.indent(trouble.lines[line]) == column]


def _leaves(line: str, column: int) -> bool:
    return bool(line.strip()) and slips.indent(line) < column


@slips.value_slip("list_type", "tuple_type")
def range_of_one(place: slips.RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a quantity; it counts only where a list of two is accepted, and one alone is not."""
    if not isinstance(node, ScalarNode):
        return None
    text = node.text.strip()
    try:
        parse_quantity(text)
    except UnitError:
        return None
    other = text.removeprefix("-") if text.startswith("-") else f"-{text.removeprefix('+')}"
    least, greatest = (text, other) if text.startswith("-") else (other, text)
    help_text = f"a range has two ends: write '[{plain(least, 40)}, {plain(greatest, 40)}]'"
    items = tuple(ScalarNode(one, node.span) for one in (least, greatest))
    return Repair(SequenceNode(items, node.span), (replace(place.finding, help=help_text, fix=None),))


@slips.value_slip("list_type", "tuple_type")
def list_without_brackets(place: slips.RefusedValue, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise one or several items where a list is required."""
    found = without_brackets(node)
    if not found or not isinstance(node, ScalarNode):
        return None
    help_text, fix = bracketed(node)
    items = tuple(ScalarNode(text, node.span) for text, _ in found)
    return Repair(SequenceNode(items, node.span), (replace(place.finding, help=help_text, fix=fix),))
