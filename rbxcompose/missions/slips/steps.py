"""The word of a step: misspelt, without a space behind its colon, without a dash, or beside another one."""

import re
from collections.abc import Iterator

from rbxcompose.base.findings import DID_YOU_MEAN, Edit, Finding, Fix, nearest, replacement
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words, placeholder, without_word
from rbxcompose.missions.language.keys import FOREIGN
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.machines import keys_outside_their_machine
from rbxcompose.missions.slips.settings import unknown_in, unknown_settings

_TIGHT = re.compile(r"-(?=[a-z][a-z0-9_]*$)")
_INDENT = "  "


@slip(Takes.STEP)
def tight_dashes(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise keys that begin with a dash."""
    entries = node.entries if isinstance(node, MappingNode) else {}
    tight = [entry.key for key, entry in entries.items() if _TIGHT.match(key)]
    if not tight or not isinstance(node, MappingNode):
        return None
    is_list = len(tight) == len(entries)  # else there is something that is no item of a list
    message = "a space is missing after this dash"
    findings = (
        codes.WRONG_SHAPE.at(key.span, message, help=f"write '- {key.text[1:]}'", fix=_spaced(key) if is_list else None)
        for key in tight
    )
    return Repair(without_word(node, place.words), tuple(findings))


def _spaced(key: ScalarNode) -> Fix:
    """Return the fix that puts a space after a dash; it applies only to a line of its own."""
    return _behind(_INDENT, key, f"- {key.text[1:]}")


def _behind(before: str, key: ScalarNode, meant: str) -> Fix:
    """Return the fix that writes a word in another way; it applies only behind `before`."""
    span = key.span
    place = span._replace(column=span.column - len(before), end_line=span.line, end_column=span.column)
    return Fix((Edit(place, before, before), Edit(span, key.text, meant)), True, f"'{key.text}' -> '{meant}'")


@slip(Takes.STEP, after=(tight_dashes,))
def misspelt_kind(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a step of no kind that has an option of some kind and a word similar to that of a kind."""
    words = place.words
    if not isinstance(node, MappingNode) or words.kind_of(node):
        return None
    own = words.own(node)
    others = [key for key in own if not words.is_option(key)]
    for word in others if len(others) < len(own) else ():
        ours = FOREIGN.get(word.casefold(), "")
        if meant := [ours] if ours in words.kinds else nearest(word, words.kinds):
            key, message = node.entries[word].key, f"unknown step '{word}'"
            finding = codes.UNKNOWN_KEY.misspelt(key.span, message, word, words.kinds)
            if ours:
                fix = replacement(key.span, word, ours, is_safe=False)
                finding = codes.UNKNOWN_KEY.at(key.span, message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=fix)
            right = Entry(ScalarNode(meant[0], key.span), node.entries[word].value)
            entries = dict((meant[0], right) if one[0] == word else one for one in node.entries.items())
            return Repair(MappingNode(entries, node.span), (finding,))
    return None


_TIGHT_COLON = re.compile(r"[a-z][a-z0-9_]*:[^\s:/].*")


@slip(Takes.STEP, after=(unknown_settings,))
def words_run_together(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a step whose word is several words."""
    own = place.words.own(node) if isinstance(node, MappingNode) else []
    if not own or not isinstance(node, MappingNode):
        return None
    finding = _report(node.entries[place.words.kind_of(node) or own[0]], place.words)
    return Repair(without_word(node, place.words), (finding,)) if finding else None


def _report(entry: Entry, known: Words) -> Finding | None:
    key, words = entry.key, entry.key.text.split()
    if _TIGHT_COLON.fullmatch(key.text):
        name, _, value = key.text.partition(":")
        meant, message = f"{name}: {value}", "a space is missing after the colon"
        tight = replacement(key.span, key.text, meant)
        return codes.WRONG_SHAPE.at(key.span, message, help=f"write '{meant}'", fix=tight)
    if len(words) < 2:
        return None
    if key.span.line != key.span.end_line:
        message = "a step with settings below it needs a colon"
        return codes.WRONG_SHAPE.at(key.span, message, help=f"write '{words[0]}:'")
    message, meant = f"'{key.text}' is neither a step nor a skill", f"{words[0]}: {' '.join(words[1:])}"
    is_alone = key.plain and entry.value.span == key.span  # there is no colon behind it
    fix = _behind(_DASH, key, meant) if is_alone and _takes_value(words[0], known) and _VALUE.match(words[1]) else None
    return codes.WRONG_SHAPE.at(key.span, message, help=f"write '{meant}'", fix=fix)


_DASH = "- "
_VALUE = re.compile(r"[\w$]")  # begins what is no other form of YAML
_VALUES = (Takes.TEXT, Takes.DURATION, Takes.CONDITION, Takes.WATCHED, Takes.VALUE, Takes.WORD, Takes.CHOICE)


def _takes_value(word: str, known: Words) -> bool:
    """Return whether a step may be a word with one value behind its colon."""
    slots = known.kinds.get(word, {})
    has_steps = any(slot.takes in (Takes.STEP, Takes.CASES) for slot in slots.values())
    return word in known.skills or (word in slots and slots[word].takes in _VALUES and not has_steps)


@slip(Takes.STEPS, Takes.BRANCHES)
def missing_dashes(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the value of a `sequence` or another list of steps that is no list."""
    if isinstance(node, SequenceNode) or (isinstance(node, MappingNode) and place.takes is Takes.BRANCHES):
        return None
    key = place.key
    message = f"'{key.text}' needs a list: each of its steps has a dash"
    if isinstance(node, ScalarNode) or not node.entries:
        word = node.text.split()[0] if isinstance(node, ScalarNode) and node.text.strip() else "go_to: dock"
        help_text = f"write each step on a line of its own below '{key.text}:', such as '- {word}'"
        return Repair(placeholder(node.span), (codes.WRONG_SHAPE.at(key.span, message, help=help_text),))
    first = next(iter(node.entries.values()))
    shown = f"- {first.key.text}" + (f": {first.value.text}" if isinstance(first.value, ScalarNode) else ":")
    help_text = f"put a dash before each step: '{shown.removesuffix(': ')}'"
    fix = _dashed(node, place.words)
    finding = codes.WRONG_SHAPE.at(first.key.span, message, label="put a dash here", help=help_text, fix=fix)
    return Repair(SequenceNode(tuple(_steps(node, place.words)), node.span), (finding,))


def _steps(value: MappingNode, words: Words) -> Iterator[MappingNode]:
    """Yield the steps that were meant by the keys of a map; a setting belongs to the step above it."""
    entries: dict[str, Entry] = {}
    for name, entry in value.entries.items():
        if entries and name not in words.modifiers and not words.is_option(name):
            yield MappingNode(entries, next(iter(entries.values())).key.span)
            entries = {}
        entries[name] = entry
    yield MappingNode(entries, next(iter(entries.values())).key.span)


def _dashed(value: MappingNode, words: Words) -> Fix | None:
    """Return the fix that puts a dash before each step, if each is one known word with its value on the same line."""
    entries = list(value.entries.items())
    lines = [entry.key.span.line for _, entry in entries]
    is_plain = all(
        words.is_step(name)
        and name not in words.modifiers
        and not words.is_option(name)
        and entry.key.plain
        and isinstance(entry.value, ScalarNode)
        and entry.value.span.end_line == entry.key.span.line
        for name, entry in entries
    )
    # The map has only one of two equal keys: the line of the other, here the last one, would not get a dash.
    behind = value.span.end_line - lines[-1], value.span.end_column
    is_whole = behind[0] <= 0 or (behind[0] == 1 and behind[1] < entries[0][1].key.span.column)
    if not is_plain or not is_whole or lines != list(range(lines[0], lines[0] + len(lines))):
        return None
    edits = []
    for name, entry in entries:
        span, indent = entry.key.span, " " * (entry.key.span.column - 1)
        before = span._replace(column=1, end_line=span.line, end_column=span.column)
        edits += [Edit(before, indent, indent), Edit(span, name, f"{_DASH}{name}")]
    return Fix(tuple(edits), True, f"'{entries[0][0]}' -> '- {entries[0][0]}'")


@slip(Takes.STEP, after=(tight_dashes, misspelt_kind, keys_outside_their_machine), before=(unknown_settings,))
def second_step(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise keys that are steps of their own; only the first one is read here."""
    if not isinstance(node, MappingNode) or len(place.words.own(node)) < 2:
        return None
    kind = place.words.kind_of(node)
    slots = place.words.kinds.get(kind, {})
    unknown = unknown_in(node, place.words)
    steps = [key for key in place.words.own(node) if key not in unknown and (key not in slots or key == kind)]
    if len(steps) < 2:
        return None
    findings = tuple(_missing_dash(node, steps[0], second, place.words) for second in steps[1:])
    gone = set(steps) - {kind or steps[0]}
    return Repair(
        MappingNode({key: entry for key, entry in node.entries.items() if key not in gone}, node.span), findings
    )


def _missing_dash(step: MappingNode, first: str, second: str, words: Words) -> Finding:
    message = f"'{second}' is a second step beside '{first}', without a dash of its own"
    help_text = f"write '- {second}: ...' as its own step"
    fix = _dash_before(step, second, words) if words.is_step(second) else None
    return codes.TWO_STEPS.at(step.entries[second].key.span, message, label="put a dash here", help=help_text, fix=fix)


def _dash_before(step: MappingNode, key: str, words: Words) -> Fix | None:
    """Return the fix that turns a key of a list item into the next item, unless a later key may belong to either."""
    first, second = next(iter(step.entries.values())).key.span, step.entries[key].key.span
    if first.column != second.column or second.line == first.line:
        return None
    for behind in reversed(step.entries):
        if behind == key:
            break
        if behind in words.modifiers or words.is_option(behind):
            return None
    guard, dash = (
        span._replace(column=span.column - 2, end_line=span.line, end_column=span.column) for span in (first, second)
    )
    return Fix((Edit(guard, _DASH, _DASH), Edit(dash, " " * len(_DASH), _DASH)), True, f"'{key}' -> '- {key}'")
