"""Statuses of mission nodes, and how a skill or a call ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Final

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import EvaluationError, NotArrivedError, Value

IDLE: Final = 0  # not started, or halted
RUNNING: Final = 1
SUCCESS: Final = 2
FAILURE: Final = 3
SKIPPED: Final = 4  # did not need to start: neither success nor failure

NAMES: Final = ("idle", "running", "success", "failure", "skipped")


@dataclass(frozen=True, slots=True)
class Result:
    """Success or failure, with the skill's own outcome if it reported one, a reason, and the result values."""

    success: bool
    message: str = ""
    outcome: str = ""
    values: Mapping[str, Value] = field(default_factory=dict)


class NodeFailed(Exception):  # noqa: N818 - it ends a node, as a failure would; it is no error of ours
    """Raised by a task whose node cannot continue; the text is the reason that is reported."""


def words(error: Exception) -> str:
    """Return an error in words for the robot's story."""
    if isinstance(error, EvaluationError | NotArrivedError | NodeFailed):
        return str(error)
    return f"{type(error).__name__}: {error}"
