"""A mux input that never gets through."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot

_MOST_SHOWN = 8  # inputs that are pointed at


@check("RBX3133", Severity.WARNING)
def mux_unreached(robot: Robot) -> Iterator[Finding]:
    """An input of a mux never gets through."""
    for mux, entry in robot.manifest.muxes.items():
        ranks = entry.ranks if entry.profile == "twist_mux" else {}
        endless = [name for name, rank in ranks.items() if rank > 0 and not entry.inputs[name].timeout]
        top = max(endless, key=lambda name: ranks[name], default="")
        places = list(ranks)
        below = [
            name
            for place, (name, rank) in enumerate(ranks.items())
            if top and (rank, -place) < (ranks[top], -places.index(top))
        ]
        if below:
            shown = ", ".join(f"'{name}'" for name in below)
            yield mux_unreached.at(
                robot.value("muxes", mux, "inputs", top, "timeout"),
                f"input '{top}' of mux '{mux}' never expires, so what is below it never gets through: {shown}",
                help="give it a timeout such as '0.5 s'",
                related=[Related(robot.key("muxes", mux, "inputs", name), "held back") for name in below[:_MOST_SHOWN]],
            )
