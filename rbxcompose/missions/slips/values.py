"""Values and settings of steps."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

from rbxcompose.base.findings import DID_YOU_MEAN, Edit, Finding, Fix, nearest, replacement
from rbxcompose.base.units import UnitError, parse_quantity
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.slips.lists import bracketed, without_brackets
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode, plain_value
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words, placeholder, without_word
from rbxcompose.missions.language.node_reader import NAME, invalid_name
from rbxcompose.missions.program.parts import inner_span
from rbxcompose.missions.program.program import RESTART
from rbxcompose.missions.slips import slip

FOREIGN: Mapping[str, str] = {
    "alias": "name",
    "condition": "only_if",
    "continue-on-error": "optional",
    "continue_on_error": "optional",
    "delay": "wait",
    "if": "only_if",
    "interval": "every",
    "limit": "timeout",
    "ignore_errors": "optional",
    "max_attempts": "attempts",
    "max_duration": "timeout",
    "max_time": "timeout",
    "on_error": "on_failure",
    "otherwise": "else",
    "period": "every",
    "retries": "attempts",
    "retry": "attempts",
    "sleep": "wait",
    "success_count": "succeed_when",
    "success_threshold": "succeed_when",
    "timeout-minutes": "timeout",
    "timeout_minutes": "timeout",
    "tries": "attempts",
    "unless": "skip_if",
    "when": "only_if",
    "while": "as_long_as",
}
"""Words of other languages, each with ours: a setting of a step, or a step of its own."""
STEPS = ("wait",)  # those of our words that are steps
_CHAINED = ("elif", "elseif", "elsif", "else_if", "else if")


@slip(Takes.STEP)
def unknown_settings(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise keys that are no settings of this step, but look more like a setting than a second step."""
    unknown = unknown_in(node, place.words) if isinstance(node, MappingNode) else set()
    if not unknown or not isinstance(node, MappingNode):
        return None
    kind = place.words.kind_of(node)
    findings = tuple(_finding(node, kind, key, place.words) for key in node.entries if key in unknown)
    left = MappingNode({key: entry for key, entry in node.entries.items() if key not in unknown}, node.span)
    return Repair(left if place.words.own(left) else without_word(left, place.words), findings)


def unknown_in(step: MappingNode, words: Words) -> set[str]:
    """Return the keys of a step that are neither its word, nor its settings, nor a second step."""
    own, kind = words.own(step), words.kind_of(step)
    if kind:
        slots = words.kinds[kind]
        settings = (*slots, *words.modifiers)
        others = (key for key in own if key not in slots)
        return {key for key in others if _is_stray(step, key, settings, words) or _is_only_option(key, words)}
    options = {key for key in own if words.is_option(key)}
    skills = [key for key in own if key not in options]
    strays = [key for key in skills if _is_stray(step, key, words.modifiers, words)] if len(skills) > 1 else []
    return {*options, *strays[len(strays) == len(skills) :]}  # one of them must be the skill


def _is_stray(step: MappingNode, key: str, settings: Iterable[str], words: Words) -> bool:
    """Return whether a key beside a step is an unknown setting rather than a second step."""
    if key in words.skills or (key in words.kinds and key not in FOREIGN):
        return False
    return key in FOREIGN or key in _CHAINED or bool(nearest(key, settings)) or is_setting(step.entries[key].value)


def _is_only_option(key: str, words: Words) -> bool:
    return words.is_option(key) and key not in words.kinds


def _finding(step: MappingNode, kind: str, key: str, words: Words) -> Finding:
    """Return the finding on a key that is no setting, with the setting that was meant."""
    beside = f"'{kind}'" if kind else "a skill"
    span, message = step.entries[key].key.span, f"unknown key '{key}' beside {beside}"
    if not kind and words.is_option(key):
        return codes.UNKNOWN_KEY.at(span, message, help=f"it belongs to {words.owners(key)}")
    if key in _CHAINED and kind == "if":
        return codes.UNKNOWN_KEY.at(span, message, help="write 'else:', and below it another 'if' with its own 'then'")
    settings = {*words.kinds.get(kind, ()), *words.modifiers} - {kind}
    ours = FOREIGN.get(key, "")
    if ours in STEPS:
        value = step.entries[key].value
        shown = value.text if isinstance(value, ScalarNode) and value.text else "..."
        return codes.UNKNOWN_KEY.at(span, message, help=f"a pause is a step of its own: '- {ours}: {shown}'")
    if ours in settings:
        return codes.UNKNOWN_KEY.at(span, message, help=f"{DID_YOU_MEAN} '{ours}'?")
    if ours and (owners := words.owners(ours)):
        return codes.UNKNOWN_KEY.at(span, message, help=f"{DID_YOU_MEAN} '{ours}'? It belongs to {owners}")
    what = "settings of a step" if _is_stray(step, key, settings, words) else "its settings"
    return codes.UNKNOWN_KEY.misspelt(span, message, key, settings, what, taken=step.entries)


def is_setting(node: TreeNode) -> bool:
    """Return whether a value looks like that of a setting: a number, a flag, a quantity or a text with `$`."""
    if not isinstance(node, ScalarNode) or not node.plain or not node.text:
        return False
    if not isinstance(plain_value(node), str) or "$" in node.text:
        return True
    try:
        parse_quantity(node.text)
    except UnitError:
        return False
    return True


_OURS: Mapping[Takes, Mapping[str, str]] = {
    Takes.MISSION: {
        "do": "steps plan tree body",
        "data": "variables vars blackboard",
        "inputs": "parameters params args arguments",
        "interrupts": "events handlers",
        "about": "description",
    },
    Takes.INTERRUPT: {"when": "if condition on trigger", "do": "then action reaction"},
    Takes.STATE: {"next": "transitions", "do": "action", "on_enter": "on_entry entry", "on_exit": "exit"},
    Takes.STEP: {},  # see `_OF_STEPS`
}
_OF_STEPS: Mapping[str, Mapping[str, str]] = {
    "if": {"then": "do steps"},
    "repeat": {"do": "steps body then actions tasks"},
    "for": {"do": "steps body then actions tasks", "in": "of over items"},
}
_WHAT: Mapping[Takes, str] = {
    Takes.MISSION: "in a mission",
    Takes.INTERRUPT: "in an interrupt",
    Takes.STATE: "in a state",
}


@slip(*_OURS, before=(unknown_settings,))
def foreign_keys(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise keys for which ours are known and not written."""
    if not isinstance(node, MappingNode):
        return None
    kind = place.words.kind_of(node) if place.takes is Takes.STEP else ""
    words = _OF_STEPS.get(kind, {}) if kind else _OURS[place.takes]
    meant = {theirs: ours for ours, names in words.items() if (theirs := _written(node, ours, names))}
    if not meant:
        return None
    entries = {meant.get(name, name): _named(entry, meant.get(name, name)) for name, entry in node.entries.items()}
    what = f"beside '{kind}'" if kind else _WHAT.get(place.takes, "")
    findings = tuple(_report(node.entries[theirs], ours, what) for theirs, ours in meant.items())
    return Repair(MappingNode(entries, node.span), findings)


def _written(node: MappingNode, ours: str, names: str) -> str:
    """Return which of the names of others is written for ours, nothing if ours is, too."""
    if ours in node or (ours == "do" and "machine" in node):
        return ""
    return next((name for name in names.split() if name in node), "")


def _named(entry: Entry, name: str) -> Entry:
    return entry if entry.key.text == name else Entry(replace(entry.key, text=name), entry.value)


def _report(entry: Entry, ours: str, what: str) -> Finding:
    theirs = entry.key.text
    fix = replacement(entry.key.span, theirs, ours, is_safe=False)  # its value may have another form
    help_text = f"{DID_YOU_MEAN} '{ours}'?"
    return codes.UNKNOWN_KEY.at(entry.key.span, f"unknown key '{theirs}' {what}", help=help_text, fix=fix)


@slip(Takes.STEP, after=(unknown_settings,))
def settings_among_branches(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise branches that are named like settings and look like them."""
    kind = place.words.kind_of(node) if isinstance(node, MappingNode) else ""
    if not kind or not isinstance(node, MappingNode):
        return None
    slots, own = place.words.kinds[kind], node.entries[kind]
    if slots[kind].takes is not Takes.BRANCHES or not isinstance(own.value, MappingNode):
        return None
    branches = own.value
    found = {
        key: entry
        for key, entry in branches.entries.items()
        if (key in slots and key != kind and isinstance(entry.value, ScalarNode))
        or (key in place.words.modifiers and key != "name" and is_setting(entry.value))
    }
    if not found:
        return None
    last = next(reversed(branches.entries))
    findings = tuple(_among(own.key, entry, is_last=key == last) for key, entry in found.items())
    left = {key: entry for key, entry in branches.entries.items() if key not in found}
    right = Entry(own.key, MappingNode(left, branches.span))
    return Repair(MappingNode({**found, **node.entries, kind: right}, node.span), findings)


def _among(parallel: ScalarNode, setting: Entry, *, is_last: bool) -> Finding:
    message = f"'{setting.key.text}' is among the branches"
    help_text = f"move it left, into the column of '{parallel.text}'"
    fix = _moved_left(setting, parallel) if is_last else None
    return codes.WRONG_SHAPE.at(setting.key.span, message, help=help_text, fix=fix)


def _moved_left(entry: Entry, parallel: ScalarNode) -> Fix | None:
    """Return the fix that moves a key on a line of its own into the column of `parallel`."""
    span, column = entry.key.span, parallel.span.column
    if entry.value.span.end_line != span.line or column >= span.column:
        return None
    before = span._replace(column=1, end_line=span.line, end_column=span.column)
    edit = Edit(before, " " * (span.column - 1), " " * (column - 1))
    return Fix((edit,), True, f"'{entry.key.text}' into the column of '{parallel.text}'")


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
