"""The section `profiles`: changes to the robot that are applied on request."""

from typing import Any

from rbxcompose.base.config import Name
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import ROBOT, Reading, SetScope
from rbxcompose.manifest.tree import Entry, MappingNode
from rbxcompose.manifest.validate import validate

PROFILE = "profile"


@section(
    "profiles", dict[str, Any], order=120, files=(ROBOT,), names=PROFILE, scope=SetScope.NOTHING, is_composed=False
)
def profiles(reading: Reading[dict[str, Any]]) -> dict[str, Entry] | None:
    """Changes to the robot by name, applied with `--profile NAME`.

    Example:
        profiles:
          tired:
            components:
              battery:
                runtime: 30 s
            start: !remove
    """
    there = reading.contents.root.get("profiles")
    if there is None:
        return {}
    is_read = validate(dict[Name, dict[str, Any]], there, ("profiles",), reading.report) is not None
    return there.entries if is_read and isinstance(there, MappingNode) else None
