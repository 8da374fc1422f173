"""Drive with the keyboard: arrows or w, a, s, d; space stops, q quits.

It publishes on the open input of the base's mux that has the highest priority. The robot moves only while a key is
pressed: 0.3 s after the last one it is sent a stop. Then nothing more is published, so that the mux lets other inputs
through.
"""

from __future__ import annotations

import argparse
import math
import os
import select
import sys
from collections.abc import Mapping

from rbxcompose.bus.topics import Publisher
from rbxcompose.cli.bus.command_topic import command_topic
from rbxcompose.cli.bus.dead_man import PERIOD, DeadMan, Velocity, is_end, keys
from rbxcompose.cli.bus.entities import NOBODY, add_timeout_option, positive, visit
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.place import add_bus_options
from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.output.terminal import NO_TERMINAL, raw
from rbxcompose.cli.robots.lookup import find_robot, known_state
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.qos import Qos
from rbxcompose.units import ANGULAR_SPEED, SPEED

_HELP = "ready: arrows or w a s d: drive   space: stop   q: quit"
_MOST_READ = 4096  # bytes of keys per read


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
    with guest.interruptible(), raw(sys.stdin.fileno()):
        wheel.read_early()
        if wheel.is_over:
            return 0
        tell(_HELP)
        try:
            guest.watch(sys.stdin.fileno(), wheel.read)
            guest.run(lambda: wheel.is_over or guest.is_interrupted)
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
        self.is_over = False
        self._guest, self._publisher, self._dead_man = guest, publisher, dead_man
        guest.scheduler.every(PERIOD, NAME, lambda dt: self._send(dead_man.due(guest.clock.now())))

    def read(self) -> None:
        """Handle the pressed keys."""
        for key in self._pressed():
            self._send(self._dead_man.press(key, self._guest.clock.now()))

    def read_early(self) -> None:
        """Handle keys that were pressed before the start: they move nothing, but may end driving."""
        if select.select([sys.stdin], [], [], 0)[0]:
            self._pressed()

    def _pressed(self) -> list[str]:
        data = os.read(sys.stdin.fileno(), _MOST_READ)
        pressed = keys(data.decode(errors="replace"))
        self.is_over = self.is_over or not data or any(map(is_end, pressed))
        return pressed

    def let_go(self) -> None:
        """Command a halt, then be silent."""
        self._send(self._dead_man.release())

    def _send(self, velocity: Velocity | None) -> None:
        if velocity is not None:
            self._publisher(Twist(linear=Vector3(x=velocity.speed), angular=Vector3(z=velocity.turn)))
