"""NMEA 0183: sentences with their checksums out of any bytes, and what those of a receiver for satellites say."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import reduce
from operator import xor

from rbxcompose.base.dataclass import dataclass

LONGEST = 120  # characters; the standard allows 82, receivers send longer ones
KNOT = 1852.0 / 3600.0  # [m/s]
_NO_FIX = (0, 6, 7, 8)  # qualities of GGA that no satellite vouches for: none, estimated, entered, simulated
_ERRORS = {1: 4.0, 2: 1.0, 3: 1.0, 4: 0.02, 5: 0.5}  # [m] at an HDOP of 1, by quality
_ANY = 4.0  # [m]


class ImpossibleSentenceError(ValueError):
    """Raised when a sentence with a right checksum says what cannot be."""


@dataclass(frozen=True, slots=True)
class Sentence:
    """A sentence with a right checksum: its talker and type, such as `GPGGA`, and its fields."""

    name: str
    fields: Sequence[str]

    def text(self, number: int) -> str:
        """Return a field; empty if it is not there."""
        return self.fields[number] if number < len(self.fields) else ""

    def number(self, number: int) -> float | None:
        """Return a field as a number; None if it is empty.

        Raises:
            ImpossibleSentenceError: if it is none.
        """
        if not (text := self.text(number)):
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or "_" in text:
            raise ImpossibleSentenceError(f"{self.name}: '{text[:20]}' is no number")
        return value


class SentenceReader:
    """Finds sentences in bytes that come in any pieces, and counts what is none."""

    def __init__(self, faults: Counter[str]) -> None:
        self._faults, self._rest = faults, b""

    def forget(self) -> None:
        """Forget half a sentence."""
        self._rest = b""

    def feed(self, data: bytes) -> list[Sentence]:
        """Return the sentences that are whole now."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LONGEST:
            self._rest = self._rest[-LONGEST:]
            self._faults["garbage"] += 1
        return [sentence for line in lines if (sentence := self._sentence(line.strip(b"\r\n \0"))) is not None]

    def _sentence(self, line: bytes) -> Sentence | None:
        if not line:
            return None
        before, dollar, rest = line.rpartition(b"$")
        body, star, given = rest.rpartition(b"*")
        if not dollar or not star:
            self._faults["half sentences" if dollar else "garbage"] += 1
            return None
        if before:
            self._faults["half sentences"] += 1
        if len(rest) > LONGEST or not rest.isascii() or given.upper() != b"%02X" % checksum(body):
            self._faults["wrong checksums"] += 1
            return None
        name, *fields = body.decode("ascii").split(",")
        return Sentence(name, tuple(fields))


def checksum(body: bytes) -> int:
    """Return the checksum of what is between `$` and `*`."""
    return reduce(xor, body, 0)


@dataclass(frozen=True, slots=True)
class SatelliteFix:
    """Where a receiver is, if `is_fix`: [deg], [m] above the ellipsoid, variances [m^2]; else there is no place."""

    is_fix: bool
    quality: int = 0
    satellites: int = 0
    latitude: float = math.nan
    longitude: float = math.nan
    altitude: float = math.nan
    variance: float = math.nan
    vertical_variance: float = math.nan


@dataclass(frozen=True, slots=True)
class GroundVelocity:
    """How fast a receiver moves to the east and to the north [m/s]."""

    east: float
    north: float


class SatelliteReceiver:
    """What a receiver says: a fix with each GGA, a velocity with each RMC, or with each VTG if no RMC comes."""

    def __init__(self) -> None:
        self.dimensions = 0  # of the fix by GSA: 2 or 3, 1 for none, 0 if it sends no GSA; the most of an epoch
        self.is_valid = True  # by RMC
        self._vdop: float | None = None
        self._is_gsa_due = True  # the next GSA is the first of an epoch; there is one for each system of satellites
        self._has_rmc = False

    def take(self, sentence: Sentence) -> SatelliteFix | GroundVelocity | None:
        """Return what a sentence says anew.

        Raises:
            ImpossibleSentenceError: if it says what cannot be.
        """
        match sentence.name[-3:]:
            case "GGA":
                return self._fix(sentence)
            case "RMC":
                self._has_rmc, self.is_valid = True, sentence.text(1) == "A"
                return _velocity(sentence.number(6), sentence.number(7)) if self.is_valid else None
            case "VTG" if not self._has_rmc and sentence.text(8) not in ("N", "E", "S"):
                return _velocity(sentence.number(4), sentence.number(0))
            case "GSA":
                dimensions, vdop = int(sentence.number(1) or 0), sentence.number(16)
                if self._is_gsa_due or dimensions >= self.dimensions:
                    self.dimensions, self._vdop, self._is_gsa_due = dimensions, vdop, False
        return None

    def _fix(self, sentence: Sentence) -> SatelliteFix:
        self._is_gsa_due = True
        quality, satellites = int(sentence.number(5) or 0), int(sentence.number(6) or 0)
        if quality in _NO_FIX or not self.is_valid or self.dimensions == 1:
            return SatelliteFix(False, quality, satellites)
        latitude = _angle(sentence, 1, "NS", 90.0)
        longitude = _angle(sentence, 3, "EW", 180.0)
        height, geoid = sentence.number(8), sentence.number(10)
        altitude = math.nan if height is None or self.dimensions == 2 else height + (geoid or 0.0)
        error = _ERRORS.get(quality, _ANY)
        flat = (error * (sentence.number(7) or 1.0)) ** 2
        upright = (error * self._vdop) ** 2 if self._vdop else 4.0 * flat
        return SatelliteFix(True, quality, satellites, latitude, longitude, altitude, flat, upright)


def _angle(sentence: Sentence, number: int, signs: str, most: float) -> float:
    """Return an angle [deg] that is written as degrees and minutes, `4807.038,N`."""
    value, sign = sentence.number(number), sentence.text(number + 1)
    if value is None or sign not in (*signs,) or value < 0:
        raise ImpossibleSentenceError(f"{sentence.name}: a fix without a place")
    degrees, minutes = divmod(value, 100.0)
    angle = degrees + minutes / 60.0
    if minutes >= 60.0 or angle > most:
        raise ImpossibleSentenceError(f"{sentence.name}: '{sentence.text(number)}' is no angle")
    return angle if sign == signs[0] else -angle


def _velocity(knots: float | None, course: float | None) -> GroundVelocity | None:
    """Return a velocity; at rest, receivers leave the course out."""
    if knots is None:
        return None
    speed, angle = knots * KNOT, math.radians(course or 0.0)
    return GroundVelocity(speed * math.sin(angle), speed * math.cos(angle)) if course is not None or not speed else None
