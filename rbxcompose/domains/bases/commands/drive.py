"""Drive with the keyboard: arrows or w, a, s, d; space stops, q quits.

It publishes on the input `teleop` of the base's mux, or else on its open input of the highest priority. The robot moves
only while a key is pressed: 0.3 s after the last one it is sent a stop. Then nothing more is published, so that the mux
lets other inputs through.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Mapping, Sequence

from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.base.units import ANGULAR_SPEED, SPEED
from rbxcompose.bus.graph import GraphName
from rbxcompose.bus.topics import Publisher
from rbxcompose.commands.console import NotDoneError, emit, refuse
from rbxcompose.commands.guest import NAME, NO_NAME, NOBODY, Guest, visit
from rbxcompose.commands.lookup import add_bus_options, find_robot, known_state
from rbxcompose.commands.options import add_timeout_option, positive
from rbxcompose.commands.terminal import NO_TERMINAL, LiveScreen
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.poses import twist_message
from rbxcompose.sdk.capabilities import TELEOP
from rbxcompose.sdk.ports import Qos

GROUP = "drive"
IS_COMMON = True
_HELP = "ready: arrows or w a s d: drive   space: stop   q: quit"
HOLD = 0.3  # [s] that a key counts as pressed; terminals report only presses, and repeat them while a key is held
PERIOD = 0.1  # [s] between two commands
_ENDS = ("q", "\x04", "\0")  # Ctrl-D arrives as a zero byte if it was typed before the terminal was raw
_FORWARD, _BACK, _LEFT, _RIGHT = (1, 0), (-1, 0), (0, 1), (0, -1)
_STILL = (0, 0)
_USUAL = f"/cmd_vel/{TELEOP}"  # where several inputs are free, and nothing is known of their priorities
_OPEN_ONE = "give the mux an input without 'from', such as 'teleop: {priority: 100, timeout: 0.5 s}'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    speed, turn = positive(SPEED), positive(ANGULAR_SPEED)
    parser.add_argument("--speed", type=speed, default=0.2, metavar="V", help="forward and back (default: 0.2 m/s)")
    parser.add_argument(
        "--turn", type=turn, default=math.radians(45.0), metavar="V", help="left and right (default: 45 deg/s)"
    )
    parser.add_argument("--topic", metavar="TOPIC", help="the topic that takes velocities (default: found)")
    add_timeout_option(parser, "2s")
    add_bus_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Drive until q, an interrupt, or the end of the terminal or its input."""
    if not sys.stdin.isatty():
        return refuse(NO_TERMINAL.at(None, "there is no terminal to read keys from"))
    return visit(arguments, lambda guest: _drive(guest, arguments))


def _drive(guest: Guest, arguments: argparse.Namespace) -> int:
    name = command_topic(guest.graph().topics, arguments.topic, _inputs(arguments))
    publisher = guest.bus().publisher(NAME, name, Twist, Qos.COMMAND)
    if not guest.run(lambda: publisher.has_match, arguments.timeout):
        return refuse(NOBODY.at(None, f"nothing takes velocities on '{name}'"))
    wheel = _Wheel(guest, publisher, DeadMan(arguments.speed, arguments.turn))
    with LiveScreen() as screen, guest.interruptible():
        wheel.pressed(screen, screen.typed_early())  # such keys move nothing, but may end driving
        if screen.is_over:
            return 0
        emit(_HELP)
        try:
            guest.watch(screen.keyboard, lambda: wheel.read(screen))
            guest.run(lambda: screen.is_over or guest.is_interrupted)
        finally:
            wheel.let_go()
    return 0


def _inputs(arguments: argparse.Namespace) -> Mapping[str, str] | None:
    """Return the open input of each base; None on the bus of a robot that is not of this machine."""
    if arguments.router is not None:
        return None
    state = known_state(find_robot(arguments.robot))
    return None if state is None else state.teleoperated


class _Wheel:
    """Turns keys into commands."""

    def __init__(self, guest: Guest, publisher: Publisher[Twist], dead_man: DeadMan) -> None:
        self._guest, self._publisher, self._dead_man = guest, publisher, dead_man
        guest.scheduler.every(PERIOD, NAME, lambda dt: self._send(dead_man.due(guest.clock.now())))

    def read(self, screen: LiveScreen) -> None:
        """Handle the pressed keys."""
        for key in self.pressed(screen, screen.typed()):
            self._send(self._dead_man.press(key, self._guest.clock.now()))

    def pressed(self, screen: LiveScreen, text: str) -> list[str]:
        """Return the keys in what was typed; some end driving."""
        pressed = keys(text)
        screen.is_over = screen.is_over or any(map(is_end, pressed))
        return pressed

    def let_go(self) -> None:
        """Command a halt, then be silent."""
        self._send(self._dead_man.release())

    def _send(self, velocity: Velocity2 | None) -> None:
        if velocity is not None:
            self._publisher(twist_message(velocity))


_ARROWS = {"A": _FORWARD, "B": _BACK, "D": _LEFT, "C": _RIGHT}
_KEYS = {
    "w": _FORWARD,
    "s": _BACK,
    "a": _LEFT,
    "d": _RIGHT,
    " ": _STILL,
    **{f"\x1b{mode}{end}": way for mode in "[O" for end, way in _ARROWS.items()},
}
_KEY = re.compile(r"\x1b[\[O][ABCD]|.", re.DOTALL)


def keys(text: str) -> list[str]:
    """Return the keys that a terminal has sent; the escape sequence of an arrow key counts as one key."""
    return [key if len(key) > 1 else key.lower() for key in _KEY.findall(text)]


def is_end(key: str) -> bool:
    """Return whether a key ends driving: q, or the end of input."""
    return key in _ENDS


class DeadMan:
    """Commands motion only within `HOLD` of a key press; then commands a halt, once, and is silent."""

    def __init__(self, speed: float, turn: float) -> None:
        """Set full speed [m/s] and full turn [rad/s]."""
        self._speed, self._turn = speed, turn
        self._wanted = AT_REST
        self._until = 0.0  # [s]
        self._is_moving = False  # the last command was not a halt

    def press(self, key: str, now: float) -> Velocity2 | None:
        """Handle a key at `now` [s]; return the command to send immediately, or None if it can wait."""
        direction = _KEYS.get(key)
        if direction is None:
            return None
        before = self._wanted if self._is_moving else None
        self._wanted = Velocity2(direction[0] * self._speed, direction[1] * self._turn)
        self._until = now + HOLD
        if direction == _STILL:
            self._until = now  # nothing more is due
            self._is_moving = False
            return AT_REST
        self._is_moving = True
        return self._wanted if self._wanted != before else None

    def due(self, now: float) -> Velocity2 | None:
        """Return the command for `now` [s], to be called every `PERIOD`; None for silence."""
        if not self._is_moving:
            return None
        if now < self._until:
            return self._wanted
        return self.release()

    def release(self) -> Velocity2 | None:
        """Return the final command before silence; None if already silent."""
        was_moving, self._is_moving = self._is_moving, False
        return AT_REST if was_moving else None


def command_topic(topics: Sequence[GraphName], wanted: str | None, inputs: Mapping[str, str] | None) -> str:
    """Return the topic on which to publish velocities: the `wanted` one, or the only one that is right.

    `inputs` has the open input of each base of the robot; None if only its bus is known. Then what counts is what
    nobody publishes on, and what lies behind no node that forwards velocities.

    Raises:
        NotDoneError: if nothing takes velocities there, or if there are several.
    """
    taking = [topic for topic in topics if topic.takers and Twist.TYPE in topic.types]
    names = [topic.name for topic in taking if not _is_forwarded(topic, taking)]
    if wanted is not None:
        full = f"/{wanted.lstrip('/')}"
        if any(topic.name == full for topic in taking):
            return full
        words = f"nothing takes velocities on '{full}'"
        raise NotDoneError(NO_NAME.misspelt(None, words, full, names, "topics that take velocities"))
    if inputs is not None:
        return _only(sorted(set(inputs.values())), inputs)
    free = [topic.name for topic in taking if topic.name in names and not topic.givers]
    usual = [name for name in free if name.endswith(_USUAL)]
    return _only(usual if len(usual) == 1 else free, {})


def _only(names: Sequence[str], inputs: Mapping[str, str]) -> str:
    if len(names) == 1:
        return names[0]
    if not names:
        raise NotDoneError(NO_NAME.at(None, "no topic is free for the velocities of a person", help=_OPEN_ONE))
    bases = {topic: base for base, topic in inputs.items()}
    listed = ", ".join(f"{name} ('{bases[name]}')" if name in bases else name for name in names)
    raise NotDoneError(NO_NAME.at(None, f"several topics take velocities: {listed}", help="choose one with '--topic'"))


def _is_forwarded(topic: GraphName, taking: Sequence[GraphName]) -> bool:
    """Return whether one who publishes here takes velocities elsewhere, as a mux does."""
    givers = {end.node for end in topic.givers}
    return any(end.node in givers for other in taking if other is not topic for end in other.takers)
