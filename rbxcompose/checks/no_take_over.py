"""A mux at which nobody can take over."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX3141", Severity.WARNING)
def no_take_over(robot: Robot) -> Iterator[Finding]:
    """Nobody can take over from a component that drives."""
    for mux, entry in robot.manifest.muxes.items():
        ranks = entry.ranks if entry.profile == "default" else {}
        driving = {name: rank for name, rank in ranks.items() if entry.inputs[name].source}
        open_ones = [name for name in ranks if name not in driving]
        if any(rank <= max(driving.values(), default=0) for rank in entry.lock_ranks.values()):
            continue  # told as RBX3110
        if open_ones and driving and max(ranks[name] for name in open_ones) < min(driving.values()):
            best = max(open_ones, key=lambda name: ranks[name])
            first = min(driving, key=lambda name: driving[name])
            yield no_take_over.at(
                robot.value("muxes", mux, "inputs", best, "priority"),
                f"whoever commands at '{best}' cannot take over: all that drives by itself is above it",
                label=f"input '{best}'",
                help=f"the higher priority wins: write one above {max(driving.values())}",
                related=[Related(robot.value("muxes", mux, "inputs", first, "priority"), f"input '{first}'")],
            )
