"""What can go wrong with a simulated servo: a closed set of faults by name, and what each of them does to it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Any, Literal

from rbxcompose.base.dataclass import dataclass

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
