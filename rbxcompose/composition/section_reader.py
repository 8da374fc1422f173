"""Read the sections of a composed robot one by one: an error in one entry hides nothing in the others."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rbxcompose.composition.robot_manifest import RobotManifest
from rbxcompose.config import Secret
from rbxcompose.findings import Finding, Related, kind
from rbxcompose.manifest.documents import Documents
from rbxcompose.manifest.fill import SHOWN_SECRET
from rbxcompose.manifest.header import ManifestHeader
from rbxcompose.manifest.registry import broken_sections, naming, sections
from rbxcompose.manifest.section import ROBOT, Contents, Section
from rbxcompose.manifest.tree import MappingNode, ScalarNode, at, key_span
from rbxcompose.references import COMPONENT

TAKEN_NAME = kind("RBX1007")
ALWAYS_THERE = ("transforms", "mission")
"""Components that every robot runs, beside `diagnostics`."""

RESERVED = ("buses", "actuators", "joints", "controllers", "safety", "devices", "console", "security", "record")
"""Names of sections that are reserved for later."""


def read_sections(
    root: MappingNode, file: Path, sim: bool, documents: Documents, *, is_whole: bool = True
) -> RobotManifest:
    """Return the robot that a composed and filled tree describes, with what could be read of entries with mistakes.

    The tree is not whole if one of the robot's parts could not be read.
    """
    documents.report.extend([*broken_sections(), *_shown_secrets(root)])
    contents = Contents(root, file, documents, sections(), is_simulated=sim, is_whole=is_whole)
    documents.report.extend(_taken_names(contents))
    for section in sections(ROBOT):
        if section.is_composed:
            contents.of(section)
    return RobotManifest(
        name=_text(root, "name"), about=_text(root, "about"), path=file, root=root, is_simulated=sim, contents=contents
    )


def reserved_names() -> frozenset[str]:
    """Return the names of present and future sections of a robot's file."""
    return frozenset((*RESERVED, *(one.name for one in sections(ROBOT))))


def _text(root: MappingNode, key: str) -> str:
    value = root.get(key)
    return value.text if isinstance(value, ScalarNode) else ""


def _shown_secrets(root: MappingNode) -> Iterator[Finding]:
    """Yield a finding for each secret in the header; the header was checked before anything was filled in."""
    for key in ManifestHeader.model_fields:
        value = root.get(key)
        if isinstance(value, ScalarNode) and isinstance(value.filled, Secret):
            yield SHOWN_SECRET.at(value.span, f"'{key}' cannot hold a secret: everybody sees it")


def _taken_names(contents: Contents) -> Iterator[Finding]:
    """Yield a finding for each name of something that runs that is already taken."""
    root = contents.root
    running = list(naming(COMPONENT))
    for index, section in enumerate(running):
        for name in () if section.has_topics else _placed_names(contents, section):
            span = key_span(root, (section.name, *section.at, name))
            if message := _own_name(name, section):
                yield TAKEN_NAME.at(span, message)
            elif found := _other_owner(root, name, section, running[index + 1 :]):
                message, label, other = found
                yield TAKEN_NAME.at(span, message, related=[Related(key_span(root, other), label)])


def _placed_names(contents: Contents, section: Section[Any, Any]) -> Iterator[str]:
    """Yield the names in a section, but not those of sections that were indented too far."""
    named = at(contents.root, (section.name, *section.at))
    for name, entry in named.entries.items() if isinstance(named, MappingNode) else ():
        if not contents.is_misplaced(section, entry):
            yield name


def _own_name(name: str, section: Section[Any, Any]) -> str:
    """Return why a user must not use a name, or nothing."""
    if name in reserved_names():
        return f"a {section.entry} cannot be named like the section '{name}'"
    return f"every robot already runs a component '{name}'" if name in ALWAYS_THERE else ""


def _other_owner(
    root: MappingNode, name: str, section: Section[Any, Any], others: list[Section[Any, Any]]
) -> tuple[str, str, tuple[str, ...]] | None:
    """Return the other owner of a name: a message, a label, and its path."""
    for one in sections(ROBOT):
        if name in one.brings and one.name in root:
            return f"the {one.name} already brings a component '{name}'", f"the {one.name}", (one.name,)
    for one in others:
        if name in one.names_in(root):
            words = f"a {section.entry} and a {one.entry} are both named '{name}'"
            return words, f"the {one.entry}", (one.name, *map(str, one.at), name)
    return None
