"""The reference of Robot, Part and Overlay: every section with its keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_type_hints

from docs.generating.markdown import about, code, example, lowered, page
from docs.generating.sections import OVERLAY, PART
from docs.generating.shapes import keys_table
from rbxcompose.base.config import Config
from rbxcompose.compiler.sections.components import components
from rbxcompose.compiler.sections.composition import profiles
from rbxcompose.manifest import section as files
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.registry import file_model, sections
from rbxcompose.manifest.section import ComponentOptions, Section

COMPONENTS = "\nEach type also has settings of its own: see [components](components.md).\n"
PROFILES = "Each profile has the sections of a robot except `profiles`, and is laid over the robot.\n"


def whole_page() -> str:
    """Return the page."""
    return page(
        "Robot, Part, Overlay",
        f"## First keys\nEvery manifest begins with them.\n\n{keys_table(ManifestHeader)}",
        *(section(one) for one in sections()),
        f"## A part\n{about(file_model(files.PART))}\n\n{example(PART, 'yaml')}",
        f"## An overlay\n{about(file_model(files.OVERLAY))}\n\n{example(OVERLAY, 'yaml')}",
    )


def section(one: Section[Any, Any]) -> str:
    """Return what is known of a section: where it may stand, what it is, its keys, an example."""
    words = f"## {code(one.name)}\n{one.doc} *In a file of the kind {', '.join(one.files)}.*\n"
    return "\n".join([words, *keys_of(one), example(one.example, "yaml robot")])


def keys_of(one: Section[Any, Any]) -> Iterator[str]:
    """Give the tables of a section: of an entry, and of what stands in it."""
    if one is components:
        yield f"What an entry of any type takes, beside its `type`:\n\n{keys_table(ComponentOptions)}{COMPONENTS}"
    elif one is profiles:
        yield PROFILES
    else:
        yield from tables(one.type, "An entry" if one.is_map else "")


def tables(hint: object, whose: str) -> Iterator[str]:
    """Give a table for every model in an annotation, then those of the models in its fields."""
    for of, model in models_below(hint, whose):
        yield (f"{of}: {lowered(about(model))}\n\n" if of else "") + keys_table(model)


def models_below(
    hint: object, whose: str, above: frozenset[type[Config]] = frozenset()
) -> Iterator[tuple[str, type[Config]]]:
    """Give every model in an annotation and in the fields of those, with what has it; not again what contains it."""
    for model in models_in(hint):
        if model in above:
            continue
        yield whose, model
        for key, inner in get_type_hints(model, include_extras=True).items():
            if key in model.model_fields:
                yield from models_below(inner, f"In {code(key)}", above | {model})


def models_in(hint: object) -> Iterator[type[Config]]:
    """Give the models that an annotation names."""
    if isinstance(hint, type) and issubclass(hint, Config):
        yield hint
    for inner in get_args(hint):
        yield from models_in(inner)
