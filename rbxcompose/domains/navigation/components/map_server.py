"""The map of the robot's surroundings."""

from __future__ import annotations

from pathlib import Path

from rbxcompose import sdk
from rbxcompose.domains.worlds.grid_map import read_map
from rbxcompose.domains.worlds.world import MAP_FRAME, grid_message
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header


class MapServerConfig(sdk.Config):
    """Which map."""

    file: str = ""
    """The YAML file of a map of map_server, as an absolute path; without one there is no map."""


@sdk.component("map_server")
class MapServer(sdk.Component[MapServerConfig]):
    """Publishes the map of its file, also for who comes late.

    Example:
        map_server: {type: map_server}
    """

    made_by = "The section `navigation` runs it."
    map = sdk.Out(OccupancyGrid, "map", qos="latched")

    def configure(self) -> None:
        """Read the map."""
        self.grid = read_map(Path(self.config.file)) if self.config.file else None

    def activate(self) -> None:
        """Publish it."""
        if self.grid is not None:
            self.map(grid_message(self.grid, Header(stamp=to_time(self.stamp), frame_id=MAP_FRAME)))
