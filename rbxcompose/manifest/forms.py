"""What to write where a value has another form than its key takes."""

from __future__ import annotations

from typing import Any

from rbxcompose.config import Secret
from rbxcompose.manifest.key_help import about_key
from rbxcompose.manifest.requirements import EXPECTED
from rbxcompose.manifest.shapes import models_at
from rbxcompose.manifest.tree import KeyPath, ScalarNode, SequenceNode, TreeNode
from rbxcompose.printable import plain
from rbxcompose.units import NUMBER, UnitError, parse_quantity

_NOTHING = ("", "~", "null", "Null", "NULL")  # as YAML writes it


def help_of_form(model: Any, loc: KeyPath, value: TreeNode | None, error: str) -> str:
    """Return the help for a value at `loc` below `model` that pydantic refuses with this error; nothing for most."""
    if EXPECTED.get(error) == EXPECTED["model_type"] and isinstance(value, SequenceNode):
        return _as_map(model, loc, value) or (_with_keys(model, loc) if loc else "")
    if EXPECTED.get(error) == EXPECTED["model_type"] and loc and not _is_empty(value):
        return _with_keys(model, loc)
    if EXPECTED.get(error) == EXPECTED["model_type"] and _is_empty(value):
        name = f"'{loc[-1]}: !remove'" if loc else "'!remove' behind the colon"
        return f"write its keys below it; in a profile or an overlay, {name} removes it"
    if not isinstance(value, ScalarNode) or not loc:
        return ""
    if isinstance(value.filled, Secret):
        return "a secret may stand only in settings that hide it; what is not secret is '${env.NAME}', or written here"
    return _without_unit(model, loc, value) if error.startswith("int_") else ""


def _is_empty(value: TreeNode | None) -> bool:
    """Return whether nothing is written there."""
    return isinstance(value, ScalarNode) and value.plain and value.text in _NOTHING


def _with_keys(model: Any, loc: KeyPath) -> str:
    """Return what a map with the keys looks like that it needs; nothing if it needs none, or there are several."""
    models = models_at(model, loc)
    fields = models[0].model_fields.items() if len(models) == 1 else ()
    needed = ", ".join(f"{one.alias or name}: ..." for name, one in fields if one.is_required())
    return f"write '{loc[-1]}: {{{needed}}}'" if needed else ""


def _as_map(model: Any, loc: KeyPath, value: SequenceNode) -> str:
    """Return a list of values as a map, in the order of the keys; nothing if there may be other keys."""
    models, words = models_at(model, loc), [one.text for one in value.items if isinstance(one, ScalarNode)]
    names = list(models[0].model_fields) if len(models) == 1 else []
    if not words or len(words) != len(value.items) or len(words) > len(names):
        return ""
    shown = plain(", ".join(f"{name}: {word}" for name, word in zip(names, words, strict=False)), 200)
    return f"write each value with its key: '{{{shown}}}'"


def _without_unit(model: Any, loc: KeyPath, value: ScalarNode) -> str:
    """Return what a number without a unit counts, if one with a unit is written."""
    try:
        if parse_quantity(value.text).dimension == NUMBER:
            return ""
    except UnitError:
        return ""
    return f"write a number without a unit{about_key(model, loc)}"
