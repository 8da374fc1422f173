"""The section `needs`: what must exist outside a part."""

from rbxcompose.base.config import Config
from rbxcompose.manifest.fields import InterfaceName, TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import PART, Reading, SetScope


class Needs(Config):
    """What must exist outside a part."""

    ports: dict[TopicName, InterfaceName] = {}
    """Topics with their types, such as `cmd_vel: geometry_msgs/Twist`."""


@section("needs", Needs, order=130, files=(PART,), scope=SetScope.NOTHING, is_composed=False)
def needs(reading: Reading[Needs]) -> Needs:
    """What must exist outside the part; `check` verifies it."""
    return reading.whole() or Needs()
