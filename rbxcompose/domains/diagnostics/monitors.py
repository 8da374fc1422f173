"""What monitors share: a number against its limits, with hysteresis and patience; how much of something is in use."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, TypeVar

from pydantic import Field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.sdk import Capability, Component, Config, Live, NeedsExtra, Ratio, Setting, Time, Warns

C = TypeVar("C", bound=Config)
NEEDS_PSUTIL = NeedsExtra(Setting("psutil"), Setting("monitors"))
HYSTERESIS = 0.02  # of the share


@dataclass(frozen=True, slots=True)
class Limits:
    """Where a number is a warning or an error, below and above.

    A level that it has reached lasts until the number is back by `hysteresis`; a worse one counts once the number has
    been there for `patience` [s].
    """

    warn_below: float = -math.inf
    error_below: float = -math.inf
    warn_above: float = math.inf
    error_above: float = math.inf
    hysteresis: float = 0.0
    patience: float = 0.0

    def level(self, number: float, *, since: Level = Level.OK) -> Level:
        """Return the level of a number if the level before was `since`; what is not finite is an ERROR."""
        if not math.isfinite(number):
            return Level.ERROR
        error, warn = (self.hysteresis if since >= level else 0.0 for level in (Level.ERROR, Level.WARN))
        if number < self.error_below + error or number > self.error_above - error:
            return Level.ERROR
        if number < self.warn_below + warn or number > self.warn_above - warn:
            return Level.WARN
        return Level.OK


class LimitCore:
    """The level of a number over time; all times in [s]."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.level = Level.OK
        self._worse_since: float | None = None  # the number has been beyond another limit

    def feed(self, now: float, number: float) -> Level:
        """Take a number and return the level."""
        found = self.limits.level(number, since=self.level)
        if found <= self.level:
            self.level, self._worse_since = found, None
            return self.level
        if self._worse_since is None:
            self._worse_since = now
        if now - self._worse_since >= self.limits.patience:
            self.level, self._worse_since = found, None
        return self.level


class HostMonitor(Component[C]):
    """Measures once a second; in simulated time it does not, so that two runs are alike."""

    rate: ClassVar[float] = 1.0

    def measure(self, dt: float) -> None:
        """Look at the computer, `dt` [s] after the last time, and report."""
        raise NotImplementedError

    def step(self, dt: float) -> None:
        """Measure."""
        if self.context.clock.is_real:
            self.measure(dt)
        else:
            self.status(Level.OK, "not measured: time is simulated")


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
