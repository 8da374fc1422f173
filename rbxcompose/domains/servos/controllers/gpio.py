"""One item of a servo as an output or an input: its light, a port for a sensor or a switch."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from rbxcompose.base.config import ACTUATOR, Name, Refers
from rbxcompose.domains.servos.controller import Controller, ControllerConfig, UsedItem, controller
from rbxcompose.msgs.std_msgs import Bool, Float64
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk import In, Out, Port, Serves

PERIOD = 0.1  # [s] between messages of an input
PORT_DATA, PORT_MODE = "external_port_data_", "external_port_mode_"
MODES = {"analog": 0, "output": 1, "pull_up": 2, "pull_down": 3}  # of a port of a servo
ANALOG = 3.3 / 4095  # [V] for each step


class GpioConfig(ControllerConfig):
    """One item of a servo as an output or an input."""

    type: Literal["gpio"] = "gpio"
    """What it does."""
    actuator: Annotated[Name, Refers(ACTUATOR)]
    """The servo."""
    item: str
    """Its item: `led`, `external_port_data_1`, or any other one to read, such as `present_voltage`."""
    direction: Literal["out", "in"]
    """Whether it is switched, or read."""
    input: Literal["analog", "pull_up", "pull_down"] | None = None
    """What an input port does without a signal, or that it measures a voltage; without it, the port is as it was."""

    @property
    def claimed(self) -> tuple[str, ...]:
        """Return nothing: it leads no joint."""
        return ()

    @property
    def used(self) -> tuple[UsedItem, ...]:
        """Return the item."""
        return (UsedItem(self.actuator, self.item, "item", self.direction == "out"),)


@controller("gpio")
class GpioController(Controller[GpioConfig]):
    """Switches an item of a servo, or reads one.

    An output has the topic `NAME/command` and the service `NAME/set`, which is the skill `NAME: true` of missions. An
    input is on `NAME/state`, ten times per second, in the unit of the item; a port is 0 or 1, or a voltage if it is
    `analog`. A stop leaves outputs as they are, and refuses changes.

    Example:
        lamp: {type: gpio, actuator: pan_servo, item: led, direction: out}
    """

    @classmethod
    def ports(cls, name: str, config: GpioConfig) -> dict[str, Port[Any]]:
        """Return those of its direction."""
        if config.direction == "in":
            return {"state": Out(Float64, f"{name}/state")}
        return {
            "command": In(Bool, f"{name}/command", qos="command", is_open=True),
            "set": Serves(SetBool, f"{name}/set", skill=name),
        }

    @classmethod
    def mistake(cls, config: GpioConfig) -> tuple[str, str] | None:
        """Return an 'input' that is none."""
        if config.input is not None and config.direction == "out":
            return "input", "'input' is for the direction 'in'"
        if config.input is not None and not config.item.startswith(PORT_DATA):
            return "input", f"'input' is for the ports of a servo, such as '{PORT_DATA}1'"
        return None

    def prepare(self) -> None:
        """Take the item; a port is given its mode."""
        config = self.config
        mode = "output" if config.direction == "out" else config.input
        is_port = config.item.startswith(PORT_DATA) and mode is not None
        setup = {config.item.replace(PORT_DATA, PORT_MODE): MODES[mode]} if is_port and mode else {}
        self.item = self.site.item(config.actuator, config.item, is_read=config.direction == "in", setup=setup)
        self.scale = ANALOG if config.input == "analog" else 1.0
        self.published_at = -math.inf

    @property
    def note(self) -> str:
        """Return why the item was not read or written."""
        return self.item.problem

    def received(self, port: str, message: Bool) -> None:
        """Switch it."""
        self.item.write(int(message.data))

    def asked(self, port: str, request: SetBool.Request) -> SetBool.Response:
        """Switch it, unless nothing may be commanded now."""
        if reason := self.site.refusal:
            return SetBool.Response(success=False, message=reason)
        self.item.write(int(request.data))
        return SetBool.Response(success=True)

    def cycle(self, now: float, dt: float) -> None:
        """Lead nothing."""

    def publish(self) -> None:
        """Publish an input."""
        is_due = self.site.now - self.published_at >= PERIOD - 1e-9
        if self.config.direction == "in" and is_due and math.isfinite(self.item.value):
            self.published_at = self.site.now
            self.site.send("state", Float64(data=self.item.value * self.scale))
