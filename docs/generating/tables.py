"""The generated tables of pages that people write, each between two comments that name it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from typing import Any

from docs.generating.extras import extras
from docs.generating.families import families
from docs.generating.markdown import about, code, lowered, table
from docs.generating.missions import takes
from docs.generating.robot import models_below
from docs.generating.shapes import with_default
from docs.generating.small_machines import small_machines
from rbxcompose.manifest.registry import sections as registered
from rbxcompose.manifest.section import Section
from rbxcompose.missions.program.registry import StepType, kinds
from rbxcompose.sdk.registry import PLUGINS, component_type
from rbxcompose.tools.behaviour_trees.nodes import table as behaviour_trees

PAGES = ("architecture.md", "dependencies.md", "how_to.md", "language.md", "missions.md", "small_machines.md")
BLOCK = re.compile(r"(<!-- made by `make docs`: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
"""Words between such comments are written by a program."""


def filled(text: str) -> str:
    """Return a page with its tables as they should be.

    Raises:
        KeyError: if it asks for a table that nobody makes.
    """
    return BLOCK.sub(lambda block: f"{block[1]}\n{TABLES[block[2]]()}\n{block[3]}", text)


def components() -> str:
    """Return the component types that stand under `components`, with their settings."""
    types = {name: component_type(name) for name in sorted(PLUGINS.shipped)}
    rows = [(name, cls, with_default(cls.config_type())) for name, cls in types.items() if not cls.made_by]
    linked = [
        (f"[{code(name)}](reference/components.md#{name})", title(cls), ", ".join(keys)) for name, cls, keys in rows
    ]
    return table(("type", "what it is", "settings (default)"), linked)


def sections() -> str:
    """Return every section of a manifest, with the keys below it that are no names."""
    rows = [(f"[{code(one.name)}](reference/robot.md#{one.name})", lowered(one.doc), keys(one)) for one in registered()]
    return table(("section", "what it is", "keys"), [(name, doc.rstrip("."), words) for name, doc, words in rows])


def keys(section: Section[Any, Any]) -> str:
    """Return the keys of a section's models, without repetition."""
    fields = (field for _, model in models_below(section.type, "") for field in model.model_fields.items())
    return ", ".join(dict.fromkeys(code(field.alias or name) for name, field in fields))


def title(documented: object) -> str:
    """Return the first paragraph of a docstring as words behind a colon."""
    return lowered(about(documented).partition("\n\n")[0]).rstrip(".")


def nodes() -> str:
    """Return every kind of mission node with its options."""
    return table(("kind", "takes", "options", "what it does"), map(of_node, kinds().values()))


def of_node(kind: StepType) -> tuple[str, str, str, str]:
    """Return the row of a kind."""
    options = [f"{code(option.key)}: {takes(option)}" for option in kind.options()]
    return linked(kind), takes(kind.fields[kind.name]), "; ".join(options), about(kind).partition("\n\n")[0]


def steps() -> str:
    """Return every kind of mission node in a few words."""
    rows = [(linked(kind), few_words(kind)) for kind in kinds().values()]
    return table(("step", "what it does"), rows)


def linked(kind: StepType) -> str:
    """Return the name of a kind, which leads to its reference."""
    return f"[{code(kind.name)}](reference/missions.md#{kind.name})"


def few_words(kind: StepType) -> str:
    """Return what the docstring of a kind's file says of it."""
    lines = (inspect.getdoc(inspect.getmodule(kind)) or "").splitlines()
    said = dict(line.partition(": ")[::2] for line in lines)
    return said[code(kind.name)].rstrip(".")


TABLES: Mapping[str, Callable[[], str]] = {
    "behaviour_trees": behaviour_trees,
    "components": components,
    "extras": extras,
    "families": families,
    "nodes": nodes,
    "sections": sections,
    "small_machines": small_machines,
    "steps": steps,
}
