"""The sections of a composed robot, one by one: a mistake in one entry hides nothing of the others."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from rbxcompose.config import Config, Name, Place, Secret
from rbxcompose.findings import Finding, Report
from rbxcompose.manifest.components import read_component
from rbxcompose.manifest.data import is_moderate
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.fill import SHOWN_SECRET
from rbxcompose.manifest.models import (
    Analyzer,
    Bus,
    ComponentEntry,
    Diagnostics,
    Mission,
    MissionEntry,
    Mux,
    PlaceModel,
    RobotManifest,
    ValueModel,
)
from rbxcompose.manifest.tree import Entry, Mapping, Node, Scalar, at, children
from rbxcompose.manifest.validate import WRONG_TYPE, is_valid, label_of, validate

C = TypeVar("C", bound=Config)


def read_sections(
    root: Mapping, file: Path, sim: bool, report: Report, files: AnyMapping[str, Path] = MappingProxyType({})
) -> RobotManifest:
    """Return the robot that a composed and filled tree describes; entries with mistakes are left out.

    `files` are all that were read, by the names that findings show: a path is relative to the one that writes it.
    """
    places = _places(root, report)
    missions = _missions(root, file, files, report)
    return RobotManifest(
        name=_text(root, "name"),
        about=_text(root, "about"),
        path=file,
        root=root,
        is_simulated=sim,
        bus=_one(Bus, root, "bus", report),
        components=_components(root, places, report),
        muxes=dict(_valid(Mux, root, ("muxes",), report)),
        diagnostics=_diagnostics(root, report),
        places=places,
        values=dict(_valid(ValueModel, root, ("values",), report)),
        missions=missions,
        start=_start(root, missions, report),
    )


def _text(root: Mapping, key: str) -> str:
    value = root.get(key)
    return value.text if isinstance(value, Scalar) else ""


def _one(model: type[C], root: Mapping, key: str, report: Report) -> C:
    """Return a section that is one map; its defaults if it is missing or wrong."""
    node = root.get(key)
    read = validate(model, node, (key,), report) if node is not None and not is_empty(node) else None
    return read if read is not None else model()


def is_empty(node: Node) -> bool:
    """Tell whether there is nothing behind the name of a section."""
    return isinstance(node, Scalar) and node.plain and not node.text


def named_entries(root: Mapping, path: tuple[str, ...], report: Report) -> Iterator[tuple[str, Entry]]:
    """Yield the entries of a section by name, after a finding for each bad name."""
    node = at(root, path)
    if node is None or is_empty(node):
        return
    if not isinstance(node, Mapping):
        message = f"'{path[-1]}' must be a map from names to what they are"
        report.add(WRONG_TYPE.at(node.span, message, label=label_of(node)))
        return
    for name, entry in node.entries.items():
        if is_valid(Name, name) or validate(Name, replace(entry.key, plain=False), (*path, name), report) is not None:
            yield name, entry


def _valid(model: Any, root: Mapping, path: tuple[str, ...], report: Report) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a section that are what `model` says."""
    for name, entry in named_entries(root, path, report):
        read = validate(model, entry.value, (*path, name), report)
        if read is not None:
            yield name, read


def _diagnostics(root: Mapping, report: Report) -> Diagnostics:
    """Return the analyzers without those that have mistakes."""
    node = root.get("diagnostics")
    if not isinstance(node, Mapping):
        return _one(Diagnostics, root, "diagnostics", report)
    others = {name: entry for name, entry in node.entries.items() if name != "analyzers"}
    validate(Diagnostics, replace(node, entries=others), ("diagnostics",), report)
    return Diagnostics(analyzers=dict(_valid(Analyzer, root, ("diagnostics", "analyzers"), report)))


def _places(root: Mapping, report: Report) -> dict[str, Place]:
    """Return all places; one with mistakes stands in the origin, so that what names it is not wrong as well."""
    places = {}
    for name, entry in named_entries(root, ("places",), report):
        read = validate(PlaceModel, entry.value, ("places", name), report) or PlaceModel(x=0.0, y=0.0)
        places[name] = Place(name, read.x, read.y, read.heading)
    return places


def _missions(root: Mapping, file: Path, files: AnyMapping[str, Path], report: Report) -> dict[str, MissionEntry]:
    missions = {}
    for name, entry in named_entries(root, ("missions",), report):
        read = validate(Mission, entry.value, ("missions", name), report)
        if read is None or not isinstance(entry.value, Mapping):
            continue
        _refuse_secrets(entry.value, report)
        if not is_moderate(entry.value.get("with"), "input", report):
            continue
        span = entry.value.entries["file"].value.span
        path = resolve(read.file, files.get(span.file, file), span)
        if isinstance(path, Finding):
            report.add(path)
            continue
        inputs = entry.value.get("with")
        missions[name] = MissionEntry(name, path, inputs if isinstance(inputs, Mapping) else Mapping(), entry.key.span)
    return missions


def _refuse_secrets(node: Node, report: Report) -> None:
    """Add a finding for each secret that would go into a mission, where it would be shown."""
    if isinstance(node, Scalar) and isinstance(node.filled, Secret):
        report.add(SHOWN_SECRET.at(node.span, "a mission cannot hold a secret: what it does is logged"))
    for _, below in children(node):
        _refuse_secrets(below, report)


def _components(root: Mapping, places: dict[str, Place], report: Report) -> dict[str, ComponentEntry]:
    components = {}
    for name, entry in named_entries(root, ("components",), report):
        if component := read_component(name, entry, root, places, report):
            components[name] = component
    return components


def _start(root: Mapping, missions: Collection[str], report: Report) -> str | None:
    """Return the name of the mission to start; None also if that mission has mistakes, which were said."""
    start, written = root.get("start"), root.get("missions")
    if start is None or is_empty(start):
        return None
    name = validate(str, start, ("start",), report)
    is_broken = isinstance(written, Mapping) and name in written and name not in missions
    return None if is_broken else name
