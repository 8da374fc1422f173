"""The section `values`: short names for data."""

from __future__ import annotations

from rbxcompose.config import Config
from rbxcompose.manifest.fields import DottedName, PortName, TopicName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading, Short
from rbxcompose.references import VALUE


class ValueModel(Config):
    """A short name for data that missions read: `port` of a component, or `topic` and `field` from outside."""

    port: PortName | None = None
    """`component.port`."""
    topic: TopicName | None = None
    """Topic of data from outside."""
    field: DottedName | None = None
    """Field of its message; without it, `data`."""
    type: str | None = None
    """Its type: a dimension, `number`, `text`, `flag`, ..."""
    unit: str | None = None
    """Unit of the message, if it differs from that of the type."""
    event: bool | None = None
    """Whether each message is an event: a condition that waits counts it only if it came since its node began, and no
    mission waits for it before it begins. Else the last message counts, however old.
    """


@section("values", ValueModel, order=80, names=VALUE, entry="value", short=Short("port", is_merged=False))
def values(reading: Reading[ValueModel]) -> dict[str, ValueModel]:
    """Short names for data that missions read by `$NAME`.

    Example:
        values:
          battery: battery.battery_level
          door:
            topic: door/state
            type: text
          confirmed:
            topic: button
            type: flag
            event: true
    """
    return reading.readable_entries()
