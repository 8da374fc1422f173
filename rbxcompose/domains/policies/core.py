"""What of the answers of a policy is commanded: those in time, finite, within limits and near to the last one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field

from rbxcompose.base.dataclass import dataclass

ROUNDING = 1e-6  # of a limit, by which a number of 32 bits may be beyond it


@dataclass(frozen=True, slots=True)
class AnswerLimits:
    """What a number of an answer may be, and how far it may be from the one before."""

    least: float
    most: float
    jump: float


@dataclass(slots=True)
class PolicyCounts:
    """What became of answers since the policy was configured."""

    sent: int = 0
    late: int = 0
    refused: int = 0
    unseen: int = 0
    """Times at which there was nothing to observe, and so no answer."""


@dataclass(slots=True)
class PolicyCore:
    """Judges answers, and says when what is commanded must rest."""

    limits: Mapping[str, AnswerLimits]
    """By the name of each number of an answer, in its order."""
    deadline: float
    """[s] from an observation to its command, and from the last command until rest."""
    counts: PolicyCounts = field(default_factory=PolicyCounts)
    last: tuple[float, ...] | None = None
    """What is sent; None at first, and after a rest."""
    sent_at: float = -math.inf

    def judge(self, answer: Sequence[float], start: Sequence[float], began: float, ended: float) -> str:
        """Return why an answer must not be sent, or nothing: then `last` is to be sent.

        `start` is where the first answer begins; times [s] are those of the observation and of the answer.
        """
        took = ended - began
        if took > self.deadline:
            self.counts.late += 1
            return f"an answer took {took * 1e3:.0f} ms, and is late after {self.deadline * 1e3:.0f} ms"
        if problem := self._problem(answer, start if self.last is None else self.last):
            self.counts.refused += 1
            return problem
        pairs = zip(self.limits.values(), answer, strict=True)
        self.last, self.sent_at = tuple(min(max(value, limits.least), limits.most) for limits, value in pairs), ended
        self.counts.sent += 1
        return ""

    def _problem(self, answer: Sequence[float], before: Sequence[float]) -> str:
        if len(answer) != len(self.limits):
            return f"an answer has {len(answer)} numbers, and not {len(self.limits)}"
        for (name, limits), value, old in zip(self.limits.items(), answer, before, strict=True):
            if not math.isfinite(value):
                return f"'{name}' is not finite"
            if not limits.least - _slack(limits.least) <= value <= limits.most + _slack(limits.most):
                return f"'{name}' is {value:.4g}, beyond {limits.least:g} to {limits.most:g}"
            if abs(value - old) > limits.jump + _slack(limits.jump, value):
                return f"'{name}' jumps from {old:.4g} to {value:.4g}, by more than {limits.jump:g}"
        return ""

    def must_rest(self, now: float) -> bool:
        """Return whether what is commanded must rest now: its last command was good too long ago; once."""
        if self.last is None or now - self.sent_at <= self.deadline:
            return False
        self.last = None
        return True

    def forget(self) -> bool:
        """Start again with the next answer; return whether something is commanded that must rest."""
        is_moving, self.last = self.last is not None, None
        return is_moving


def _slack(*values: float) -> float:
    return ROUNDING * max(map(abs, values))
