"""Show a running robot live: components, processes, mission, batteries, the last warnings.

It looks once a second, until q or Ctrl-C. Without a terminal it looks once. The rate of a component is that of its
messages; the share of a process is that of one processor. Of a system, it shows all robots on all hosts in one picture.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys

from rbxcompose.cli.bus.entities import add_json_option
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.cli.bus.messages import to_json
from rbxcompose.cli.bus.place import place_of
from rbxcompose.cli.output.console import has_colour, refuse, tell
from rbxcompose.cli.output.terminal import full_screen, raw, show
from rbxcompose.cli.robots.lookup import NOT_UP, NotDoneError, add_robot_option, find_robot
from rbxcompose.cli.robots.picture import RobotPicture, lines_of
from rbxcompose.cli.robots.sampler import Sampler
from rbxcompose.cli.systems.options import EACH, add_system_options

ON_SYSTEM = EACH
_PERIOD = 1.0  # [s] between two samples
_MOST_READ = 1024  # bytes of keys per read
_WIDTH, _HEIGHT = 100, 1000  # columns and lines of a picture without a terminal


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", nargs="?", metavar="ROBOT|PATH", help="the robot, by name or file; or a system")
    add_robot_option(parser)
    add_system_options(parser)
    parser.add_argument("--once", action="store_true", help="watch for a second, print the result, and end")
    add_json_option(parser)
    parser.add_argument("--follow", action="store_true", help="with --json: a line each second, until interrupted")


def run(arguments: argparse.Namespace) -> int:
    """Show the robot, once or repeatedly."""
    try:
        folder = find_robot(arguments.robot or arguments.path)
        with Guest(place_of(folder)) as guest:
            sampler = Sampler(folder, guest)
            try:
                if arguments.json and arguments.follow:
                    return _follow(guest, sampler)
                if arguments.json or arguments.once or not (sys.stdin.isatty() and sys.stdout.isatty()):
                    return _once(guest, sampler, arguments.json)
                return _live(guest, sampler)
            finally:
                sampler.close()
    except NotDoneError as error:
        return refuse(error.finding)


def _once(guest: Guest, sampler: Sampler, as_json: bool) -> int:
    _sampled(sampler)
    guest.run(lambda: False, _PERIOD)
    guest.run(lambda: sampler.is_complete, _PERIOD)  # the awaited messages come once in a period
    picture = _sampled(sampler)
    colour = has_colour(sys.stdout)
    tell(to_json(picture.to_data()) if as_json else "\n".join(lines_of(picture, _WIDTH, _HEIGHT, colour=colour)))
    return 0


def _follow(guest: Guest, sampler: Sampler) -> int:
    """Tell a picture as a line of JSON once a second."""
    with guest.interruptible():
        while True:
            tell(to_json(_sampled(sampler).to_data()))
            sys.stdout.flush()
            if guest.run(lambda: guest.is_interrupted, _PERIOD):
                return 0


def _live(guest: Guest, sampler: Sampler) -> int:
    keyboard, colour = sys.stdin.fileno(), has_colour(sys.stdout)
    is_over = False

    def read() -> None:
        nonlocal is_over
        keys = os.read(keyboard, _MOST_READ)
        is_over = not keys or b"q" in keys.lower()

    with guest.interruptible(), raw(keyboard), full_screen(sys.stdout):
        guest.watch(keyboard, read)
        while True:
            size = shutil.get_terminal_size()  # takes 80 x 24 for a terminal that reports 0 x 0
            show(sys.stdout, lines_of(_sampled(sampler), size.columns, size.lines, colour=colour))
            if guest.run(lambda: is_over or guest.is_interrupted, _PERIOD):
                return 0


def _sampled(sampler: Sampler) -> RobotPicture:
    picture = sampler.sample()
    if picture is None:
        raise NotDoneError(NOT_UP.at(None, "the robot is down"))
    return picture
