"""How something ended, and how it may end: statuses of nodes, results of skills, and outcomes of their own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
SUCCEEDS, FAILS = NAMES[SUCCESS], NAMES[FAILURE]


@dataclass(frozen=True, slots=True)
class Result:
    """Success or failure, with the skill's own outcome if it reported one, a reason, and the result values."""

    success: bool
    message: str = ""
    outcome: str = ""
    values: Mapping[str, Value] = field(default_factory=dict)


class NodeFailed(Exception):  # noqa: N818 - it ends a node, as a failure would; it is no error of ours
    """Raised by a task whose node cannot continue; the text is the reason that is reported."""


def words(error: BaseException) -> str:
    """Return an error in words for the robot's story."""
    if isinstance(error, EvaluationError | NotArrivedError | NodeFailed):
        return str(error)
    return f"{type(error).__name__}: {error}"


@dataclass(frozen=True, slots=True)
class Outcomes:
    """Whether a node may end in success or in failure, and its own outcomes with the result each counts as.

    A node that can do neither never ends by itself. Where not everything is known, all outcomes are possible.
    """

    succeeds: bool = True
    fails: bool = True
    named: Mapping[str, str] = field(default_factory=dict)

    @property
    def words(self) -> Mapping[str, str]:
        """Return all outcomes with the result each counts as."""
        plain = {word: word for word, can in ((SUCCEEDS, self.succeeds), (FAILS, self.fails)) if can}
        return {**plain, **self.named}

    def both(self, other: Outcomes) -> Outcomes:
        """Return the outcomes of either."""
        return Outcomes(self.succeeds or other.succeeds, self.fails or other.fails, {**self.named, **other.named})

    def of(self, word: str) -> Outcomes:
        """Return only those that count as success, or as failure."""
        named = {name: counts for name, counts in self.named.items() if counts == word}
        return Outcomes(self.succeeds and word == SUCCEEDS, self.fails and word == FAILS, named)

    def counting_as(self, word: str) -> bool:
        """Return whether any of them counts as success, or as failure."""
        return word in self.words.values()

    @property
    def plain(self) -> Outcomes:
        """Return them as success and failure only."""
        return Outcomes(self.counting_as(SUCCEEDS), self.counting_as(FAILS))


NEVER = Outcomes(succeeds=False, fails=False)
ALWAYS_SUCCEEDS = Outcomes(fails=False)
ALWAYS_FAILS = Outcomes(succeeds=False)
ANY = Outcomes()


def either(several: Iterable[Outcomes]) -> Outcomes:
    """Return the outcomes of any of several."""
    found = NEVER
    for outcomes in several:
        found = found.both(outcomes)
    return found
