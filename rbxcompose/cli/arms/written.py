"""Texts on the command line as data: goals of arms."""

from __future__ import annotations

from typing import TypeVar

from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.findings import Report, kind
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import validate

NO_MOTION = kind("RBX2310")
_SHOWN = "GOAL"  # name of a text on the command line in findings
T = TypeVar("T")


def read_written(model: type[T], text: str) -> T:
    """Return a text on the command line as data.

    Raises:
        NotDoneError: if it cannot be read.
    """
    root, findings = read_text(text, _SHOWN)
    report = Report()
    report.extend(findings)
    read = validate(model, root, (), report) if isinstance(root, MappingNode) and not findings else None
    if read is None:
        first = next(iter(report), None)
        raise NotDoneError(NO_MOTION.at(None, first.message if first else f"'{text}' is no map"))
    return read


def keys_of(text: str) -> frozenset[str]:
    """Return the keys of a map on the command line; none if it is something else."""
    root, _ = read_text(text, _SHOWN)
    return frozenset(root.entries) if isinstance(root, MappingNode) else frozenset()
