"""The reference of Robot, Part and Overlay: every section with its keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_type_hints

from docs.generating.markdown import about, code, example, lowered, page
from docs.generating.sections import OVERLAY, PART, SECTIONS
from docs.generating.shapes import keys_table
from rbxcompose.config import Config
from rbxcompose.manifest.models import ComponentOptions, Header, OverlayFile, PartFile, RobotFile
from rbxcompose.schema.robot import SECTION_TYPES

FILES: dict[str, type[Config]] = {"Robot": RobotFile, "Part": PartFile, "Overlay": OverlayFile}
COMPONENTS = "\nEach type also has settings of its own: see [components](components.md).\n"
PROFILES = "Each profile has the sections of a robot except `profiles`, and is laid over the robot.\n"


def whole_page() -> str:
    """Return the page."""
    names = dict.fromkeys(name for model in FILES.values() for name in model.model_fields)
    sections = [name for name in names if name not in Header.model_fields]
    return page(
        "Robot, Part, Overlay",
        f"## First keys\nEvery manifest begins with them.\n\n{keys_table(Header)}",
        *(section(name) for name in sections),
        f"## A part\n{about(PartFile)}\n\n{example(PART, 'yaml')}",
        f"## An overlay\n{about(OverlayFile)}\n\n{example(OVERLAY, 'yaml')}",
    )


def section(name: str) -> str:
    """Return what is known of a section: where it may stand, what it is, its keys, an example."""
    fields = {kind: model.model_fields[name] for kind, model in FILES.items() if name in model.model_fields}
    what = next(iter(fields.values())).description or ""
    words = f"## {code(name)}\n{what} *In a file of the kind {', '.join(fields)}.*\n"
    return "\n".join([words, *keys_of(name), example(SECTIONS.get(name, ""), "yaml robot")])


def keys_of(name: str) -> Iterator[str]:
    """Give the tables of a section: of an entry, and of what stands in it."""
    if name == "components":
        yield f"What an entry of any type takes, beside its `type`:\n\n{keys_table(ComponentOptions)}{COMPONENTS}"
    elif name == "profiles":
        yield PROFILES
    else:
        yield from tables(SECTION_TYPES[name], "An entry" if is_map(SECTION_TYPES[name]) else "")


def tables(hint: object, whose: str) -> Iterator[str]:
    """Give a table for every model in an annotation, then those of the models in its fields."""
    for model in models_in(hint):
        words = f"{whose}: {lowered(about(model))}\n\n" if whose else ""
        yield words + keys_table(model)
        for key, inner in get_type_hints(model, include_extras=True).items():
            yield from tables(inner, f"In {code(key)}") if key in model.model_fields else ()


def models_in(hint: object) -> Iterator[type[Config]]:
    """Give the models that an annotation names."""
    if isinstance(hint, type) and issubclass(hint, Config):
        yield hint
    for inner in get_args(hint):
        yield from models_in(inner)


def is_map(hint: Any) -> bool:
    """Tell whether a section is a map from names to entries."""
    return getattr(hint, "__origin__", None) is dict
