"""Monitors of something that may be used up: a share of it is in use, and limits say when that is too much."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, TypeVar

from pydantic import Field

from rbxcompose.dataclass import dataclass
from rbxcompose.diagnostics.limits import LimitCore, Limits
from rbxcompose.monitors.host import NEEDS_PSUTIL, HostMonitor
from rbxcompose.sdk import Capability, Config, Live, Ratio, Setting, Time, Warns

HYSTERESIS = 0.02  # of the share


@dataclass(frozen=True, slots=True)
class Usage:
    """How much is in use, from 0 to 1, in words, and what people may want to know besides."""

    share: float
    message: str
    values: Mapping[str, object]


class UsageConfig(Config):
    """When it is too much."""

    warn: Annotated[Ratio, Live()] = Field(0.9, ge=0, le=1)
    """Above this share it is WARN."""
    error: Annotated[Ratio, Live()] = Field(0.97, ge=0, le=1)
    """Above this share it is ERROR."""
    patience: Annotated[Time, Live()] = Field(5.0, ge=0)
    """How long it must be too much before the level is worse."""


U = TypeVar("U", bound=UsageConfig)


class UsageMonitor(HostMonitor[U]):
    """Reports a share of something to diagnostics once a second."""

    @classmethod
    def capabilities(cls, config: U) -> tuple[Capability, ...]:
        """Declare its limits, and the package that reads them."""
        limits = Warns(Setting(config.warn, "warn"), Setting(config.error, "error"), is_above=True)
        return limits, NEEDS_PSUTIL

    def configure(self) -> None:
        """Begin without a level."""
        self.core = LimitCore(self.limits)

    @property
    def limits(self) -> Limits:
        """Return the configured limits."""
        config = self.config
        return Limits(warn_above=config.warn, error_above=config.error, hysteresis=HYSTERESIS, patience=config.patience)

    def reconfigure(self, old: U) -> None:
        """Apply new limits."""
        self.core.limits = self.limits

    def read(self) -> Usage:
        """Return how much is in use now."""
        raise NotImplementedError

    def measure(self, dt: float) -> None:
        """Look, and report."""
        usage = self.read()
        self.status(self.core.feed(self.now, usage.share), usage.message, **usage.values)
