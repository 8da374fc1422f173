"""Steps: words of other languages, steps without a dash, loops, hooks, machines."""

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

from rbxcompose.base.findings import DID_YOU_MEAN, Edit, Finding, Fix, nearest, replacement
from rbxcompose.base.printable import plain
from rbxcompose.manifest.slips import Repair
from rbxcompose.manifest.tree import (
    Entry,
    Key,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    all_nodes,
    children,
    with_children,
)
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import FOREIGN, GrammarPlace, Takes, Words, placeholder, without_word
from rbxcompose.missions.language.node_reader import NAME, begun_step, invalid_name, valid_name
from rbxcompose.missions.program.parts import CONDITIONAL, DEEDS, ENDS, MACHINE_KEYS, OPTIONS, inner_span
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.values import foreign_keys, unknown_in, unknown_settings

MACHINE = "machine"


@slip(Takes.MISSION, Takes.STEP, Takes.STATE)
def keys_outside_their_machine(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a machine's keys beside it, and those of any machine at the very left of a mission.

    The latter are moved to the machine that they may belong to, if there is only one.
    """
    if not isinstance(node, MappingNode) or not any(key in node for key in MACHINE_KEYS):
        return None
    own, is_mission = _machine_of(node), place.takes is Takes.MISSION
    pairs = list(_machines(node)) if is_mission else []
    strays = [key for key in MACHINE_KEYS if key in node and ((own and key not in own) or pairs)]
    if not strays:
        return None
    added: dict[int, dict[str, Entry]] = {}  # by the identity of the machine
    for key in strays:
        homes = [machine for holder, machine in pairs if key not in machine and key not in holder]
        home = own if own and key not in own else homes[0] if len(homes) == 1 else None
        added.setdefault(id(home), {})[key] = node.entries[key]
    help_text = f"move it right, below '{MACHINE}:', into the column of 'states'"
    findings = (
        codes.WRONG_SHAPE.at(node.entries[key].key.span, f"'{key}' belongs to the machine", help=help_text)
        for key in strays
    )
    left = {key: entry for key, entry in node.entries.items() if key not in strays}
    return Repair(_with_additions(MappingNode(left, node.span), added), tuple(findings))


def _machine_of(node: TreeNode) -> MappingNode | None:
    """Return the machine in a map; it must have states to count as one."""
    machine = node.get(MACHINE) if isinstance(node, MappingNode) else None
    return machine if isinstance(machine, MappingNode) and "states" in machine else None


def _machines(root: MappingNode) -> Iterator[tuple[MappingNode, MappingNode]]:
    """Yield all maps with a machine, and their machine."""
    waiting: list[TreeNode] = [root]
    while waiting:
        node = waiting.pop()
        if isinstance(node, MappingNode) and (machine := _machine_of(node)):
            yield node, machine
        waiting += (below for _, below in children(node))


def _with_additions(node: TreeNode, added: dict[int, dict[str, Entry]]) -> TreeNode:
    """Return a tree with the additions to each machine."""
    new = with_children(node, lambda _, below: _with_additions(below, added))
    more = added.get(id(node), {})
    return MappingNode({**new.entries, **more}, new.span, new.tag) if more and isinstance(new, MappingNode) else new


@slip(Takes.MACHINE)
def misnamed_states(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise states with names such as `go home`."""
    states = node.get("states") if isinstance(node, MappingNode) else None
    wrong = [name for name in states.entries if not NAME.fullmatch(name)] if isinstance(states, MappingNode) else []
    if not isinstance(states, MappingNode) or not isinstance(node, MappingNode) or not wrong:
        return None
    cures = {name: valid_name(name) for name in wrong}
    counts = Counter(cures.values())
    taken = {*states.entries, *ENDS}
    meant = {name: new for name, new in cures.items() if new and new not in taken and counts[new] == 1}
    places: dict[str, list[ScalarNode]] = {name: [states.entries[name].key] for name in wrong}
    for way in _ways(node, states):
        places.get(way.text, []).append(way)
    ends = node.get("ends")
    known = {*states.entries, *ENDS, *(ends.entries if isinstance(ends, MappingNode) else ())}
    findings = tuple(_no_name(name, places[name], meant.get(name, "")) for name in wrong)
    return Repair(_renamed(node, states, _Meant(meant, known)), findings)


def _no_name(name: str, places: list[ScalarNode], meant: str) -> Finding:
    edits = tuple(Edit(place.span, name, meant) for place in places)
    return invalid_name(places[0], Fix(edits, True, f"'{name}' -> '{meant}'") if meant else None)


class _Meant:
    """The states that words in transitions mean."""

    def __init__(self, meant: Mapping[str, str], known: Collection[str]) -> None:
        self.meant = meant
        self.known = known

    def of(self, node: TreeNode) -> TreeNode:
        """Return a word replaced by the name of the state that it means, even if it is slightly misspelt."""
        if not isinstance(node, ScalarNode):
            return node
        near = nearest(node.text, self.meant) if node.text not in self.known else [node.text]
        name = self.meant.get(near[0]) if near else None
        return replace(node, text=name) if name else node


def _renamed(machine: MappingNode, states: MappingNode, meant: _Meant) -> MappingNode:
    entries = {}
    for name, entry in states.entries.items():
        new = meant.meant.get(name, name)
        entries[new] = Entry(replace(entry.key, text=new), _leading(entry.value, meant))
    below = {**machine.entries, "states": Entry(machine.entries["states"].key, replace(states, entries=entries))}
    if "start" in below:
        below["start"] = Entry(below["start"].key, meant.of(below["start"].value))
    return replace(machine, entries=below)


def _leading(state: TreeNode, meant: _Meant) -> TreeNode:
    """Return a state whose `next` has the intended names of states."""

    def leads(key: Key, to: TreeNode) -> TreeNode:
        if key != "next":
            return to
        return with_children(to, lambda _, one: meant.of(one)) if isinstance(to, MappingNode) else meant.of(to)

    return with_children(state, leads) if isinstance(state, MappingNode) else state


def _ways(machine: MappingNode, states: MappingNode) -> Iterator[ScalarNode]:
    """Yield all words that name the state to enter."""
    leads = [machine.get("start")]
    for entry in states.entries.values():
        to = entry.value.get("next") if isinstance(entry.value, MappingNode) else None
        leads += [one.value for one in to.entries.values()] if isinstance(to, MappingNode) else [to]
    yield from (lead for lead in leads if isinstance(lead, ScalarNode))


@slip(Takes.STATE)
def asking_next(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words that begin a condition, unless they are outcomes of this state: these are refused there."""
    to = node.get("next") if isinstance(node, MappingNode) else None
    asking = (
        [entry.key for word, entry in to.entries.items() if word in CONDITIONAL] if isinstance(to, MappingNode) else []
    )
    if not asking:
        return None
    below = [one.get("outcomes") for one in all_nodes(node) if isinstance(one, MappingNode)]
    if any(key in outcomes for outcomes in below if isinstance(outcomes, MappingNode) for key in CONDITIONAL):
        return None
    help_text = (
        "let a 'check' be the last step of this state, and write below 'next' where 'success' and 'failure' lead"
    )
    message = f"'next' takes no conditions: there is no '{asking[0].text}' in it"
    repaired = with_children(node, lambda key, value: placeholder(value.span) if key == "next" else value)
    return Repair(repaired, (codes.WRONG_SHAPE.at(asking[0].span, message, help=help_text),))


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
    name, rest = begun_step(words, known.kinds, known.skills)
    if key.span.line != key.span.end_line:
        message = "a step with settings below it needs a colon"
        return codes.WRONG_SHAPE.at(key.span, message, help=f"write '{name}:'")
    text, is_alone = " ".join(rest), entry.value.span == key.span  # there is no colon behind it
    if not is_alone and not known.is_step(name):
        name, text = valid_name(key.text) or name, ""
    if not is_alone and isinstance(entry.value, ScalarNode):
        value = plain(entry.value.text, _LONGEST)
        text = f'"{text}: {value}"' if text and value else text or value
    meant, fix = f"{name}: {text}" if text else name if is_alone else f"{name}:", None
    if key.plain and not rest:
        fix = replacement(key.span, key.text, name)
    elif key.plain and is_alone and _takes_value(name, known) and _VALUE.match(text):
        fix = _behind(_DASH, key, meant)
    message = f"'{key.text}' is neither a step nor a skill"
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


_WORDS = ("while", "until")
_LONGEST = 60  # characters of the condition, in the help


@slip(Takes.STEP, before=(misspelt_kind,))
def while_loop(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the word with what to do beside it, where no step of another kind is."""
    if not isinstance(node, MappingNode) or place.words.kind_of(node) or "do" not in node:
        return None
    word = next((candidate for candidate in _WORDS if candidate in node and candidate not in place.words.skills), "")
    if not word:
        return None
    entry = node.entries[word]
    text = plain(entry.value.text, _LONGEST) if isinstance(entry.value, ScalarNode) else "CONDITION"
    until = f"not ({text})" if word == "while" else text
    help_text = f"write 'repeat: forever', and below it 'until: {until}', which is asked after each round"
    finding = codes.UNKNOWN_KEY.at(entry.key.span, f"unknown step '{word}'", help=help_text)
    ours = {"repeat": ScalarNode("forever", entry.key.span), "until": entry.value}
    made = {name: Entry(ScalarNode(name, entry.key.span), value) for name, value in ours.items()}
    left = {name: one for name, one in node.entries.items() if name != word}
    return Repair(MappingNode({**made, **left}, node.span), (finding,))


_THEN, _ELSE = re.compile(r"\bthen\b:?+"), re.compile(r"\belse\b:?+")
_LOOP = re.compile(r"(?P<word>while|until)\b:?+\s*+(?P<condition>.++)", re.DOTALL)


@slip(Takes.STEP, before=(unknown_settings,))
def in_the_line_of_if(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise `if: CONDITION then STEP` and `repeat: while CONDITION`."""
    if not isinstance(node, MappingNode):
        return None
    entry = node.entries.get("if")
    if entry and "then" not in node and isinstance(value := entry.value, ScalarNode):
        found = _THEN.search(value.text) if value.plain and not {*value.text} & {*"'\""} else None
        return _then(node, value, found) if found else None
    entry = node.entries.get("repeat")
    if entry and isinstance(value := entry.value, ScalarNode):
        found = _LOOP.fullmatch(value.text) if value.plain else None
        return _loop(node, value, found) if found else None
    return None


def _then(node: MappingNode, value: ScalarNode, found: re.Match[str]) -> Repair[TreeNode]:
    """Return the step with `then`, whose own text needs no further finding."""
    written = value.text[: found.start()].rstrip()
    word = inner_span(value, found.start(), len(value.text))
    first, *others = _ELSE.split(value.text[found.end() :], maxsplit=1)
    step = plain(first.strip() or "STEP", _LONGEST)
    other = f", and 'else: {plain(others[0].strip(), _LONGEST)}' below that" if others else ""
    message = "'then' needs a line of its own"
    finding = codes.WRONG_SHAPE.at(value.span, message, help=f"write 'then: {_as_step(step)}' below 'if'{other}")
    condition = replace(value, text=written, span=inner_span(value, 0, len(written)))
    added = {
        "then": Entry(ScalarNode("then", word), MappingNode({"": Entry(placeholder(word), placeholder(word))}, word))
    }
    return Repair(_with(node, "if", condition, added), (finding,))


def _loop(node: MappingNode, value: ScalarNode, found: re.Match[str]) -> Repair[TreeNode]:
    """Return the loop with its condition in a key of its own."""
    condition = plain(found["condition"], _LONGEST)
    until = f"not ({condition})" if found["word"] == "while" else condition
    message = f"'repeat' takes a number or 'forever', not '{found['word']}'"
    help_text = f"write 'repeat: forever', and below it 'until: {until}'"
    finding = codes.WRONG_SHAPE.at(value.span, message, help=help_text)
    span = inner_span(value, found.start("condition"), len(value.text))
    added = {"until": Entry(ScalarNode("until", span), ScalarNode(found["condition"], span))}
    return Repair(_with(node, "repeat", replace(value, text="forever"), added), (finding,))


def _with(node: MappingNode, key: str, value: ScalarNode, added: dict[str, Entry]) -> MappingNode:
    """Return a step with another value for a key, and with those of `added` that it does not have."""
    entries = {**added, **node.entries, key: Entry(node.entries[key].key, value)}
    return MappingNode(entries, node.span)


def _as_step(written: str) -> str:
    """Return a step as it is written: `go_to dock` is `{go_to: dock}`."""
    word, _, argument = written.partition(" ")
    return f"{{{word.rstrip(':')}: {argument}}}" if argument else written


_COUNTS = ("times", "count", "rounds", "n")
_BODIES = ("do", "steps", "sequence", "body")
_IN = re.compile(r"(?P<item>[a-z]\w*)\s+in\s+(?P<list>\S.*)", re.DOTALL)


@slip(Takes.STEP, after=(misspelt_kind,), before=(foreign_keys,))
def settings_of_a_loop(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise the settings of a loop below its word, or behind it."""
    if not isinstance(node, MappingNode) or (kind := place.words.kind_of(node)) not in ("repeat", "for"):
        return None
    value = node.entries[kind].value
    if kind == "repeat" and isinstance(value, MappingNode):
        return _lifted(node, value)
    found = _IN.fullmatch(value.text) if isinstance(value, ScalarNode) and value.plain and kind == "for" else None
    return _split(node, value, found) if found and isinstance(value, ScalarNode) and "in" not in node else None


def _lifted(node: MappingNode, below: MappingNode) -> Repair[TreeNode] | None:
    """Return the loop with its settings beside its word."""
    key = node.entries["repeat"].key
    count = next((candidate for candidate in _COUNTS if candidate in below), "")
    body = next((candidate for candidate in _BODIES if candidate in below), "")
    if not body or "do" in node:
        return None
    rounds = below.entries[count].value if count else ScalarNode("forever", key.span)
    shown = plain(rounds.text, _LONGEST) if isinstance(rounds, ScalarNode) else "..."
    help_text = (
        f"write 'repeat: {shown}', and the other keys below it, in the column of 'repeat', with 'do' for the steps"
    )
    finding = codes.WRONG_SHAPE.at(key.span, "the settings of 'repeat' are below it", help=help_text)
    others = {name: entry for name, entry in below.entries.items() if name not in (count, body)}
    made = {"repeat": Entry(key, rounds), "do": replace(below.entries[body], key=ScalarNode("do", key.span))}
    return Repair(replace(node, entries={**made, **others, **_but(node, "repeat")}), (finding,))


def _split(node: MappingNode, value: ScalarNode, found: re.Match[str]) -> Repair[TreeNode]:
    """Return the loop with its list in a key of its own, which needs no further finding."""
    item, items = found["item"], plain(found["list"], _LONGEST)
    help_text = f"write 'for: {item}', and below it 'in: {items}'"
    finding: Finding = codes.WRONG_SHAPE.at(value.span, "'in' needs a line of its own", help=help_text)
    span = inner_span(value, found.start("list"), len(value.text))
    words = [part.strip() for part in found["list"].strip("[] ").split(",")]
    listed = SequenceNode(tuple(ScalarNode(word, span) for word in words), span)
    made = {
        "for": Entry(node.entries["for"].key, replace(value, text=item)),
        "in": Entry(ScalarNode("in", span), listed),
    }
    return Repair(replace(node, entries={**made, **_but(node, "for")}), (finding,))


def _but(node: MappingNode, word: str) -> dict[str, Entry]:
    return {name: entry for name, entry in node.entries.items() if name != word}


_KEYS = (*DEEDS, *OPTIONS)
_CURES: Mapping[str, str] = {
    "on_start": "write it as a step of its own before this one",
    "on_success": "write it as a step of its own after this one",
    "on_failure": "write a 'fallback' with this step first and '{}' second",
    "on_halt": "only 'set', 'log' and 'publish' can be done when a step is stopped",
    "on_enter": "make it the first step below the state's 'do'",
    "on_exit": "make it the last step below the state's 'do'",
}


@slip(Takes.HOOK)
def steps_below_a_hook(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise words of steps on the line of a hook or below it; the other keys there are read."""
    if isinstance(node, ScalarNode):
        word = node.text.partition(" ")[0] if node.plain else ""
        if not is_step(word, place.words):
            return None
        return Repair(placeholder(node.span), (_cannot_do(place.key.text, ScalarNode(word, node.span)),))
    steps = [name for name in node.entries if is_step(name, place.words)] if isinstance(node, MappingNode) else []
    if not steps or not isinstance(node, MappingNode):
        return None
    findings = tuple(_cannot_do(place.key.text, node.entries[name].key) for name in steps)
    left = {name: entry for name, entry in node.entries.items() if not is_step(name, place.words)}
    return Repair(MappingNode(left, node.span) if left else placeholder(node.span), findings)


def is_step(word: str, words: Words) -> bool:
    """Return whether a word below a hook is a step; if the robot's skills are unknown, any unknown word may be."""
    if word in _KEYS or not word:
        return False
    return words.is_step(word) if words.skills else word in words.kinds or not nearest(word, _KEYS)


def _cannot_do(hook: str, word: ScalarNode) -> Finding:
    message = f"'{hook}' cannot do steps such as '{word.text}'"
    return codes.UNKNOWN_KEY.at(word.span, message, help=_CURES.get(hook, "{}").format(word.text))


@slip(Takes.HOOK, before=(steps_below_a_hook,))
def dashes_below_a_hook(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise a list of maps; if it contains only steps, its dashes are not the mistake."""
    hook = place.key.text
    items = node.items if isinstance(node, SequenceNode) else ()
    maps = [item for item in items if isinstance(item, MappingNode) and item.entries]
    if not maps or len(maps) < len(items):
        return None
    entries: dict[str, Entry] = {}
    edits: list[Edit] = []
    for item in maps:
        first = next(iter(item.entries.values())).key.span
        dash = first._replace(column=first.column - len(_DASH), end_line=first.line, end_column=first.column)
        edits.append(Edit(dash, _DASH, " " * len(_DASH)))
        for name, entry in item.entries.items():
            entries.setdefault(name, entry)
    meant = MappingNode(entries, node.span)
    if all(is_step(name, place.words) for name in entries):
        return Repair(meant, ())
    is_once = len(entries) == sum(len(item.entries) for item in maps)
    word = next(iter(maps[0].entries))
    what = f"the dash before '{word}'" if len(maps) == 1 else "the dashes"
    help_text = f"remove {what}" + ("" if is_once else "; each word can be used there once")
    fix = Fix(tuple(edits), True, f"'- {word}' -> '{word}'") if is_once else None
    message = f"the entries below '{hook}' have no dashes"
    return Repair(meant, (codes.WRONG_SHAPE.at(edits[0].span, message, help=help_text, fix=fix),))
