"""Pure core of `body pose`: keys in, positions of joints out, and the lines that show them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from rbxcompose.body.model import Body, BodyJoint
from rbxcompose.dataclass import dataclass
from rbxcompose.printable import columns, fitted, plain
from rbxcompose.units import ANGLE, LENGTH, NUMBER, Dimension, UnitError, example, format_number, parse_quantity

PERIOD = 0.1  # [s] between two messages
HELP = (
    "up/down: joint   left/right: move, with shift 10x   q: quit",
    "0: zero   c: centre   r: random   Z C R: so with all joints",
)
_COARSE = 10  # small steps in a large one
_FREE = 1.0  # [m] of a slide without limits, to each side
_MOST_OF_NAMES = 28  # columns
_LEAST_BAR = 8  # columns
_ENDS = ("q", "\x04", "\0")  # Ctrl-D arrives as a zero byte if it was typed before the terminal was raw
_KEY = re.compile(r"\x1b[\[O][0-9;]*[A-Za-z~]|[^\x1b]")
_BEGUN = re.compile(r"\x1b(?:[\[O][0-9;]*)?\Z")
_SELECT = {"\x1b[A": -1, "\x1bOA": -1, "\x1b[B": 1, "\x1bOB": 1}
_MOVE = {
    **dict.fromkeys(("\x1b[C", "\x1bOC"), 1),
    **dict.fromkeys(("\x1b[D", "\x1bOD"), -1),
    **dict.fromkeys(("\x1b[1;2C", "\x1b[5~"), _COARSE),
    **dict.fromkeys(("\x1b[1;2D", "\x1b[6~"), -_COARSE),
}

Draw = Callable[[float, float], float]


@dataclass(frozen=True, slots=True)
class Slider:
    """A joint that a person moves, with its range and its start [rad or m]."""

    name: str
    turns: bool
    lower: float
    upper: float
    rest: float

    @property
    def step(self) -> float:
        """Return a small step: 1 deg or 1 cm."""
        return math.radians(1.0) if self.turns else 0.01

    @property
    def dimension(self) -> Dimension:
        """Return what its position measures."""
        return ANGLE if self.turns else LENGTH

    def within(self, position: float) -> float:
        """Return the position nearest to this one within the range."""
        return min(max(position, self.lower), self.upper)

    def words(self, position: float) -> str:
        """Return a position for people: "-12.5 deg", "4.2 cm"."""
        shown = math.degrees(position) if self.turns else position * 100
        return f"{format_number(round(shown, 1) + 0.0)} {'deg' if self.turns else 'cm'}"

    def read(self, text: str) -> float:
        """Return the position [rad or m] that a text names; a bare number is in rad or m.

        Raises:
            ValueError: if it is none, or not within the range.
        """
        try:
            quantity = parse_quantity(text)
        except UnitError as error:
            raise ValueError(f"'{self.name}': {error.message}") from None
        if quantity.dimension not in (self.dimension, NUMBER):
            wanted = f"{self.dimension.phrase}, such as '{example(self.dimension)}'"
            raise ValueError(f"the position of '{self.name}' must be {wanted}, not {quantity.dimension.phrase}")
        if self.within(quantity.value) != quantity.value:
            limits = f"{self.words(self.lower)} and {self.words(self.upper)}"
            raise ValueError(f"the position of '{self.name}' must be between {limits}, not '{text}'")
        return quantity.value


def sliders_of(body: Body) -> list[Slider]:
    """Return a slider for each joint that has a position of its own."""
    return [_slider(joint) for joint in body.moving]


def _slider(joint: BodyJoint) -> Slider:
    turns, limits = joint.kind != "prismatic", joint.limits
    free = math.pi if turns else _FREE
    lower, upper = -free, free
    if limits is not None and joint.kind != "continuous":
        lower, upper = limits.lower or 0.0, limits.upper or 0.0
    return Slider(joint.name, turns, lower, upper, joint.rest)


def split_keys(text: str) -> tuple[list[str], str]:
    """Return the keys that a terminal has sent, and the begin of one whose rest has not arrived yet."""
    begun = _BEGUN.search(text)
    rest = begun.group() if begun else ""
    return _KEY.findall(text.removesuffix(rest)), rest


def is_end(key: str) -> bool:
    """Return whether a key ends the command: q, or the end of input."""
    return key in _ENDS


class SliderPanel:
    """The positions of all sliders, of which one is selected; `draw` returns a random number between two others.

    They begin at `start`, by joint; those that are not there, at rest.
    """

    def __init__(
        self, sliders: Sequence[Slider], draw: Draw, start: Mapping[str, float] = MappingProxyType({})
    ) -> None:
        self.sliders = sliders
        self._draw = draw
        self._selected = 0
        self._positions = [slider.within(start.get(slider.name, slider.rest)) for slider in sliders]

    @property
    def positions(self) -> Mapping[str, float]:
        """Return the positions [rad or m] by joint."""
        return {slider.name: at for slider, at in zip(self.sliders, self._positions, strict=True)}

    @property
    def selected(self) -> str:
        """Return the name of the joint that keys move."""
        return self.sliders[self._selected].name

    def press(self, key: str) -> bool:
        """Handle a key; return whether a position has changed."""
        if key in _SELECT:
            self._selected = (self._selected + _SELECT[key]) % len(self.sliders)
            return False
        every = range(len(self.sliders)) if key in ("Z", "C", "R") else [self._selected]
        before = list(self._positions)
        for number in every:
            self._positions[number] = self._moved(self.sliders[number], self._positions[number], key)
        return self._positions != before

    def _moved(self, slider: Slider, at: float, key: str) -> float:
        if key in _MOVE:
            return slider.within(at + _MOVE[key] * slider.step)
        match key:
            case "0" | "Z":
                return slider.within(0.0)
            case "c" | "C":
                return (slider.lower + slider.upper) / 2
            case "r" | "R":
                return slider.within(self._draw(slider.lower, slider.upper))
        return at

    def lines(self, title: str, width: int, height: int) -> list[str]:
        """Return what a screen of this size shows: as many sliders as fit, the selected one among them."""
        room = max(1, height - 3 - len(HELP))
        first = min(max(0, self._selected - room // 2), max(0, len(self.sliders) - room))
        shown = range(first, min(first + room, len(self.sliders)))
        names = min(_MOST_OF_NAMES, max(columns(plain(slider.name)) for slider in self.sliders))
        count = f" ({self._selected + 1} of {len(self.sliders)})"
        lines = [f"{plain(title)}{count}", "", *(self._line(number, names, width) for number in shown), "", *HELP]
        return [fitted(line, width) for line in lines][-max(1, height) :]

    def _line(self, number: int, names: int, width: int) -> str:
        slider, at = self.sliders[number], self._positions[number]
        name = fitted(plain(slider.name), names)
        mark, space = ">" if number == self._selected else " ", " " * (names - columns(name))
        begin = f"{mark} {name}{space} {slider.words(at):>10}  {slider.words(slider.lower):>10} "
        end = f" {slider.words(slider.upper)}"
        return f"{begin}{bar(slider, at, max(_LEAST_BAR, width - columns(begin) - 13))}{end}"


def bar(slider: Slider, at: float, width: int) -> str:
    """Return where a position is in its range, as a picture of `width` columns: [----#-----]."""
    inside = width - 2
    span = slider.upper - slider.lower
    place = round((slider.within(at) - slider.lower) / span * (inside - 1)) if span > 0 else 0
    return f"[{'-' * place}#{'-' * (inside - 1 - place)}]"
