"""The section `provides`: what a part offers to the rest of the robot."""

from rbxcompose.base.config import Config, Name
from rbxcompose.manifest.fields import InterfaceName, TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import PART, Reading, SetScope


class Provides(Config):
    """What a part offers to the rest of the robot, under the names in its file."""

    ports: dict[TopicName, InterfaceName] = {}
    """Topics with their types."""
    skills: tuple[Name, ...] = ()
    """Skills of missions."""
    values: tuple[Name, ...] = ()
    """Values that missions read."""


@section("provides", Provides, order=140, files=(PART,), scope=SetScope.NOTHING, is_composed=False)
def provides(reading: Reading[Provides]) -> Provides:
    """What the part offers to the rest of the robot, under the part's own names; `check` verifies it."""
    return reading.whole() or Provides()
