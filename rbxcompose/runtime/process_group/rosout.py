"""`/rosout`: the log lines of components, in the form of ROS 2."""

from __future__ import annotations

from rbxcompose.bus.bus import Bus
from rbxcompose.clock import Clock
from rbxcompose.levels import Level
from rbxcompose.msgs.rcl_interfaces import Log
from rbxcompose.msgs.stamps import to_time
from rbxcompose.qos import Qos

TOPIC = "/rosout"
_LEVELS = {Level.OK: Log.INFO, Level.WARN: Log.WARN, Level.ERROR: Log.ERROR, Level.STALE: Log.WARN}


class Rosout:
    """Publishes what the components of one process log."""

    def __init__(self, owner: str, bus: Bus, clock: Clock) -> None:
        self._clock = clock
        self._publisher = bus.publisher(owner, TOPIC, Log, Qos.EVENT)

    def publish(self, name: str, level: Level, text: str) -> None:
        """Publish one line of the component `name`."""
        self._publisher(Log(stamp=to_time(self._clock.stamp()), level=_LEVELS[level], name=name, msg=text))
