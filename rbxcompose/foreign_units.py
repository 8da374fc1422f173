"""What people write for units: other names of those of manifests, and torques as on data sheets of servos."""

from __future__ import annotations

import re
from collections.abc import Mapping

# What people write for a unit whose symbol looks quite different.
OTHER_NAMES: Mapping[str, str] = {
    name: unit
    for unit, names in {
        "m": "meter meters metre metres",
        "in": 'inch inches "',
        "m/s": "mps",
        "s": "sec secs second seconds",
        "min": "minute minutes mins",
        "h": "hour hours hr hrs",
        "km/h": "kmh kph kmph",
        "deg": "degree degrees °",
        "deg/s": "dps",
        "rad": "radian radians",
        "degC": "c °c celsius",
        "Nm": "n*m n·m n.m newtonmeter newtonmetre",
        "%": "percent pct",
        "us": "µs μs",
    }.items()
    for name in names.split()
}
_NO_LETTER = re.compile(r"[^a-z]")
# In [Nm]: gravity is 9.80665 m/s^2, an inch 2.54 cm, an ounce 28.349523 g (NIST SP 811).
_TORQUES: Mapping[str, float] = {
    name: factor
    for factor, names in {
        0.0980665: "kgcm kgfcm cmkg cmkgf",
        9.80665: "kgm kgfm mkg",
        9.80665e-5: "gcm gfcm",
        0.00706155: "ozin ozfin inoz",
        0.112985: "lbin lbfin inlb inlbf",
        1.35582: "lbft lbfft ftlb ftlbf",
        0.01: "ncm",
        0.001: "nmm",
    }.items()
    for name in names.split()
}


def torque_factor(written: str) -> float | None:
    """Return how many [Nm] a unit of torque has, however it is written: `kg-cm`, `kgf·cm`; None for others."""
    return _TORQUES.get(_NO_LETTER.sub("", written.casefold()))
