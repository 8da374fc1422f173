"""A mux input that never gets through."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot


@check("RBX3133", Severity.WARNING)
def mux_unreached(robot: Robot) -> Iterator[Finding]:
    """An input of a mux never gets through

    In the profile `twist_mux`, an input whose `timeout` is 0 never expires: it holds back what is not above it, even
    before its first message. That program does so, and the profile follows it.

    Bad:
    ```yaml
    muxes:
      cmd_vel:
        profile: twist_mux
        inputs:
          teleop:
            priority: 100
            timeout: 0 s
          navigation:
            from: go_to
            priority: 10
            timeout: 0.5 s
    ```
    Good:
    ```yaml
    muxes:
      cmd_vel:
        profile: twist_mux
        inputs:
          teleop:
            priority: 100
            timeout: 0.5 s
          navigation:
            from: go_to
            priority: 10
            timeout: 0.5 s
    ```
    """
    for mux, entry in robot.manifest.muxes.items():
        ranks = entry.ranks if entry.profile == "twist_mux" else {}
        endless = [name for name, rank in ranks.items() if rank > 0 and not entry.inputs[name].timeout]
        top = max(endless, key=lambda name: ranks[name], default="")
        for place, (name, rank) in enumerate(ranks.items()):
            is_below = bool(top) and (rank, -place) < (ranks[top], -list(ranks).index(top))
            if is_below:
                yield mux_unreached.at(
                    robot.key("muxes", mux, "inputs", name),
                    f"input '{name}' of mux '{mux}' never gets through: '{top}' never expires",
                    help=f"give '{top}' a timeout such as '0.5 s'",
                    related=[Related(robot.value("muxes", mux, "inputs", top), "it holds back what is below")],
                )
