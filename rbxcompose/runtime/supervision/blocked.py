"""Which components of a running robot wait for one that has failed: told to their processes, and kept for `ps`."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from rbxcompose.levels import Level
from rbxcompose.plan.model import Plan
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.supervision.dependents import blocked_by, blocked_text
from rbxcompose.runtime.supervision.members import ConductorEffects, Member


class BlockedComponents:
    """Knows who is blocked; `causes` has for each blocked component the one that failed."""

    def __init__(self, effects: ConductorEffects) -> None:
        self.causes: dict[str, str] = {}
        self._effects = effects

    def look(
        self, plan: Plan, states: Mapping[str, tuple[str, int]], others: Collection[str], members: Mapping[str, Member]
    ) -> None:
        """Find out who is blocked now, and tell those for whom this is news; `others` have failed on other hosts."""
        failed = {*others, *(name for name, (state, _) in states.items() if state == "failed")}
        before, self.causes = self.causes, blocked_by(plan, failed)
        for name in self.causes.keys() - before.keys():
            self._effects.log(Level.WARN, f"'{name}' {blocked_text(self.causes, name)}")
        touched = {name for name in {*before, *self.causes} if before.get(name) != self.causes.get(name)}
        for group in dict.fromkeys(one.process for one in plan.instances if one.name in touched):
            if members[group].is_configured:
                self.tell(plan, members[group], is_news=True)

    def tell(self, plan: Plan, member: Member, *, is_news: bool = False) -> None:
        """Tell a process which of its components are blocked."""
        names = [one.name for one in plan.of_group(member.name) if one.name in self.causes]
        if names or is_news:
            self._effects.send(member.name, say.Blocked({name: blocked_text(self.causes, name) for name in names}))
