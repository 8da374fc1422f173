"""Imports of texts and files, as `import` does them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from rbxcompose.base.findings import Report
from rbxcompose.commands.formats.text import render_text
from rbxcompose.commands.importing.foreign_files import read_files
from rbxcompose.commands.importing.importer import imported
from rbxcompose.manifest.reader import read_text

EXAMPLES = Path(__file__).parent
FILES = EXAMPLES / "arbotix"


@dataclass(frozen=True, slots=True)
class Imported:
    """What became of some files."""

    text: str
    report: Report
    sources: dict[str, str]
    beside: Mapping[str, str] = field(default_factory=dict)

    @property
    def told(self) -> list[tuple[str, int]]:
        """The codes of the findings with their lines, by place."""
        return [(finding.code, finding.span.line if finding.span else 0) for finding in self.report]

    @property
    def words(self) -> str:
        """The findings as a person reads them."""
        return render_text(self.report, self.sources)

    @property
    def data(self) -> dict[str, Any]:
        """The manifest as plain data; it has no mistake of YAML."""
        assert read_text(self.text, "made.yaml")[1] == []
        found = yaml.safe_load(self.text)
        assert isinstance(found, dict)
        return found


def import_files(paths: Sequence[Path], name: str = "tried", program: str = "arbotix") -> Imported:
    report, sources = Report(), dict[str, str]()
    made = imported(program, read_files(paths, report, sources), name, report)
    return Imported(made.text, report, sources, made.beside)


def import_texts(folder: Path, *texts: str, program: str = "arbotix") -> Imported:
    paths = [folder / f"file_{number}.yaml" for number, _ in enumerate(texts, 1)]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text, encoding="utf-8")
    return import_files(paths, program=program)
