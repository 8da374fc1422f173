"""How kinds and modifiers say what they do: templates, and the words for what is written in them."""

from __future__ import annotations

import re
from typing import Any

from rbxcompose.base.expressions.text import Template, condition_in_words, in_words, plain_name
from rbxcompose.base.expressions.tree import Expression, ExpressionError, Number
from rbxcompose.base.expressions.types import FLAG, TEXT, UNKNOWN, Type
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.language.asked import Assignment, expression_of
from rbxcompose.missions.program.answers import Deeds

_SLOT = re.compile(r"\{(\w+)(:if)?\}")


def says(template: str) -> Any:
    """Return the sentence of a kind, or of a modifier, in which `{field}` is a field in words.

    `{field:if}` is one that holds a condition, as it follows 'if'.
    """

    def sentence(declared: object, *_: object) -> str:
        def filled(slot: re.Match[str]) -> str:
            value = getattr(declared, slot[1])
            is_condition = bool(slot[2]) and isinstance(value, Expression)
            return condition_in_words(value) if is_condition else spoken(value)

        return _SLOT.sub(filled, template)

    return sentence


def spoken(value: object) -> str:
    """Return what is written in a field, in words."""
    match value:
        case Expression():
            return in_words(value)
        case Template(text=text):
            return quoted(text)
        case ScalarNode(text=text) | str(text):
            return plain_name(text)
    return str(value)


def times_in_words(count: Expression) -> str:
    """Return how often, in words: '3 times'."""
    if isinstance(count.tree, Number):
        return "once" if count.tree.value == 1 else f"{count.text} times"
    return f"as many times as {in_words(count)}"


def quoted(text: str) -> str:
    """Return a text in quotes, on one line."""
    return f"'{' '.join(text.split())}'"


def deeds_in_words(deeds: Deeds) -> str:
    """Return what is set, logged and published, in words."""
    message = f"publish on {deeds.message.target.text}" if deeds.message else ""
    log = logged_in_words(deeds.text, deeds.level) if deeds.text else ""
    return ", ".join(filter(None, (set_in_words(deeds.assignments), log, message)))


def set_in_words(assignments: tuple[Assignment, ...]) -> str:
    """Return what is set to what, in words."""
    one_by_one = [f"{spoken(one.name)} to {argument_in_words(one.asked.scalar)}" for one in assignments]
    return f"set {', '.join(one_by_one)}" if one_by_one else ""


def logged_in_words(text: Template, level: str) -> str:
    """Return what is logged, in words."""
    how = {"warn": " as a warning", "error": " as an error"}
    return f"log {spoken(text)}{how.get(level, '')}"


def argument_in_words(value: TreeNode, wanted: Type = UNKNOWN) -> str:
    """Return an argument in words: a text in quotes, else its value."""
    match value:
        case ScalarNode() if wanted == TEXT:
            return quoted(value.text)
        case ScalarNode():
            try:
                expression = expression_of(value)
            except ExpressionError:
                return quoted(value.text)
            return condition_in_words(expression) if wanted == FLAG and expression.names else in_words(expression)
        case SequenceNode(items=items):
            return ", ".join(map(argument_in_words, items))
        case MappingNode(entries=entries):
            said = (f"{plain_name(key)} {argument_in_words(one.value)}" for key, one in entries.items())
            return ", ".join(said) or "nothing"
