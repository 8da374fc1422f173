"""`body pose` on the bus: the description that it reads, the positions that it publishes, keys and screen."""

from __future__ import annotations

import argparse
import random
from collections.abc import Mapping
from functools import partial

import numpy as np

from rbxcompose.body.model import Body
from rbxcompose.bus.graph import find
from rbxcompose.bus.topics import Publisher
from rbxcompose.cli.bodies.heard import HeardFrames, described, described_body
from rbxcompose.cli.bodies.sliders import PERIOD, Slider, SliderPanel, is_end, sliders_of, split_keys
from rbxcompose.cli.bodies.source import UNKNOWN
from rbxcompose.cli.bus.guest import NAME, NOBODY, Guest, visit
from rbxcompose.cli.output.console import NotDoneError, misused, refuse, tell
from rbxcompose.cli.output.terminal import NO_TERMINAL, LiveScreen, is_terminal
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.printable import plain
from rbxcompose.qos import Qos

HEARD = 1.5  # [s] in which transforms of all joints should come
_JOINTS = "joint_states"


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
