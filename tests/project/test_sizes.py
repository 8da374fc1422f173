"""Functions stay small enough to be read at once."""

from __future__ import annotations

import ast
import statistics
from pathlib import Path

ROOT = Path(__file__).parents[2]
GENERATED = {"msgs"}  # written by a program


def sources() -> list[Path]:
    package = [path for path in (ROOT / "rbxcompose").rglob("*.py") if path.parts[-2] not in GENERATED]
    return [*package, *(ROOT / "tests").rglob("*.py")]


def test_no_function_is_longer_than_60_lines_and_most_are_short() -> None:
    lengths = {
        f"{path.name}:{node.lineno}": (node.end_lineno or 0) - node.lineno + 1
        for path in sources()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    assert {place: length for place, length in lengths.items() if length > 60} == {}
    assert statistics.median(lengths.values()) <= 8
