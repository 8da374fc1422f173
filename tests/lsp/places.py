"""Positions in the manifests of the project, told by the text around them."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.tools.lsp.answers import define, describe
from rbxcompose.tools.lsp.completion import CompletionItem, complete
from rbxcompose.tools.lsp.document import Document
from rbxcompose.tools.lsp.project import Project
from tests.conftest import ROOT

ROBOT = ROOT / "robots/turtlebot/robot.yaml"
TWINS = ROOT / "robots/twins/robot.yaml"
HEAD = ROOT / "robots/head_only/robot.yaml"
LOOK = ROOT / "missions/look_around.yaml"
PATROL = ROOT / "missions/patrol.yaml"
TRIAL = ROOT / "missions/tests/patrol.test.yaml"
BATTERY = ROOT / "parts/battery.yaml"


class Editor:
    """Asks the core about a file of the project, with changed text where a test says so."""

    def __init__(self, *robots: Path) -> None:
        self.project = Project({})
        for path in robots:
            self.project.change(path, path.read_text(encoding="utf-8"))

    def complete(self, path: Path, old: str, new: str) -> list[CompletionItem]:
        """Return what is proposed behind `new`, which was typed in the place of `old`."""
        document, line, column = self._behind(path, old, new)
        return complete(document, line, column)

    def labels(self, path: Path, old: str, new: str) -> list[str]:
        return [item.label for item in self.complete(path, old, new)]

    def define(self, path: Path, words: str, offset: int) -> str:
        """Return the place to which the position `offset` characters into `words` leads."""
        return str(define(*self._inside(path, words, offset)))

    def hover(self, path: Path, words: str, offset: int) -> str:
        return describe(*self._inside(path, words, offset))

    def _behind(self, path: Path, old: str, new: str) -> tuple[Document, int, int]:
        text = path.read_text(encoding="utf-8")
        assert old in text
        start = text.index(old) + len(new)
        return self._at(path, text.replace(old, new, 1), start)

    def _inside(self, path: Path, words: str, offset: int) -> tuple[Document, int, int]:
        text = path.read_text(encoding="utf-8")
        return self._at(path, text, text.index(words) + offset)

    def _at(self, path: Path, text: str, offset: int) -> tuple[Document, int, int]:
        line = text.count("\n", 0, offset)
        column = offset - (text.rfind("\n", 0, offset) + 1)
        return Document(path, text, self.project.robot_of(path)), line, column


def line_of(path: Path, words: str) -> int:
    """Return the line (from 1) on which some words stand first."""
    text = path.read_text(encoding="utf-8")
    return text.count("\n", 0, text.index(words)) + 1
