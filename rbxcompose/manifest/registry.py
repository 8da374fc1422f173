"""The sections of the manifest: each is declared by one decorator in a file of `sections/`.

In a domain, that file has the name of the section; those that belong to no domain stand together by subject.
"""

import inspect
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import cache
from typing import Any, ParamSpec, TypeVar

from pydantic import Field, create_model

from rbxcompose.base.findings import Finding
from rbxcompose.base.plugins import LEFT_OUT, Plugins, domain_of, package_of
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT, Declaration, Reading, Section
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import ENTRY_WORDS

M = TypeVar("M")
R = TypeVar("R")
P = ParamSpec("P")
PLUGINS = Plugins("section", "sections")
_EXAMPLE = "Example:"
_SECTIONS: dict[str, Section[Any, Any]] = {}


def _decorator(
    declaration: Callable[P, Declaration[M]],
) -> Callable[P, Callable[[Callable[[Reading[M]], R]], Section[M, R]]]:
    """Return a decorator with the parameters of `declaration`."""

    def section(*args: P.args, **keywords: P.kwargs) -> Callable[[Callable[[Reading[M]], R]], Section[M, R]]:
        return lambda read: _declared(declaration(*args, **keywords), read)

    return section


section = _decorator(Declaration)
"""Declare a section by the function that reads it: `@section("places", PlaceModel, names=PLACE)`.

The docstring tells what the section is for; behind `Example:` it shows one. A ValueError is raised if there is no
docstring, or another section has this name.
"""


def _declared(declaration: Declaration[M], read: Callable[[Reading[M]], R]) -> Section[M, R]:
    about, _, example = (inspect.getdoc(read) or "").partition(_EXAMPLE)
    if not about:
        raise ValueError(f"the section '{declaration.name}' has no docstring, so nobody would know what it is for")
    traits: dict[str, Any] = {field.name: getattr(declaration, field.name) for field in fields(declaration)}
    about, example = " ".join(about.split()), textwrap.dedent(example.lstrip("\n"))
    made: Section[M, R] = Section(**traits, doc=about, example=example, read=read)
    register(made)
    return made


def register(made: Section[Any, Any]) -> None:
    """Register a section under its name.

    Raises:
        ValueError: if another section has this name.
    """
    other = _SECTIONS.get(made.name)
    if other is not None and other.read.__module__ != made.read.__module__:
        raise ValueError(f"two sections are named '{made.name}': {other.read.__module__} and {made.read.__module__}")
    ordered = sorted([*_SECTIONS.values(), made], key=lambda one: (one.order, one.name))
    _SECTIONS.clear()
    _SECTIONS.update({one.name: one for one in ordered})
    if made.entry and not made.at:
        ENTRY_WORDS[made.name] = made.entry


def sections(kind: str = "") -> list[Section[Any, Any]]:
    """Import all sections and return them in their order, or those that a kind of manifest may have."""
    _problems()
    PLUGINS.load_shipped()
    return _of_kind(kind)


def sections_in_use(kind: str = "") -> list[Section[Any, Any]]:
    """Return those of `sections` that count for the files read so far: none of a domain of which they have no section.

    A domain's sections are imported together, when `section_named` is first asked for one of them: as it is for each
    key of a file. Those of a domain that says `IN_EVERY_ROBOT` always count.
    """
    _problems()
    _load_common()
    return _of_kind(kind)


def _of_kind(kind: str) -> list[Section[Any, Any]]:
    return [one for one in _SECTIONS.values() if not kind or kind in one.files]


def section_named(name: object) -> Section[Any, Any] | None:
    """Return the section of this name, or None."""
    _problems()
    _load_common()
    if name in PLUGINS.shipped:
        _load_domain(domain_of(PLUGINS.shipped[str(name)]))
    return _SECTIONS.get(str(name))


@cache
def _load_common() -> None:
    for domain in dict.fromkeys(map(domain_of, PLUGINS.shipped.values())):
        if not domain or getattr(package_of(domain), "IN_EVERY_ROBOT", False):
            _load_domain(domain)


@cache
def _load_domain(domain: str) -> None:
    """Import the sections of a domain, or those that belong to none."""
    for name, module in PLUGINS.shipped.items():
        if domain_of(module) == domain:
            PLUGINS.load(name)


def _is_ours(name: str) -> bool:
    """Return whether a section of this name is one of rbxcompose."""
    _load_domain("")
    if name in _SECTIONS:
        return _SECTIONS[name].read.__module__.startswith("rbxcompose.")
    return bool(domain_of(PLUGINS.shipped.get(name, "")))


def naming(kind: str) -> Iterator[Section[Any, Any]]:
    """Yield the sections whose keys are names of a kind."""
    return (one for one in sections() if one.has_names_of(kind))


def naming_in_use(kind: str) -> list[Section[Any, Any]]:
    """Return those of `naming` that are in use."""
    return [one for one in sections_in_use() if one.has_names_of(kind)]


def broken_sections() -> list[Finding]:
    """Return a finding for each section of another package that is left out."""
    return [LEFT_OUT.at(None, problem) for problem in _problems()]


@cache
def _problems() -> tuple[str, ...]:
    """Import the sections of other packages; return why some are left out."""
    return tuple(problem for name in sorted(PLUGINS.third_party) if (problem := _problem(name)))


def _problem(name: str) -> str:
    return PLUGINS.left_out(name) if _is_ours(name) else PLUGINS.problem(name)


FILES = {
    ROBOT: "A robot: its components and how they are connected.",
    PART: "A part of robots: sections of a robot with arguments of their own.",
    OVERLAY: "Changes to a robot, given by `-f FILE`.",
}


def file_model(kind: str) -> type[ManifestHeader]:
    """Return the model of a robot's, part's or overlay's file: its keys, with anything allowed in each section."""
    return _file_model(kind, tuple((section.name, section.doc) for section in sections(kind)))


def model_for(kind: str, root: MappingNode) -> type[ManifestHeader]:
    """Return a model that judges a file as `file_model` does; sections that it lacks count only if a key is unknown."""
    found = [section_named(name) for name in root.entries if name not in ManifestHeader.model_fields]
    if all(section is not None and kind in section.files for section in found):
        return _file_model(kind, tuple((section.name, section.doc) for section in sections_in_use(kind)))
    return file_model(kind)


@cache
def _file_model(kind: str, sections: tuple[tuple[str, str], ...]) -> type[ManifestHeader]:
    fields: dict[str, Any] = {name: (Any, Field(None, description=doc)) for name, doc in sections}
    return create_model(f"{kind}File", __base__=ManifestHeader, __doc__=FILES[kind], **fields)


def robot_keys() -> list[str]:
    """Return the keys of a robot's file, its header's first."""
    return [*ManifestHeader.model_fields, *(section.name for section in sections(ROBOT))]
