"""Going down: brake, wait for rest, shut the processes down in reverse order. Pure: the conductor drives it."""

from collections.abc import Mapping

from rbxcompose.compiler.plan.model import Plan
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.supervision.members import ConductorEffects, Member, Phase
from rbxcompose.sdk.registry import component_type

END_BOUND = 0.9  # [s] to end after everything is at rest; what is left then is killed


def rest_time(plan: Plan) -> float:
    """Return how long the components of a plan may take to come to rest [s]."""
    return max((component_type(instance.type).rest_time(instance.config) for instance in plan.instances), default=0.0)


class Closing:
    """Brings processes to rest and ends them one by one; `phase` is its progress."""

    def __init__(self, members: Mapping[str, Member], effects: ConductorEffects, router: str | None) -> None:
        self.phase = Phase.BRAKING
        self._members, self._effects, self._router = members, effects, router
        self._left: list[str] = []  # processes still to be shut down, the next one last

    def brake(self) -> None:
        """Bring everything that may move to rest."""
        for member in self._there():
            if member.is_configured and member.name != self._router:
                self._effects.send(member.name, messages.Brake())
            elif member.name != self._router:
                self._effects.end(member.name)  # it cannot listen yet; its components brake before it ends
        self.close_when_at_rest()

    def hurry(self) -> None:
        """End everything that is left immediately."""
        for member in self._there():
            self._effects.kill(member.name)

    def exited(self) -> None:
        """Continue after the end of a process."""
        self.close_when_at_rest()
        self._close_next()

    def close_when_at_rest(self) -> None:
        """Shut down if nothing moves any more."""
        moving = [member for member in self._there() if member.name != self._router and not member.is_at_rest]
        if self.phase is Phase.BRAKING and not moving:
            self.close()

    def close(self) -> None:
        """Shut down even if something still moves."""
        if self.phase is Phase.BRAKING:
            self.phase = Phase.CLOSING
            self._left = list(self._members)  # the router first, so that it ends last
            self._close_next()

    def _there(self) -> list[Member]:
        return [member for member in self._members.values() if member.is_there]

    def _close_next(self) -> None:
        """Shut down the next process once the one before has ended."""
        if self.phase is not Phase.CLOSING:
            return
        if self._left and self._members[self._left[-1]].is_there is False:
            self._left.pop()
            self._close_next()
        elif self._left:
            self._shutdown_once(self._left[-1])
        else:
            self.phase = Phase.ENDED

    def _shutdown_once(self, name: str) -> None:
        member = self._members[name]
        if member.is_closing:
            return
        member.is_closing = True
        if member.is_configured:
            self._effects.send(name, messages.Shutdown())
        else:
            self._effects.end(name)
