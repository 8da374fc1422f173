"""The sections of the manifest: each is one file in `sections/`, declared by one decorator, found by its name."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, TypeVar

from rbxcompose.findings import Finding
from rbxcompose.manifest.section import Reading, Section
from rbxcompose.manifest.validate import ENTRY_WORDS
from rbxcompose.plugins import LEFT_OUT, BrokenPluginError, Plugins

M = TypeVar("M")
R = TypeVar("R")

PLUGINS = Plugins("section", "rbxcompose.sections")
_EXAMPLE = "Example:"
_SECTIONS: dict[str, Section[Any, Any]] = {}


def section(name: str, model: type[M], **declared: Any) -> Callable[[Callable[[Reading[M]], R]], Section[M, R]]:
    """Declare the section `name` by the function that reads it; `declared` are further fields of `Section`.

    The docstring tells what the section is for; behind `Example:` it shows one.

    Raises:
        ValueError: if the function has no docstring, or another section has this name.
    """

    def declare(read: Callable[[Reading[M]], R]) -> Section[M, R]:
        about, _, example = (inspect.getdoc(read) or "").partition(_EXAMPLE)
        if not about:
            raise ValueError(f"the section '{name}' has no docstring, so nobody would know what it is for")
        made: Section[M, R] = Section(
            **{"shared": ((),) if declared.get("names") and "at" not in declared else (), **declared},
            name=name,
            model=model,
            doc=" ".join(about.split()),
            example=textwrap.dedent(example.lstrip("\n")),
            read=read,
        )
        register(made)
        return made

    return declare


def register(made: Section[Any, Any]) -> None:
    """Enter a section under its name.

    Raises:
        ValueError: if another one has it.
    """
    other = _SECTIONS.get(made.name)
    if other is not None and other.read.__module__ != made.read.__module__:
        raise ValueError(f"two sections are named '{made.name}': {other.read.__module__} and {made.read.__module__}")
    _SECTIONS[made.name] = made
    if made.entry:
        ENTRY_WORDS[made.name] = made.entry


def sections(kind: str = "") -> list[Section[Any, Any]]:
    """Return all sections in their order, or those that a kind of manifest may have."""
    _problems()
    found = sorted(_SECTIONS.values(), key=lambda one: (one.order, one.name))
    return [one for one in found if not kind or kind in one.files]


def section_named(name: object) -> Section[Any, Any] | None:
    """Return the section of a name, or None."""
    _problems()
    return _SECTIONS.get(str(name))


def naming(kind: str) -> Iterator[Section[Any, Any]]:
    """Yield the sections whose keys are names of a kind."""
    return (one for one in sections() if kind in one.kinds)


def broken_sections() -> list[Finding]:
    """Return what to tell of sections of other packages that are left out."""
    return [LEFT_OUT.at(None, told) for told in _problems()]


@cache
def _problems() -> tuple[str, ...]:
    """Import all sections; return why some of other packages are left out."""
    return tuple(told for name in PLUGINS.names() if (told := _problem(name)))


def _problem(name: str) -> str:
    try:
        PLUGINS.load(name)
    except BrokenPluginError as error:
        return str(error)
    return PLUGINS.overshadowed(name)
