"""How a skill or a call ended, as its server tells it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rbxcompose.expressions.values import Value


@dataclass(frozen=True, slots=True)
class Result:
    """Success or not, with an outcome of the skill's own if it told one, a reason, and what it found out."""

    success: bool
    message: str = ""
    outcome: str = ""
    values: Mapping[str, Value] = field(default_factory=dict)
