"""Watches how often messages come on a topic, and how old they are."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field, ValidationInfo, field_validator

from rbxcompose.msgs import registry
from rbxcompose.msgs.stamps import NANOSECONDS, to_nanoseconds
from rbxcompose.sdk import Component, Config, Frequency, In, MessageName, Port, Time, component
from rbxcompose.sdk.capabilities import Capability, ExpectsRate, Setting
from rbxcompose.sdk.ports import BULK
from rbxcompose.sdk.updater import OLDEST, TOLERANCE, CompositeTask, FrequencyTask, StampTask


class TopicMonitorConfig(Config):
    """What should come, and how often."""

    topic: str = Field(min_length=1)
    """The topic."""
    message: MessageName
    """The type of its messages."""
    rate: Frequency = Field(gt=0)
    """Messages a second; 10 % fewer are still fine."""
    most: Frequency | None = Field(None, gt=0)
    """More messages than this a second are a warning, too."""
    oldest: Time = Field(OLDEST, gt=0)
    """A message with an older stamp is an error."""

    @field_validator("most")
    @classmethod
    def _above_rate(cls, most: float | None, info: ValidationInfo) -> float | None:
        if most is not None and most < info.data.get("rate", 0.0):
            raise ValueError(f"must be at least 'rate', {info.data['rate']:g} Hz, or every rate would be a warning")
        return most


@component("topic_monitor")
class TopicMonitor(Component[TopicMonitorConfig]):
    """Reports a topic to diagnostics: WARN when its rate is wrong, ERROR when it is silent or stamps are old.

    Outputs of the robot's own components that declare a rate are watched without it.

    Example:
        scan_watch: {type: topic_monitor, topic: scan, message: sensor_msgs/LaserScan, rate: 10 Hz, oldest: 0.5 s}
    """

    rate = 1.0

    @classmethod
    def ports(cls, config: TopicMonitorConfig) -> dict[str, Port[Any]]:
        """Return the topic that it listens to."""
        kind = registry.message(config.message)
        return {"messages": In(kind, config.topic, is_open=True, limits=BULK).named("messages")}

    @classmethod
    def capabilities(cls, config: TopicMonitorConfig) -> tuple[Capability, ...]:
        """Declare which rates are fine."""
        most = None if config.most is None else Setting(config.most, "most")
        return (ExpectsRate("messages", Setting(config.rate, "rate"), most, TOLERANCE),)

    def configure(self) -> None:
        """Count from now on."""
        config = self.config
        self.frequency = FrequencyTask(config.rate, config.most or math.inf)
        self.stamps = StampTask(oldest=config.oldest)
        self.has_stamps = "header" in registry.message(config.message).FIELDS
        self.task = CompositeTask(self.frequency.status, self.stamps.status)

    def on_messages(self, message: Any) -> None:
        """Count a message."""
        self.frequency.tick()
        if self.has_stamps:
            self.stamps.tick(to_nanoseconds(message.header.stamp) / NANOSECONDS, self.stamp / NANOSECONDS)

    def step(self, dt: float) -> None:
        """Report."""
        report = self.task.status(self.now)
        self.status(report.level, report.message, **report.values)
