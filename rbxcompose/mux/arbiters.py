"""Who holds the output: the rule of each mode of a mux, and those of the programs whose behaviour a profile reproduces.

An arbiter sees only inputs that are `free`: live, not locked, and not waiting to come to rest.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from rbxcompose.mux.sources import MuxSource

Sources = Mapping[str, MuxSource]


class Arbiter(ABC):
    """Chooses the input that is let through."""

    selected: str | None = None
    """The input that somebody has chosen."""

    @abstractmethod
    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return which of the free inputs, in their written order, is let through."""

    def heard(self, name: str, free: Sequence[str], sources: Sources) -> None:  # noqa: B027 - most do not care
        """Note that an input has sent a message, and is now among the free ones or not."""

    @abstractmethod
    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return why a free input is not let through beside the holder."""

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with what `old` had chosen, as far as it is among these names."""
        if type(old) is type(self) and old.selected in names:
            self.selected = old.selected


class ByPriority(Arbiter):
    """The highest priority; of equal ones the first in the list."""

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the free input with the highest priority."""
        return max(free, key=lambda name: sources[name].priority, default=None)

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return which priority is higher."""
        is_equal = sources[name].priority == sources[holder].priority
        return f"'{holder}' has the same priority and comes first" if is_equal else f"'{holder}' has a higher priority"


class AsTwistMux(ByPriority):
    """The rule of `twist_mux`: priorities go from 0 to 255, and 0 never passes."""

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the free input with the highest priority above 0."""
        return super().holder([name for name in free if sources[name].priority > 0], sources)

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return which priority is higher."""
        never = "priority 0 never passes in this profile"
        return super().passed_over(name, holder, sources) if sources[name].priority > 0 else never


class AsYocs(Arbiter):
    """The rule of `yocs_cmd_vel_mux`: who holds keeps the output until its own timeout or a higher priority.

    After the timeout nobody holds, and the first message of any input gets through.
    """

    def __init__(self) -> None:
        self._allowed: str | None = None

    def heard(self, name: str, free: Sequence[str], sources: Sources) -> None:
        """Let a sender take the output if it is vacant, or held by one of a lower priority."""
        holder = self.holder(free, sources)
        if name in free and (holder is None or sources[name].priority > sources[holder].priority):
            self._allowed = name

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return who holds it, until its timeout."""
        if self._allowed not in free:
            self._allowed = None
        return self._allowed

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return who must fall silent first."""
        return f"'{holder}' keeps it until it falls silent"

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with the same holder."""
        if isinstance(old, AsYocs) and old._allowed in names:
            self._allowed = old._allowed


class BySelection(Arbiter):
    """The one that somebody has selected, whatever the others send; nobody takes over when it falls silent."""

    def __init__(self, selected: str | None) -> None:
        self.selected = selected

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the selected input if it is free."""
        return self.selected if self.selected in free else None

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return which one is selected."""
        return f"'{holder}' is selected"

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with the same selection, also with that of none."""
        if isinstance(old, BySelection) and (old.selected is None or old.selected in names):
            self.selected = old.selected


class ByLatest(Arbiter):
    """Whoever sent last, among those that are still live."""

    def __init__(self) -> None:
        self._order: list[str] = []  # of the last messages; the newest is at the end

    def heard(self, name: str, free: Sequence[str], sources: Sources) -> None:
        """Note the newest sender."""
        if name in self._order:
            self._order.remove(name)
        self._order.append(name)

    def holder(self, free: Sequence[str], sources: Sources) -> str | None:
        """Return the newest sender that is free."""
        return next((name for name in reversed(self._order) if name in free), None)

    def passed_over(self, name: str, holder: str, sources: Sources) -> str:
        """Return who sent later."""
        return f"'{holder}' sent later"

    def take_over(self, old: Arbiter, names: Sequence[str]) -> None:
        """Continue with the same order."""
        if isinstance(old, ByLatest):
            self._order = [name for name in old._order if name in names]
