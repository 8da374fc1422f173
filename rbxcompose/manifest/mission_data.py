"""Values passed to missions as a whole: their data and inputs."""

from __future__ import annotations

from rbxcompose.base.findings import Report
from rbxcompose.manifest.tree import DATA_NODES, MappingNode, TreeNode, is_larger
from rbxcompose.manifest.yaml_nodes import TOO_LARGE


def is_moderate(section: TreeNode | None, what: str, report: Report) -> bool:
    """Return whether every entry of a section is small enough for a mission, after a finding for each that is not."""
    entries = section.entries.values() if isinstance(section, MappingNode) else ()
    large = [entry for entry in entries if is_larger(entry.value, DATA_NODES)]
    for entry in large:
        message = f"the {what} '{entry.key.text}' holds more than {DATA_NODES:,} values"
        report.add(TOO_LARGE.at(entry.key.span, message, help="a mission reads, checks and copies all of them at once"))
    return not large
