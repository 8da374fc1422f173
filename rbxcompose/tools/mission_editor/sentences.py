"""A mission read aloud: the sentences of `rbxcompose mission show`, each with the block of the text that it says."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from rbxcompose.base.findings import Severity
from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import with_text_of_mission
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.manifest.files import shown_name
from rbxcompose.missions.program.linker import link
from rbxcompose.missions.view.picture import Drawn, picture_of
from rbxcompose.tools.mission_editor.outline import INTERRUPTS, Block, MissionOutline


def read_aloud(robot: Robot, mission: str, path: Path, text: str) -> list[dict[str, Any]]:
    """Return the sentences of a text: the `place` of each among them, what it says, and the `path` of its block.

    That is None for what another mission says.

    Raises:
        Refused: if the text has mistakes.
    """
    changed, report, _ = with_text_of_mission(robot, mission, os.environ, {path: text})
    errors = [one for one in report if one.severity is Severity.ERROR]
    if changed is None or errors:
        raise Refused(f"it cannot be read aloud yet: {errors[0].message}" if errors else "it cannot be read aloud yet")
    program, names = changed.missions[mission].program, changed.names
    picture, linked = picture_of(program, names), link(program, names.missions)
    outline, file = MissionOutline(text), shown_name(path)

    def written(drawn: Drawn) -> Block | None:
        if drawn.number is None:
            return outline.at((INTERRUPTS, drawn.name))
        span = linked.nodes[drawn.number].span
        return outline.written_at(span.line, span.column) if span.file == file else None

    def block_of(drawn: Drawn) -> Block | None:
        block = written(drawn)
        if block is None or not drawn.children or written(drawn.children[0]) is not block:
            return block
        return outline.at(block.path[:-1])  # a list begins where its first step does

    return [
        {
            "place": drawn.place,
            "text": f"{drawn.sentence}{':' if drawn.children else ''}",
            "path": list(block.path) if (block := block_of(drawn)) is not None else None,
        }
        for root in picture.roots
        for drawn in root.all()
    ]
