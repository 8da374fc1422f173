"""Items of a control table: where a value stands in a servo's memory, and what it means in SI."""

from __future__ import annotations

from enum import Enum

from rbxcompose.dataclass import dataclass

_DIRECTION = 10  # bit of a speed or load in protocol 1.0: set means clockwise, which is negative


class Coding(Enum):
    """How a value is written in its bytes, least significant first."""

    UNSIGNED = "u"
    SIGNED = "s"
    """Two's complement."""
    DIRECTION = "d"
    """Bits 0 to 9 are the amount, bit 10 the direction."""


@dataclass(frozen=True, slots=True)
class ControlItem:
    """One item: `size` bytes [B] at `address`; `(raw - centre) * per_raw` is its value in `unit`.

    The unit is 'rad', 'rad/s', 'rad/s^2', 'V', 'A', 's', 'degC', '1' (a fraction of the most), or '' for a code.
    """

    name: str
    address: int
    size: int
    coding: Coding = Coding.UNSIGNED
    per_raw: float = 1.0
    unit: str = ""
    centre: int = 0

    @property
    def end(self) -> int:
        """Return the address behind its last byte."""
        return self.address + self.size

    @property
    def least(self) -> int:
        """Return the smallest raw value that its bytes can hold."""
        match self.coding:
            case Coding.SIGNED:
                return -(1 << (8 * self.size - 1))
            case Coding.DIRECTION:
                return 1 - (1 << _DIRECTION)
        return 0

    @property
    def most(self) -> int:
        """Return the largest raw value that its bytes can hold."""
        match self.coding:
            case Coding.SIGNED:
                return (1 << (8 * self.size - 1)) - 1
            case Coding.DIRECTION:
                return (1 << _DIRECTION) - 1
        return (1 << (8 * self.size)) - 1

    def decode(self, data: bytes) -> int:
        """Return the raw value, with its sign, of `size` bytes."""
        value = int.from_bytes(data, "little", signed=self.coding is Coding.SIGNED)
        if self.coding is not Coding.DIRECTION:
            return value
        amount = value & self.most
        return -amount if value >> _DIRECTION & 1 else amount

    def encode(self, raw: int) -> bytes:
        """Return the bytes of a raw value.

        Raises:
            ValueError: if they cannot hold it.
        """
        try:
            if self.coding is not Coding.DIRECTION:
                return raw.to_bytes(self.size, "little", signed=self.coding is Coding.SIGNED)
            if self.least <= raw <= self.most:
                return (-raw | 1 << _DIRECTION if raw < 0 else raw).to_bytes(self.size, "little")
        except OverflowError:
            pass  # told below, with the range
        raise ValueError(f"{self.name} must be {self.least} to {self.most}, not {raw}")

    def to_si(self, raw: int) -> float:
        """Return the value of a raw value, in `unit`."""
        return (raw - self.centre) * self.per_raw

    def to_raw(self, value: float) -> int:
        """Return the raw value that is nearest to a value in `unit`; it need not fit into the bytes."""
        return round(value / self.per_raw) + self.centre
