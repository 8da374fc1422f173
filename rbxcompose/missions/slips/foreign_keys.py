"""Keys of missions, interrupts, states and `if` in the words of other languages: `transitions`, `condition`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from rbxcompose.findings import DID_YOU_MEAN, Finding, replacement
from rbxcompose.manifest.tree import Entry, MappingNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.unknown_settings import unknown_settings
from rbxcompose.slips import Repair

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
    entries = {meant.get(name, name): _named(one, meant.get(name, name)) for name, one in node.entries.items()}
    what = f"beside '{kind}'" if kind else _WHAT.get(place.takes, "")
    findings = tuple(_told(node.entries[theirs], ours, what) for theirs, ours in meant.items())
    return Repair(MappingNode(entries, node.span), findings)


def _written(node: MappingNode, ours: str, names: str) -> str:
    """Return which of the names of others is written for ours, nothing if ours is, too."""
    if ours in node or (ours == "do" and "machine" in node):
        return ""
    return next((name for name in names.split() if name in node), "")


def _named(entry: Entry, name: str) -> Entry:
    return entry if entry.key.text == name else Entry(replace(entry.key, text=name), entry.value)


def _told(entry: Entry, ours: str, what: str) -> Finding:
    theirs = entry.key.text
    fix = replacement(entry.key.span, theirs, ours, is_safe=False)  # its value may have another form
    help_text = f"{DID_YOU_MEAN} '{ours}'?"
    return codes.UNKNOWN_KEY.at(entry.key.span, f"unknown key '{theirs}' {what}", help=help_text, fix=fix)
