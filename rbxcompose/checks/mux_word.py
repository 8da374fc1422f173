"""A word of a mux without a meaning in its mode."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.mux.words import MODE_OF
from rbxcompose.sections.muxes import MuxModel


@check("RBX3131")
def mux_word(robot: Robot) -> Iterator[Finding]:
    """A key of a mux has no meaning in its mode."""
    for mux, entry in robot.manifest.muxes.items():
        if entry.profile != "default" and entry.works_by != MODE_OF[entry.profile]:
            message = f"the profile '{entry.profile}' of mux '{mux}' has the mode '{MODE_OF[entry.profile]}'"
            yield mux_word.at(robot.value("muxes", mux, "mode"), message, help="leave one of them out")
        for path in _meaningless(entry):
            yield mux_word.at(
                robot.key("muxes", mux, *path),
                f"'{path[-1]}' has no meaning in the mode '{entry.works_by}' of mux '{mux}'",
                help="leave it out, or choose another mode",
            )


def _meaningless(entry: MuxModel) -> Iterator[tuple[str, ...]]:
    """Yield the paths of keys that the mode does not know."""
    if entry.works_by != "select":
        yield from ((key,) for key in ("initial", "lazy") if key in entry.model_fields_set)
    if not entry.has_priorities:
        yield from (("inputs", name, "priority") for name, one in entry.inputs.items() if one.priority is not None)
        yield from (("locks", name, "priority") for name, one in entry.locks.items() if one.priority is not None)
