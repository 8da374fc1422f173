"""`body pose` on the bus: the description that it reads, the positions that it publishes, keys and screen."""

from __future__ import annotations

import argparse
import os
import random
import select
import shutil
import sys
from collections.abc import Mapping

import numpy as np

from rbxcompose.body.model import Body
from rbxcompose.bus.graph import find
from rbxcompose.bus.topics import Publisher
from rbxcompose.cli.bodies.actions import UNKNOWN
from rbxcompose.cli.bodies.heard_body import described, described_body
from rbxcompose.cli.bodies.sliders import PERIOD, Slider, SliderPanel, is_end, sliders_of, split_keys
from rbxcompose.cli.bus.entities import NOBODY, visit
from rbxcompose.cli.bus.guest import NAME, Guest
from rbxcompose.cli.bus.heard_frames import HeardFrames
from rbxcompose.cli.output.console import misused, refuse, tell
from rbxcompose.cli.output.terminal import NO_TERMINAL, full_screen, raw, show
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.printable import plain
from rbxcompose.qos import Qos

HEARD = 1.5  # [s] in which transforms of all joints should come
_JOINTS = "joint_states"
_MOST_READ = 4096  # bytes of keys per read


def pose(arguments: argparse.Namespace) -> int:
    """Move the joints of a robot by sliders, or to the positions that are given."""
    if arguments.duration is not None and not arguments.joint:
        return misused("body", "--duration is for the positions of --joint")
    if not arguments.joint and not (sys.stdin.isatty() and sys.stdout.isatty()):
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
    """Return where the joints are now, as far as transforms tell: opening the sliders must not move anything."""
    frames = HeardFrames(guest)
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
    slider = next((one for one in sliders if one.name == name), None)
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
    tell(f"{name}: {sent} sent")
    return 0


def _slide(guest: Guest, publisher: Publisher[JointState], panel: SliderPanel, name: str) -> int:
    """Show sliders until q, an interrupt, or the end of the terminal."""
    screen = _Screen(guest, publisher, panel, name)
    keyboard = sys.stdin.fileno()
    with guest.interruptible(), raw(keyboard):
        screen.read_early()
        if not screen.is_over:
            _run(guest, screen, keyboard)
    return 0


def _run(guest: Guest, screen: _Screen, keyboard: int) -> None:
    with full_screen(sys.stdout):
        guest.watch(keyboard, screen.read)
        guest.scheduler.every(PERIOD, NAME, lambda dt: screen.send())
        screen.send()
        guest.run(lambda: screen.is_over or guest.is_interrupted)


class _Screen:
    """Turns keys into messages, and shows the sliders."""

    def __init__(self, guest: Guest, publisher: Publisher[JointState], panel: SliderPanel, title: str) -> None:
        self.is_over = False
        self._guest, self._publisher, self._panel, self._title = guest, publisher, panel, title
        self._begun = ""  # of a key whose rest has not arrived yet
        self._shown: list[str] = []

    def read(self) -> None:
        """Handle the pressed keys."""
        changes = [self._panel.press(key) for key in self._pressed()]
        if any(changes):
            self.send()
        else:
            self._show()

    def read_early(self) -> None:
        """Handle keys that were pressed before the start: they move nothing, but may end the command."""
        if select.select([sys.stdin], [], [], 0)[0]:
            self._pressed()

    def _pressed(self) -> list[str]:
        data = os.read(sys.stdin.fileno(), _MOST_READ)
        keys, self._begun = split_keys(self._begun + data.decode(errors="replace"))
        self.is_over = self.is_over or not data or any(map(is_end, keys))
        return keys

    def send(self) -> None:
        """Publish all positions, and show them."""
        self._publisher(_message(self._guest, self._panel.positions))
        self._show()

    def _show(self) -> None:
        size = shutil.get_terminal_size()  # takes 80 x 24 for a terminal that reports 0 x 0
        lines = self._panel.lines(self._title, size.columns, size.lines)
        if lines != self._shown:
            self._shown = lines
            show(sys.stdout, lines)
