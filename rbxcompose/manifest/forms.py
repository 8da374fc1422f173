"""What to write where a value has another form than its key takes."""

from __future__ import annotations

from typing import Any

from rbxcompose.manifest.requirements import EXPECTED
from rbxcompose.manifest.shapes import models_at
from rbxcompose.manifest.tree import KeyPath, ScalarNode, TreeNode
from rbxcompose.units import NUMBER, UnitError, parse_quantity


def help_of_form(model: Any, loc: KeyPath, value: TreeNode | None, error: str) -> str:
    """Return the help for a value at `loc` below `model` that pydantic refuses with this error; nothing for most."""
    if not isinstance(value, ScalarNode) or not loc:
        return ""
    if EXPECTED[error] == EXPECTED["model_type"] and value.plain and not value.text:
        return f"write its keys below it; in a profile or an overlay, '{loc[-1]}: !remove' removes it"
    return _without_unit(model, loc, value) if error.startswith("int_") else ""


def _without_unit(model: Any, loc: KeyPath, value: ScalarNode) -> str:
    """Return what a number without a unit counts, if one with a unit is written."""
    try:
        if parse_quantity(value.text).dimension == NUMBER:
            return ""
    except UnitError:
        return ""
    from rbxcompose.field_docs import field_docs  # reads source files

    docs = (field_docs(one).get(str(loc[-1]), "") for one in models_at(model, loc[:-1]))
    about = next((text.partition(";")[0].partition(". ")[0].rstrip(".") for text in docs if text), "")
    return "write a number without a unit" + (f": {about[:1].lower()}{about[1:]}" if about else "")
