"""`call`: call a service and wait for its response."""

from __future__ import annotations

from rbxcompose.base.config import SERVICE
from rbxcompose.missions import sdk
from rbxcompose.msgs import registry


class CallTask(sdk.Leaf):
    """Sends a request to the world, and returns its response."""

    __slots__ = ("message",)

    def __init__(self, site: sdk.Site, step: CallStep) -> None:
        super().__init__(site)
        self.message = step.message

    def begin(self) -> int:
        """Send the request."""
        return self.ask()

    def ask(self) -> int:
        """Send the request."""
        service = self.message.target.text
        request = registry.service(self.engine.robot.services[service]).Request
        fields = sdk.fields_of(self.message, request, self)
        self.status, self.is_asked = sdk.RUNNING, True
        try:
            self.engine.world.call(self.number, service, fields)
        except Exception:
            self.is_asked = False
            raise
        return sdk.RUNNING


@sdk.kind("call", CallTask)
@sdk.dataclass(frozen=True, slots=True)
class CallStep(sdk.LeafStep):
    """Call a service of the robot; a response with `success: false` is a failure.

    Example:
        do:
          call: set_battery_level
          request: 100
          timeout: 2 s
    """

    message: sdk.MessageTemplate = sdk.message("request", SERVICE)
    request = sdk.contents("The fields of the request; a single value stands for the only field.")

    waits = True
    has_result = True
    lasts = None
    only_asks = False

    may_end = sdk.ends(sdk.ANY)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the service."""
        return f"Call {self.message.target.text}"

    def text(self, node: sdk.MissionNode) -> str:
        """Return the service."""
        return self.message.target.text

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the request."""
        return sdk.NodeEffects(called=self.message)
