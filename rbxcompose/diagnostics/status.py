"""One status of one part of the robot."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.levels import Level


@dataclass(frozen=True, slots=True)
class Status:
    """What a part reports about itself; `name` is `component` or `component: detail`, `values` are keys and texts."""

    name: str
    level: Level
    message: str = ""
    hardware_id: str = ""
    values: tuple[tuple[str, str], ...] = ()
