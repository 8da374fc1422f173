"""How many examples a random test tries: some in each run, many under `--soak`, whose figures are kept."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import pytest

RESULTS = Path(__file__).parents[1] / "docs" / "quality.json"


@dataclass(frozen=True, slots=True)
class Figure:
    """What one suite has tried: examples, and how many kinds of failure it has found."""

    suite: str
    examples: int
    failures: int
    note: str = ""


def rare(*values: Any) -> list[Any]:
    """Return values of a parameter that a test has under `--soak` alone."""
    return [pytest.param(value, marks=pytest.mark.soak) for value in values]


@dataclass(slots=True)
class Soak:
    """The choice between few and many, and what the suites tell."""

    is_on: bool
    figures: dict[str, Figure] = field(default_factory=dict)

    def examples(self, quick: int, many: int) -> int:
        """Return how many examples to try now."""
        return many if self.is_on else quick

    def tell(self, suite: str, examples: int, failures: int, note: str = "") -> None:
        """Keep the figures of a suite."""
        self.figures[suite] = Figure(suite, examples, failures, note)

    def write(self) -> None:
        """Write down the figures, beside those of suites that were not run now."""
        known = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
        rows = {row["suite"]: row for row in known} | {name: asdict(figure) for name, figure in self.figures.items()}
        RESULTS.write_text(json.dumps([rows[name] for name in sorted(rows)], indent=1) + "\n", encoding="utf-8")
