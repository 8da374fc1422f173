"""Keys beside a step that are none of its settings: words of other languages, and settings of other steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rbxcompose.findings import DID_YOU_MEAN, Finding, nearest
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words, without_word
from rbxcompose.missions.slips import slip
from rbxcompose.slips import Repair
from rbxcompose.units import UnitError, parse_quantity

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
