"""`call`: call a service and wait for its response."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.engine.instant_actions import fields_of
from rbxcompose.missions.engine.leaf import Leaf
from rbxcompose.missions.engine.task import Site
from rbxcompose.missions.language.fields import contents, message
from rbxcompose.missions.program.answers import NodeEffects
from rbxcompose.missions.program.families import LeafStep, ends
from rbxcompose.missions.program.machines import MessageTemplate
from rbxcompose.missions.program.outcomes import ANY, RUNNING
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.missions.program.registry import kind
from rbxcompose.msgs import registry


class CallTask(Leaf):
    """Sends a request to the world, and returns its response."""

    __slots__ = ("message",)

    def __init__(self, site: Site, step: CallStep) -> None:
        super().__init__(site)
        self.message = step.message

    def begin(self) -> int:
        """Send the request."""
        return self.ask()

    def ask(self) -> int:
        """Send the request."""
        service = self.message.target.text
        request = registry.service(self.engine.robot.services[service]).Request
        fields = fields_of(self.message, request, self)
        self.status, self.is_asked = RUNNING, True
        try:
            self.engine.world.call(self.number, service, fields)
        except Exception:
            self.is_asked = False
            raise
        return RUNNING


@kind("call", CallTask)
@dataclass(frozen=True, slots=True)
class CallStep(LeafStep):
    """Call a service of the robot; a response with `success: false` is a failure.

    Example:
        do:
          call: set_battery_level
          request: 100
          timeout: 2 s
    """

    message: MessageTemplate = message("request")
    request = contents("The fields of the request; a single value stands for the only field.")

    waits = True
    has_result = True
    lasts = None
    only_asks = False

    may_end = ends(ANY)

    def text(self, node: MissionNode) -> str:
        """Return the service."""
        return self.message.target.text

    @property
    def effects(self) -> NodeEffects:
        """Return the request."""
        return NodeEffects(called=self.message)
