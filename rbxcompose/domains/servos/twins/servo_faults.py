"""What can go wrong with a simulated servo, and when: a closed set of faults by name, and their script."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from types import MappingProxyType
from typing import Any, Literal, Protocol

from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Command, Query, Refused
from rbxcompose.base.units import MOST

UNPLUG = "unplug"
"""The fault of a bus as a whole: its port has gone."""
FaultName = Literal[
    "overheat", "overload", "undervoltage", "jam", "power_off", "mute", "late", "garbage", "corrupt", "wrong_id",
    "twice", "unplug",
]  # fmt: skip
"""All faults."""


@dataclass(slots=True)
class ServoFaults:
    """What is wrong with a servo until it is set back: with its replies, and with what is inside."""

    is_mute: bool = False
    silences_next: bool = False
    """While mute, those after it in a group keep waiting for its reply, too."""
    delay: float = 0.0
    """How much later each reply is [s]."""
    garbage: bytes = b""
    """Stands before each reply."""
    corrupts: bool = False
    """Flips a bit of each reply."""
    cuts: int = 0
    """How many bytes at the end of each reply are missing."""
    id: int | None = None
    """Replies carry this id."""
    repeats: int = 1
    """How often each reply is sent."""
    is_off: bool = False
    """It has no power."""
    is_jammed: bool = False
    """Its shaft does not turn."""
    is_hot: bool = False
    """It is as hot as it may be."""
    load: float = 0.0
    """What is put on it, of the most, beside all else."""
    missing: float = 0.0
    """How much of the supply is missing [V]."""


@dataclass(frozen=True, slots=True)
class ServoFault:
    """A fault with a name: what it is, and which `ServoFaults` it sets while it lasts."""

    about: str
    effect: Mapping[str, Any] = field(default_factory=dict)


FAULTS: Mapping[str, ServoFault] = MappingProxyType(
    {
        "overheat": ServoFault("is as hot as it may be, and cools down afterwards", {"is_hot": True}),
        "overload": ServoFault("carries too much and shuts down", {"load": 1.5}),
        "undervoltage": ServoFault("gets 5 V", {"missing": 7.0}),
        "jam": ServoFault("does not turn, however it pushes", {"is_jammed": True}),
        "power_off": ServoFault("has no power, and starts again afterwards", {"is_off": True}),
        "mute": ServoFault("does not answer, but obeys", {"is_mute": True}),
        "late": ServoFault("answers after 50 ms", {"delay": 0.05}),
        "garbage": ServoFault("sends nonsense before each answer", {"garbage": b"\xff\x00\x5a"}),
        "corrupt": ServoFault("flips a bit of each answer", {"corrupts": True}),
        "wrong_id": ServoFault("answers as id 253", {"id": 253}),
        "twice": ServoFault("answers twice", {"repeats": 2}),
    }
)
"""The faults of a servo by name. What one of them does ends with it; what follows, such as a shutdown, may stay."""


def servo_faults(names: Iterable[str]) -> ServoFaults:
    """Return what is wrong with a servo that has these faults."""
    return ServoFaults(**{trait: value for name in names for trait, value in FAULTS[name].effect.items()})


@dataclass(frozen=True, slots=True)
class InjectFault(Command):
    """Let something go wrong with a simulated joint, or without one with all of its bus, for a time [s] or for good."""

    about = "servo_bus"
    fault: str
    joint: str = ""
    lasts: float | None = None

    @property
    def words(self) -> str:
        """Return it as a person would say it."""
        lasting = "" if self.lasts is None else f" for {self.lasts:g} s"
        return f"{self.fault} of {self.joint or 'the bus'}{lasting}"


@dataclass(frozen=True, slots=True)
class ListFaults(Query[Mapping[str, str]]):
    """Return what may go wrong with the simulated servos of a bus: what a servo then does, by the name of a fault."""

    about = "servo_bus"
    component: str


class TwinFault(Config):
    """Something that goes wrong with simulated servos."""

    at: float
    """When it begins [s]; in a script, counted from the activation."""
    fault: FaultName
    """What goes wrong."""
    joint: str = ""
    """The joint; without it the bus as a whole."""
    lasts: float | None = None
    """How long it lasts [s]; without it for good."""

    def is_present(self, now: float) -> bool:
        """Return whether it is there at a time [s]."""
        return self.at <= now and (self.lasts is None or now < self.at + self.lasts)


class Faulty(Protocol):
    """What can have faults: a simulated servo."""

    faults: ServoFaults


class Plug(Protocol):
    """What can be unplugged: a port, or a bus without one."""

    def unplug(self) -> None:
        """Take the port away."""

    def replug(self) -> None:
        """Bring it back."""


class FaultScript:
    """Lets faults begin and end: those of a script, whose times count from `start`, and those of requests.

    `servos` are those of each joint.
    """

    def __init__(self, faults: Iterable[TwinFault], servos: Mapping[str, Sequence[Faulty]], plug: Plug) -> None:
        self._script, self._servos, self._plug = tuple(faults), servos, plug
        self._faults = list(self._script)
        self._present: list[TwinFault] = []

    def start(self, now: float) -> None:
        """Let the script begin at a time [s]."""
        self._faults = [one.model_copy(update={"at": one.at + now}) for one in self._script]

    def inject(self, request: InjectFault, now: float) -> str:
        """Let a fault begin now [s]; return that it does.

        Raises:
            Refused: if there is no such fault or joint.
        """
        if request.fault != UNPLUG and request.fault not in FAULTS:
            raise Refused(f"no fault is called '{request.fault}'")
        if request.joint and (request.joint not in self._servos or request.fault == UNPLUG):
            raise Refused(f"'{request.joint}' is no joint that can have the fault '{request.fault}'")
        if request.lasts is not None and not 0 < request.lasts < MOST:  # false for NaN, too
            raise Refused("a fault lasts for a finite time above 0 s, or without one for good")
        self._faults.append(TwinFault(at=now, fault=request.fault, joint=request.joint, lasts=request.lasts))
        return f"{request.words} begins"

    def play(self, now: float) -> None:
        """Let begin and end what is due at a time [s]."""
        present = [fault for fault in self._faults if fault.is_present(now)]
        if present == self._present:
            return
        was_out, is_out = (any(item.fault == UNPLUG for item in each) for each in (self._present, present))
        for joint, servos in self._servos.items():
            before, after = _names(self._present, joint), _names(present, joint)
            for servo in servos if before != after else ():
                servo.faults = servo_faults(after)
        if is_out and not was_out:
            self._plug.unplug()
        elif was_out and not is_out:
            self._plug.replug()
        self._present = present


def _names(faults: Iterable[TwinFault], joint: str) -> list[str]:
    return [fault.fault for fault in faults if fault.joint in ("", joint) and fault.fault != UNPLUG]
