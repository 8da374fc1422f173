"""How a robot runs: the options of `up`."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ChosenLayers:
    """What was put over the robot's file when its plan was compiled: profiles, overlays by path, `--set`, `--real`."""

    profiles: tuple[str, ...] = ()
    overlays: tuple[str, ...] = ()
    sets: tuple[str, ...] = ()
    real: bool = False
    system: str = ""  # the file of a system whose other robots its missions use, with the profiles of that
    system_profiles: tuple[str, ...] = ()
    member: str = ""  # its name there


NO_LAYERS = ChosenLayers()


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Real time (`is_stepped` false) or stepped time at `rate` times real time (None: as fast as it goes).

    `duration` [s] of robot time ends the run; a robot that is detached stays up when its mission has ended.
    A stepped run can be recorded to the file `record` from within, so that each component can be replayed.
    """

    is_stepped: bool = False
    rate: float | None = None
    duration: float | None = None
    is_detached: bool = False
    record: Path | None = None
    layers: ChosenLayers = NO_LAYERS
