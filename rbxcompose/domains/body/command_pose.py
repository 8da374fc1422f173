"""`body pose`: keys in, positions of joints out, shown and published on the bus."""

from __future__ import annotations

import argparse
import math
import random
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType

from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.printable import columns, fitted, plain
from rbxcompose.base.units import ANGLE, LENGTH, NUMBER, Dimension, UnitError, example, format_number, parse_quantity
from rbxcompose.bus.graph import find
from rbxcompose.bus.topics import Publisher
from rbxcompose.commands.console import NotDoneError, emit, misused, refuse
from rbxcompose.commands.guest import NAME, NOBODY, Guest, visit
from rbxcompose.commands.terminal import NO_TERMINAL, LiveScreen, is_terminal
from rbxcompose.domains.body.command_body import ReceivedFrames, described, described_body
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.body.source import UNKNOWN
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.ports import Qos

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
HEARD = 1.5  # [s] in which transforms of all joints should come
_JOINTS = "joint_states"


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


def pose(arguments: argparse.Namespace) -> int:
    """Move the joints of a robot by sliders, or to the positions that are given."""
    if arguments.duration is not None and not arguments.joint:
        return misused("body", "--duration is for the positions of --joint")
    if not arguments.joint and not is_terminal():
        message = "there is no terminal for the sliders"
        return refuse(NO_TERMINAL.at(None, message, help="name the positions: --joint NAME=POSITION"))
    arguments.robot = arguments.robot or arguments.name
    return visit(arguments, lambda guest: _posed(guest, arguments))


def _posed(guest: Guest, arguments: argparse.Namespace) -> int:
    topic = described(guest, arguments.topic)
    body = described_body(guest, topic, arguments.timeout)
    sliders = sliders_of(body)
    if not sliders:
        return refuse(UNKNOWN.at(None, "the body has no joint that moves"))
    try:
        positions = dict(_position(sliders, written) for written in arguments.joint)
    except ValueError as error:
        return misused("body", str(error))
    name = f"{topic.name.rpartition('/')[0]}/{_JOINTS}"
    publisher = _publisher(guest, name, arguments.timeout)
    if positions:
        return _send(guest, publisher, positions, name, arguments.duration)
    panel = SliderPanel(sliders, random.SystemRandom().uniform, _start(guest, body))
    return _slide(guest, publisher, panel, name)


def _start(guest: Guest, body: Body) -> dict[str, float]:
    """Return where the joints are now, as far as they are published: opening the sliders moves nothing."""
    frames = ReceivedFrames(guest)
    guest.run(lambda: all(frames.tree.parent_of(joint.child) for joint in body.moving), HEARD)
    found = ((joint, frames.tree.lookup(joint.parent, joint.child)) for joint in body.moving)
    return {joint.name: joint.position_of(pose) for joint, pose in found if pose is not None}


def _position(sliders: list[Slider], written: str) -> tuple[str, float]:
    """Return the joint and the position that `--joint` names.

    Raises:
        NotDoneError: if there is no such joint.
        ValueError: if the position is wrong.
    """
    name, equals, value = written.partition("=")
    if not equals:
        raise ValueError(f"--joint needs NAME=POSITION, not '{written}'")
    slider = next((candidate for candidate in sliders if candidate.name == name), None)
    if slider is None:
        message = f"there is no joint '{plain(name)}' that moves by itself"
        raise NotDoneError(UNKNOWN.misspelt(None, message, name, [one.name for one in sliders], "joints"))
    return name, slider.read(value)


def _publisher(guest: Guest, name: str, timeout: float) -> Publisher[JointState]:
    topic = find(guest.graph().topics, name)
    of_type = [kind for kind in (topic.kinds if topic else ()) if kind.type == JointState.TYPE]
    publisher = guest.bus(of_type[0] if of_type else None).publisher(NAME, name, JointState, Qos.STATE)
    if not guest.run(lambda: publisher.has_match, timeout):
        raise NotDoneError(NOBODY.at(None, f"nothing takes positions of joints on '{plain(name)}'"))
    return publisher


def _message(guest: Guest, positions: Mapping[str, float]) -> JointState:
    stamp = Header(stamp=to_time(guest.clock.stamp()))
    return JointState(header=stamp, name=tuple(positions), position=np.array([*positions.values()]))


def _send(
    guest: Guest, publisher: Publisher[JointState], positions: Mapping[str, float], name: str, duration: float | None
) -> int:
    """Publish positions once, or for some time [s]."""
    end, sent = guest.clock.now() + (duration or 0.0), 0
    with guest.interruptible():
        while not guest.is_interrupted and (sent == 0 or guest.clock.now() < end):
            publisher(_message(guest, positions))
            sent += 1
            guest.run(lambda: guest.is_interrupted, min(PERIOD, max(0.0, end - guest.clock.now())))
    emit(f"{name}: {sent} sent")
    return 0


def _slide(guest: Guest, publisher: Publisher[JointState], panel: SliderPanel, name: str) -> int:
    """Show sliders until q, an interrupt, or the end of the terminal."""
    with LiveScreen() as screen, guest.interruptible():
        sliders = _Sliders(guest, publisher, panel, name, screen)
        sliders.pressed(screen.typed_early())  # such keys move nothing, but may end the command
        if not screen.is_over:
            guest.watch(screen.keyboard, sliders.read)
            guest.scheduler.every(PERIOD, NAME, lambda dt: sliders.send())
            sliders.send()
            guest.run(lambda: screen.is_over or guest.is_interrupted)
    return 0


class _Sliders:
    """Turns keys into messages, and shows the sliders."""

    def __init__(
        self, guest: Guest, publisher: Publisher[JointState], panel: SliderPanel, title: str, screen: LiveScreen
    ) -> None:
        self._guest, self._publisher, self._panel, self._screen = guest, publisher, panel, screen
        self._picture = partial(panel.lines, title)
        self._begun = ""  # of a key whose rest has not arrived yet

    def read(self) -> None:
        """Handle the pressed keys."""
        changes = [self._panel.press(key) for key in self.pressed(self._screen.typed())]
        if any(changes):
            self.send()
        else:
            self._screen.draw(self._picture)

    def pressed(self, text: str) -> list[str]:
        """Return the keys in what was typed; some end the command."""
        keys, self._begun = split_keys(self._begun + text)
        self._screen.is_over = self._screen.is_over or any(map(is_end, keys))
        return keys

    def send(self) -> None:
        """Publish all positions, and show them."""
        self._publisher(_message(self._guest, self._panel.positions))
        self._screen.draw(self._picture)
