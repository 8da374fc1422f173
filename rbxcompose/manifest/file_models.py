"""The keys of each kind of manifest: of files with sections, of systems, and of tests of missions."""

from __future__ import annotations

from functools import cache
from typing import Any

from pydantic import Field, create_model

from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.registry import section_named, sections, sections_in_use
from rbxcompose.manifest.section import OVERLAY, PART, ROBOT
from rbxcompose.manifest.tree import MappingNode

FILES = {
    ROBOT: "A robot: its components and how they are connected.",
    PART: "A part of robots: sections of a robot with arguments of their own.",
    OVERLAY: "Changes to a robot, given by `-f FILE`.",
}


def file_model(kind: str) -> type[ManifestHeader]:
    """Return the model of a robot's, part's or overlay's file: its keys, with anything allowed in each section."""
    return _model(kind, tuple((section.name, section.doc) for section in sections(kind)))


def model_for(kind: str, root: MappingNode) -> type[ManifestHeader]:
    """Return a model that judges a file as `file_model` does; sections that it lacks count only if a key is unknown."""
    found = {name: section_named(name) for name in root.entries if name not in ManifestHeader.model_fields}
    if all(section is not None and kind in section.files for section in found.values()):
        return _model(kind, tuple((section.name, section.doc) for section in sections_in_use(kind)))
    return file_model(kind)


@cache
def _model(kind: str, sections: tuple[tuple[str, str], ...]) -> type[ManifestHeader]:
    fields: dict[str, Any] = {name: (Any, Field(None, description=doc)) for name, doc in sections}
    return create_model(f"{kind}File", __base__=ManifestHeader, __doc__=FILES[kind], **fields)


def robot_keys() -> list[str]:
    """Return the keys of a robot's file, its header's first."""
    return [*ManifestHeader.model_fields, *(section.name for section in sections(ROBOT))]
