"""How an examination is declared and run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from rbxcompose.dataclass import dataclass
from rbxcompose.doctor.facts import HostFacts
from rbxcompose.findings import Finding, Severity
from rbxcompose.plugins import Plugins

Examine = Callable[[HostFacts], Iterable[str | Finding]]
"""Yields findings, and words on what is fine."""

PLUGINS = Plugins("doctor", "rbxcompose.doctor.examinations")
EXAMINATIONS: dict[str, Examine] = {}  # every one that has been imported, by name
FINE = "ok"


@dataclass(frozen=True, slots=True)
class ExaminationResult:
    """The result of one examination: words on what is fine, or a finding."""

    examination: str
    told: str | Finding

    @property
    def level(self) -> str:
        """Return `ok`, `warning` or `error`."""
        return FINE if isinstance(self.told, str) else self.told.severity.value

    def to_data(self) -> dict[str, Any]:
        """Return the result as data for JSON."""
        data: dict[str, Any] = {"examination": self.examination, "level": self.level}
        if isinstance(self.told, str):
            return {**data, "message": self.told}
        return {**data, "code": self.told.code, "message": self.told.message, "help": self.told.help}


def examination(examine: Examine) -> Examine:
    """Declare an examination under the name of its function.

    Raises:
        ValueError: if another one has this name.
    """
    name = getattr(examine, "__name__", "")
    if EXAMINATIONS.setdefault(name, examine) is not examine:
        raise ValueError(f"two examinations have the name {name!r}")
    return examine


def examine_all(facts: HostFacts) -> list[ExaminationResult]:
    """Run every examination, by name."""
    for name in PLUGINS.names():
        PLUGINS.load(name)
    return [ExaminationResult(name, told) for name in sorted(EXAMINATIONS) for told in EXAMINATIONS[name](facts)]


def has_errors(answers: Sequence[ExaminationResult]) -> bool:
    """Return whether anything keeps a robot from running."""
    return any(one.level == Severity.ERROR.value for one in answers)
