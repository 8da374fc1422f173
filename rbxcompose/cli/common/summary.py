"""The few lines at the end of a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from rbxcompose.plain import plain


def summary(robot: str, reason: str, time: float, facts: Mapping[str, Mapping[str, str]]) -> str:
    """Return how the run of `robot` ended: the reason, robot time [s], and facts by instance and label, aligned."""
    labels = Counter(label for some in facts.values() for label in some)
    lines = [("robot time", f"{time:.2f} s")]
    for instance in sorted(facts):
        for label, text in facts[instance].items():
            lines.append((label if labels[label] == 1 else f"{instance} {label}", text))
    width = max(len(label) for label, _ in lines)
    told = [f"  {plain(label):<{width}}  {plain(text)}" for label, text in lines]
    return "\n".join([f"{robot} is down: {plain(reason)}", *told])
