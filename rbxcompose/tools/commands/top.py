"""Show a running robot live: components, processes, mission, batteries, the last warnings.

It looks once a second, until q or Ctrl-C. Without a terminal it looks once. The rate of a component is that of its
messages; the share of a process is that of one processor. Of a system, it shows all robots on all hosts in one picture.
"""

import argparse
import json
import sys
import time
from functools import partial

from rbxcompose.base.printable import plain
from rbxcompose.commands.console import NotDoneError, emit, has_colour
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.hosts import Remote, Running, Shares, SystemCommand
from rbxcompose.commands.lookup import NOT_UP, add_addressed_robot, find_robot, place_of
from rbxcompose.commands.messages import to_json
from rbxcompose.commands.options import EACH, add_json_option
from rbxcompose.commands.terminal import LiveScreen, is_terminal
from rbxcompose.tools.top import Sampler, ShareView, TopData, lines_of, system_lines

GROUP = "look"
IS_COMMON = True
ON_SYSTEM = EACH
_PERIOD = 1.0  # [s] between two samples
_WIDTH, _HEIGHT = 100, 1000  # columns and lines of a picture without a terminal
_SYSTEM_PERIOD = 0.5  # [s] between two pictures
_AGAIN = 3.0  # [s] after a command has ended until it is started again


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_addressed_robot(parser)
    parser.add_argument("--once", action="store_true", help="watch for a second, print the result, and end")
    add_json_option(parser)
    parser.add_argument("--follow", action="store_true", help="with --json: a line each second, until interrupted")


def run(arguments: argparse.Namespace) -> int:
    """Show the robot, once or repeatedly."""
    folder = find_robot(arguments.robot or arguments.path)
    with Guest(place_of(folder)) as guest:
        sampler = Sampler(folder, guest)
        try:
            if arguments.json and arguments.follow:
                return _follow(guest, sampler)
            if arguments.json or arguments.once or not is_terminal():
                return _once(guest, sampler, arguments.json)
            return _live(guest, sampler)
        finally:
            sampler.close()


def run_on_system(command: SystemCommand) -> int | None:
    """Show the robots of a system in one picture, on a terminal."""
    arguments = command.arguments
    if len(command.shares) == 1 or arguments.json or arguments.once or not is_terminal():
        return None
    return show_system(command.system.name, command.shares)


def _once(guest: Guest, sampler: Sampler, as_json: bool) -> int:
    _sampled(sampler)
    guest.run(lambda: False, _PERIOD)
    guest.run(lambda: sampler.is_complete, _PERIOD)  # the awaited messages come once in a period
    picture = _sampled(sampler)
    colour = has_colour(sys.stdout)
    emit(to_json(picture) if as_json else "\n".join(lines_of(picture, _WIDTH, _HEIGHT, colour=colour)))
    return 0


def _follow(guest: Guest, sampler: Sampler) -> int:
    """Tell a picture as a line of JSON once a second."""
    with guest.interruptible():
        while True:
            emit(to_json(_sampled(sampler)))
            sys.stdout.flush()
            if guest.run(lambda: guest.is_interrupted, _PERIOD):
                return 0


def _live(guest: Guest, sampler: Sampler) -> int:
    colour = has_colour(sys.stdout)
    with LiveScreen() as screen, guest.interruptible():
        guest.watch(screen.keyboard, screen.read)
        while True:
            screen.draw(lambda width, height: lines_of(_sampled(sampler), width, height, colour=colour))
            if guest.run(lambda: screen.is_over or guest.is_interrupted, _PERIOD):
                return 0


def _sampled(sampler: Sampler) -> TopData:
    picture = sampler.sample()
    if picture is None:
        raise NotDoneError(NOT_UP.at(None, "the robot is down"))
    return picture


class LiveShare:
    """Follows what a host reports about a share; a command that ends is started again."""

    def __init__(self, host: str, robot: str, remote: Remote) -> None:
        self._host, self._robot = host, robot
        self._command = remote.rbxcompose(["top", robot, "--json", "--follow"])
        self._answer: TopData | None = None
        self._since = time.monotonic()
        self._ended: float | None = None
        self._problem = self._last = ""
        self._running = Running(self._command, self._take)

    def _take(self, line: str) -> None:
        try:
            answer = json.loads(line)
        except ValueError:
            self._last = self._last or plain(line.strip())
            return
        if isinstance(answer, dict) and "components" in answer:
            self._answer, self._since, self._problem, self._last = answer, time.monotonic(), "", ""

    def view(self) -> ShareView:
        """Return what is known now."""
        now = time.monotonic()
        if self._running.is_over and self._ended is None:
            self._problem, self._ended, self._last = self._last or "it has ended", now, ""
        if self._ended is not None and now - self._ended > _AGAIN:
            self._ended, self._running = None, Running(self._command, self._take)
        return ShareView(self._robot, self._host, self._answer, now - self._since, self._problem)

    def close(self) -> None:
        """End the command."""
        self._running.end()
        self._running.wait()


def show_system(name: str, shares: Shares) -> int:
    """Show all shares until q or Ctrl-C."""
    colour = has_colour(sys.stdout)
    live = [
        LiveShare(host, robot, remote)
        for (host, robot), remote in sorted(shares.items(), key=lambda item: item[0][::-1])
    ]
    try:
        with LiveScreen() as screen:
            while not screen.is_over:
                views = [live_share.view() for live_share in live]
                screen.draw(partial(system_lines, name, views, colour=colour))
                screen.wait(_SYSTEM_PERIOD)
    finally:
        for share in live:
            share.close()
    return 0
