"""Compares a number on any topic with limits."""

from __future__ import annotations

import math
from operator import attrgetter
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator

from rbxcompose.base.levels import Level
from rbxcompose.domains.diagnostics.monitors import LimitCore, Limits
from rbxcompose.msgs import registry
from rbxcompose.sdk import Capability, Component, Config, In, Live, MessageName, Port, Setting, Time, Warns, component
from rbxcompose.sdk.ports import BULK, number_field


class ThresholdConfig(Config):
    """What is compared with what, in the unit of the message."""

    topic: str = Field(min_length=1)
    """Where the messages come from."""
    message: MessageName = "std_msgs/msg/Float32"
    """Their type."""
    field: str = "data"
    """The number in them: `pose.position.x`."""
    warn_below: Annotated[float | None, Live()] = None
    """Below this it is WARN."""
    error_below: Annotated[float | None, Live()] = None
    """Below this it is ERROR."""
    warn_above: Annotated[float | None, Live()] = None
    """Above this it is WARN."""
    error_above: Annotated[float | None, Live()] = None
    """Above this it is ERROR."""
    hysteresis: Annotated[float, Live()] = Field(0.0, ge=0)
    """How far the number must come back before the level is better again."""
    patience: Annotated[Time, Live()] = Field(0.0, ge=0)
    """How long the number must be beyond a limit before the level is worse."""
    timeout: Time = Field(5.0, gt=0)
    """Silence after which nothing is known any more."""
    unit: str = ""
    """For people: the unit of the number."""

    @field_validator("hysteresis")
    @classmethod
    def _comes_back(cls, hysteresis: float, info: ValidationInfo) -> float:
        for level in ("warn", "error"):
            low, high = info.data.get(f"{level}_below"), info.data.get(f"{level}_above")
            if low is not None and high is not None and low + hysteresis > high - hysteresis:
                most = (high - low) / 2.0
                raise ValueError(f"no number comes back by it from both limits of '{level}': at most {most:g}")
        return hysteresis

    @field_validator("field")
    @classmethod
    def _is_number(cls, path: str, info: ValidationInfo) -> str:
        return number_field(info.data["message"], path) if "message" in info.data else path


@component("threshold")
class Threshold(Component[ThresholdConfig]):
    """Reports a number of any topic to diagnostics: WARN or ERROR beyond its limits, STALE when it stays away.

    Example:
        motor_current: {type: threshold, topic: motor/current, warn_above: 2, error_above: 3, hysteresis: 0.2, unit: A}
    """

    rate = 5.0

    @classmethod
    def ports(cls, config: ThresholdConfig) -> dict[str, Port[Any]]:
        """Return the topic that it listens to."""
        kind = registry.message(config.message)
        return {"number": In(kind, config.topic, is_open=True, limits=BULK).named("number")}

    @classmethod
    def capabilities(cls, config: ThresholdConfig) -> tuple[Capability, ...]:
        """Declare its limits."""
        low = Warns(_setting(config, "warn_below"), _setting(config, "error_below"), is_above=False)
        high = Warns(_setting(config, "warn_above"), _setting(config, "error_above"), is_above=True)
        return low, high

    def configure(self) -> None:
        """Know nothing yet."""
        self.core = LimitCore(limits_of(self.config))
        self.read = attrgetter(self.config.field)
        self.received_at = math.inf

    def reconfigure(self, old: ThresholdConfig) -> None:
        """Compare with the new limits from the next message on."""
        self.core.limits = limits_of(self.config)

    def start(self) -> None:
        """Count silence from now on."""
        self.received_at = min(self.received_at, self.now)

    def on_number(self, message: Any) -> None:
        """Take a message."""
        number = float(self.read(message))
        self.received_at = self.now
        self.status(self.core.feed(self.now, number), self.text(number), value=f"{number:.6g}")

    def text(self, number: float) -> str:
        """Return a number with its unit."""
        return f"{number:.4g} {self.config.unit}".rstrip()

    def step(self, dt: float) -> None:
        """Look whether messages stay away."""
        if self.now - self.received_at > self.config.timeout:
            self.status(Level.STALE, f"nothing comes on '{self.config.topic}'")


def limits_of(config: ThresholdConfig) -> Limits:
    """Return the limits of the core."""
    names = ("warn_below", "error_below", "warn_above", "error_above")
    given = {name: value for name in names if (value := getattr(config, name)) is not None}
    return Limits(**given, hysteresis=config.hysteresis, patience=config.patience)


def _setting(config: ThresholdConfig, name: str) -> Setting[float] | None:
    value = getattr(config, name)
    return None if value is None else Setting(value, name)
