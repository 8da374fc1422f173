"""One manifest as an editor sees it: its text, its kind, the robot that it belongs to."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.dataclass import dataclass
from rbxcompose.lsp.cursor import Cursor, locate
from rbxcompose.lsp.names import KnownNames
from rbxcompose.lsp.project import MISSION, OVERLAY, kind_of
from rbxcompose.model.robot import Robot
from rbxcompose.schema.documents import MAKERS, schema_for
from rbxcompose.schema.guide import Guide

DEFAULT_KIND = "Robot"  # unless the text names another


@dataclass(frozen=True, slots=True)
class Document:
    """A text, its file, and the robot that it is part of (as last read successfully), if there is one."""

    path: Path
    text: str
    robot: Robot | None = None

    @property
    def kind(self) -> str:
        """Return the kind of manifest, if it has a schema; an unknown one is treated as a robot."""
        written = kind_of(self.text)
        return written if written in MAKERS else DEFAULT_KIND

    @property
    def is_mission(self) -> bool:
        """Return whether names are looked up while the robot runs."""
        return self.kind == MISSION

    @property
    def is_overlay(self) -> bool:
        """Return whether its sections change those of a robot."""
        return self.kind == OVERLAY

    def at(self, line: int, column: int) -> Spot | None:
        """Return what is at a position (from 0), None if nothing is known about it."""
        cursor = locate(self.text, line, column)
        if cursor is None:
            return None
        known = KnownNames(self.path, cursor.root, self.robot)
        return Spot(self, cursor, known, Guide(schema_for(self.kind, known.skills), cursor.root, known.types))


@dataclass(frozen=True, slots=True)
class Spot:
    """A position in a document, with all that determines what belongs there."""

    document: Document
    cursor: Cursor
    known: KnownNames
    guide: Guide
