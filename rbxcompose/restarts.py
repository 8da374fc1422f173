"""When a failed component is restarted: the option `restart`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from rbxcompose.config import Config, Time

When = Literal["on_failure", "always", "never"]


class Restart(Config):
    """When a failed component is restarted."""

    when: When = "on_failure"
    """`on_failure` ends the robot after `max` failures, `always` keeps trying, `never` leaves it failed."""
    max: int = Field(5, ge=1, le=100)
    """Number of failures within `within` after which it is not restarted again."""
    within: Time = Field(60.0, gt=0)
    """The time in which failures are counted."""
    backoff: Time = Field(0.1, ge=0)
    """The pause before the first try; each failure in a row doubles it."""


DEFAULT = Restart()
"""The policy if a manifest gives none."""
