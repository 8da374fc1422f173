"""The corpus of misconfigured robots."""

from __future__ import annotations

from benchmarks.measuring import Row
from tests.misconfig.corpus import figures

MEASURES = (
    "benchmarks/misconfig.py",
    "rbxcompose/manifest",
    "rbxcompose/missions",
    "rbxcompose/compiler",
    "rbxcompose/domains",
)


def rows() -> list[Row]:
    """Return how much of the corpus `check` catches, and its false alarms."""
    found = figures()
    return [
        Row(
            name="misconfigurations caught at the right line",
            unit="%",
            how=f"{found.caught} of {found.wrong}, in {found.kinds_caught} of {found.kinds} kinds",
            ours=100 * found.caught / found.wrong,
            least=90,
        ),
        Row(
            name="false alarms",
            unit="",
            how=f"in {found.right} unusual but right robots",
            ours=found.false_alarms,
            most=0,
        ),
    ]
