"""The key that says what a step is: the word of a kind, the name of a skill, or what other languages call it."""

from collections.abc import Mapping
from functools import cache

from rbxcompose.manifest.tree import MappingNode, ScalarNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import BELOW, Takes, is_reported
from rbxcompose.missions.language.value_reader import Nodes
from rbxcompose.missions.modifiers.registry import modifier_keys
from rbxcompose.missions.program.registry import StepType, kinds

_OURS = {
    "fallback": "selector sel priority_selector",
    "sequence": "seq steps sequential",
    "parallel": "par simultaneously together concurrently",
    "repeat": "loop",
    "for": "foreach for_each",
    "wait": "sleep delay pause",
    "choose": "switch match case",
    "log": "print echo",
    "use": "subtree sub_tree submission include",
    "run": "exec script",
    "end": "return stop exit abort terminate",
    "wait_for": "wait_until await wait_template wait_for_trigger",
}
FOREIGN: Mapping[str, str] = {name: ours for ours, names in _OURS.items() for name in names.split()}
"""Our word for each of another mission language or of a behaviour tree."""

OUTCOMES: Mapping[str, str] = {
    **dict.fromkeys(("succeeded", "succeed", "succeeds", "done", "ok", "true"), "success"),
    **dict.fromkeys(("aborted", "failed", "fail", "fails", "error", "preempted", "canceled", "false"), "failure"),
}
"""Our outcome for each of other mission languages."""


@cache
def anywhere() -> tuple[str, ...]:
    """Return the keys that any node may have."""
    return ("name", *modifier_keys())


@cache
def keys_taking(*taken: Takes) -> frozenset[str]:
    """Return the keys of steps, states, machines and interrupts that take one of these."""
    of_kinds = (field for kind in kinds().values() for field in kind.fields.values())
    below = ((key, slot.takes) for slots in BELOW.values() for key, slot in slots.items())
    return frozenset(
        key for key, takes in (*below, *((field.key, field.takes) for field in of_kinds)) if takes in taken
    )


def _cure(step: MappingNode) -> str:
    """Return what to do with a step that has only settings, or nothing at all."""
    first = next(iter(step.entries), "")
    if not first:
        return "a step is a word such as 'sequence' or 'wait', or the name of a skill"
    value = step.entries[first].value
    shown = f" {value.text}" if isinstance(value, ScalarNode) and value.text else ""
    return f"'{first}' is a setting of a step: write '{first}:{shown}' without a dash, right below the word of its step"


def find_key(step: MappingNode, nodes: Nodes) -> tuple[str, StepType | None]:
    """Return the key of a step and its kind, None for a skill; if there is neither, an empty key, with a finding."""
    if is_reported(step):
        return "", None
    own = [key for key in step.entries if key not in anywhere()]
    key = next((key for key in own if key in kinds()), own[0] if own else "")
    if not own:
        nodes.add(codes.WRONG_SHAPE.at(step.span, "there is no step here", help=_cure(step)))
    elif not key.strip():
        nodes.add(codes.MISSING.at(step.entries[key].key.span, "a step is missing here"))
        return "", None
    return key, kinds().get(key)
