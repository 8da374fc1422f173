"""The location of the bus that a command addresses: that of a running robot, or any other by its router."""

from __future__ import annotations

import argparse

from rbxcompose.cli.robots.lookup import (
    NO_ANSWER,
    NotDoneError,
    add_robot_option,
    find_robot,
    known_state,
    no_answer,
)
from rbxcompose.dataclass import dataclass
from rbxcompose.runtime.folder import RobotFolder


@dataclass(frozen=True, slots=True)
class BusPlace:
    """A Zenoh endpoint (`tcp/127.0.0.1:7447`) and a ROS domain."""

    router: str
    domain: int = 0


def add_bus_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--robot NAME`, `--router ENDPOINT` and `--domain N`."""
    add_robot_option(parser)
    parser.add_argument("--router", metavar="ENDPOINT", help="another bus, by its Zenoh router: tcp/192.168.1.7:7447")
    parser.add_argument("--domain", type=int, metavar="N", help="the ROS domain (default: that of the robot, or 0)")


def find_place(arguments: argparse.Namespace) -> BusPlace:
    """Return the place that the options name.

    Raises:
        NotDoneError: if no robot is found, or it has no router.
    """
    if arguments.router is not None:
        return BusPlace(arguments.router, arguments.domain or 0)
    found = place_of(find_robot(arguments.robot))
    return found if arguments.domain is None else BusPlace(found.router, arguments.domain)


def place_of(folder: RobotFolder) -> BusPlace:
    """Return the place of a robot's own bus.

    Raises:
        NotDoneError: if it has no router.
    """
    state = known_state(folder)
    if state is not None and not state.is_supervised:
        raise NotDoneError(no_answer(folder))  # its router is gone, too, or about to go
    if state is None or state.router is None:
        raise NotDoneError(NO_ANSWER.at(None, f"'{folder.path.name}' has no known router"))
    return BusPlace(state.router, state.domain)
