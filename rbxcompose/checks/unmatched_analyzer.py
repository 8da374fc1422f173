"""An analyzer that matches nothing."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.conditions import component_of, fits, is_glob
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding
from rbxcompose.manifest.yaml_nodes import TOO_LARGE
from rbxcompose.model.robot import Robot
from rbxcompose.rules import NAMES

_MOST_COMPARED = 200_000  # of patterns with names


@check("RBX5001", is_fixable=True, closed=(NAMES,))
def unmatched_analyzer(robot: Robot) -> Iterator[Finding]:
    """A pattern of an analyzer matches no component."""
    there = {*robot.components, *robot.written, *robot.brought}
    known = {name for name in there if name.isidentifier()}
    meant = {
        re.sub(r"\W+", by, name) for name in there - known for by in ("", "_")
    }  # names that are told where they stand
    compared = 0
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        patterns = [(index, one) for index, one in enumerate(analyzer.conditions) if isinstance(one, str)]
        for index, pattern in patterns:
            place = robot.value("diagnostics", "analyzers", *path, "match", index)
            if compared > _MOST_COMPARED:
                message = f"the patterns up to this one take more than {_MOST_COMPARED:,} comparisons with components"
                yield TOO_LARGE.at(place, message, help="use fewer patterns")
                return
            wanted = component_of(pattern)  # which details it has shows only while it runs
            tried = () if wanted in known or not is_glob(wanted) else known
            compared += len(tried)
            if wanted not in known | meant and not any(fits(wanted, component) for component in tried):
                yield unmatched_analyzer.misspelt(
                    place,
                    f"analyzer '{path[-1]}' matches no component with '{pattern}'",
                    pattern,
                    known,
                    "components of this robot",
                    taken=[one for _, one in patterns],
                )
