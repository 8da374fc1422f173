"""Settings of steps: unknown ones, those of other languages, and those that stand at the wrong place."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from rbxcompose.base.findings import DID_YOU_MEAN, Edit, Finding, Fix, nearest, replacement
from rbxcompose.base.units import UnitError, parse_quantity
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, plain_value
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words, without_word
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
