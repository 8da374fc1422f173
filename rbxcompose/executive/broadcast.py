"""What viewers in other processes see of missions: the full state on request, then what changes.

The keys are `missions` (a list, on request) and `missions/NAME`, below the robot's own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rbxcompose.executive.mission_run import MissionRun
from rbxcompose.executive.missions import RunningMissions
from rbxcompose.executive.requests import ListMissions, LookAtAll
from rbxcompose.requests import Query
from rbxcompose.sdk.bound import Window

PATH = "missions"
_ALWAYS = frozenset({"mission", "version", "whole", "state"})  # what is in all updates

Open = Callable[[str, Query[Any]], Window]  # takes a path and the query that is made there


class Broadcast:
    """A window for each mission of a robot."""

    def __init__(self, names: Iterable[str], open_window: Open) -> None:
        self._list = open_window(PATH, ListMissions())
        self._feeds = {name: MissionFeed(open_window(f"{PATH}/{name}", LookAtAll(name))) for name in names}

    def tell(self, missions: RunningMissions) -> None:
        """Publish what has changed; nothing is prepared without a viewer."""
        for name, one in missions.runs.items():
            self._feeds[name].tell(one)


class MissionFeed:
    """What was last published about one mission."""

    def __init__(self, window: Window) -> None:
        self._window = window
        self._run: MissionRun | None = None
        self._told: dict[str, Any] = {}

    def tell(self, one: MissionRun) -> None:
        """Send what is new, if there is a subscriber and something new."""
        if not self._window.is_watched:
            return
        if one is not self._run:
            self._run, self._told = one, {}
        seen = one.seen(self._told.get("version", 0))
        fresh = {key: value for key, value in seen.items() if key in _ALWAYS or self._told.get(key) != value}
        fresh |= {"statuses": seen["statuses"], "data": seen["data"]}
        if all(self._told.get(key) == seen[key] for key in ("version", "state", "transitions", "began")):
            return
        self._told = seen
        self._window.put(fresh)
