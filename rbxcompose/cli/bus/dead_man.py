"""Pure core of `drive`: keys in, velocities out, and silence once no key is pressed."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass

HOLD = 0.3  # [s] that a key counts as pressed; terminals report only presses, and repeat them while a key is held
PERIOD = 0.1  # [s] between two commands

_ENDS = ("q", "\x04", "\0")  # Ctrl-D arrives as a zero byte if it was typed before the terminal was raw

_FORWARD, _BACK, _LEFT, _RIGHT = (1, 0), (-1, 0), (0, 1), (0, -1)
_STILL = (0, 0)
_KEYS = {
    "w": _FORWARD,
    "s": _BACK,
    "a": _LEFT,
    "d": _RIGHT,
    "\x1b[A": _FORWARD,
    "\x1b[B": _BACK,
    "\x1b[D": _LEFT,
    "\x1b[C": _RIGHT,
    "\x1bOA": _FORWARD,
    "\x1bOB": _BACK,
    "\x1bOD": _LEFT,
    "\x1bOC": _RIGHT,
    " ": _STILL,
}


@dataclass(frozen=True, slots=True)
class Velocity:
    """A command: forward [m/s], and turn [rad/s], positive to the left."""

    speed: float = 0.0
    turn: float = 0.0


def keys(text: str) -> list[str]:
    """Return the keys that a terminal has sent; the escape sequence of an arrow key counts as one key."""
    found: list[str] = []
    while text:
        length = 3 if text[:3] in _KEYS else 1
        found.append(text[:length].lower() if length == 1 else text[:length])
        text = text[length:]
    return found


def is_end(key: str) -> bool:
    """Return whether a key ends driving: q, or the end of input."""
    return key in _ENDS


class DeadMan:
    """Commands motion only within `HOLD` of a key press; then commands a halt, once, and is silent."""

    def __init__(self, speed: float, turn: float) -> None:
        """Set full speed [m/s] and full turn [rad/s]."""
        self._speed, self._turn = speed, turn
        self._wanted = Velocity()
        self._until = 0.0  # [s]
        self._is_moving = False  # the last command was not a halt

    def press(self, key: str, now: float) -> Velocity | None:
        """Handle a key at `now` [s]; return the command to send immediately, or None if it can wait."""
        direction = _KEYS.get(key)
        if direction is None:
            return None
        before = self._wanted if self._is_moving else None
        self._wanted = Velocity(direction[0] * self._speed, direction[1] * self._turn)
        self._until = now + HOLD
        if direction == _STILL:
            self._until = now  # nothing more is due
            self._is_moving = False
            return Velocity()
        self._is_moving = True
        return self._wanted if self._wanted != before else None

    def due(self, now: float) -> Velocity | None:
        """Return the command for `now` [s], to be called every `PERIOD`; None for silence."""
        if not self._is_moving:
            return None
        if now < self._until:
            return self._wanted
        return self.release()

    def release(self) -> Velocity | None:
        """Return the final command before silence; None if already silent."""
        was_moving, self._is_moving = self._is_moving, False
        return Velocity() if was_moving else None
