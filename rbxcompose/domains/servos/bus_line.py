"""Opens the bus that a configuration describes: real servos on a port, or simulated ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.bus import ServoBus, bus_type
from rbxcompose.domains.servos.bus_config import ServoBusConfig
from rbxcompose.domains.servos.joint_drive import ServoJoint
from rbxcompose.domains.servos.twins.fault_script import FaultScript
from rbxcompose.domains.servos.twins.servo_fake import FakeServo
from rbxcompose.domains.servos.twins.servo_twin import TwinBus, twin_of, twin_servos


@dataclass(frozen=True, slots=True)
class OpenedBus:
    """A bus, and what goes wrong with its servos, if they are simulated."""

    bus: ServoBus
    faults: FaultScript | None = None
    note: str = ""
    """What people should know of it; empty if nothing."""


def open_bus(
    config: ServoBusConfig,
    joints: Sequence[ServoJoint],
    now: Callable[[], float],
    at_end: ExitStack,
    *,
    is_real_time: bool,
) -> OpenedBus:
    """Open the bus of these joints, until `at_end` is closed. Simulated servos have bytes in real time only.

    Raises:
        PortError: if the port cannot be opened.
    """
    path, faults = config.port, None
    if config.twin:
        has_bytes = is_real_time and config.twin == "pty"
        servos = twin_servos(joints, is_ideal=config.twin == "ideal", noise=config.noise, seed=config.seed)
        servos |= {f"servo {id_}": [FakeServo(model, id_)] for id_, model in config.lone.items()}
        twin = at_end.enter_context(twin_of(servos, now, has_bytes=has_bytes))
        faults = FaultScript(config.faults.values(), servos, twin)
        if isinstance(twin, TwinBus):
            is_other = config.twin == "pty"
            note = "bytes need real time, so servos are simulated without them" if is_other else ""
            return OpenedBus(twin, faults, note)
        path = str(twin.path)
    known = {servo.id: servo.model for joint in joints for servo in joint.servos}
    bus = bus_type(config.kind).open(path, known | config.lone, baud=config.baud, clock=now, is_fast=config.fast)
    at_end.callback(bus.close)
    return OpenedBus(bus, faults)
