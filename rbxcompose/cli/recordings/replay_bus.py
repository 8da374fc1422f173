"""The bus on which a recording is replayed: that of a robot, or one of its own, where no robot is disturbed."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager

from rbxcompose.bus.zenoh_session import open_router
from rbxcompose.cli.bus.guest import NO_ROUTER
from rbxcompose.cli.bus.place import BusPlace, find_place
from rbxcompose.cli.output.console import tell
from rbxcompose.cli.robots.lookup import NotDoneError, robots_up
from rbxcompose.endpoints import tcp_endpoint

_PORT, _TRIES = 7447, 20  # the port at which ROS 2 looks for a router, and those behind it


@contextmanager
def replay_bus(arguments: argparse.Namespace) -> Iterator[BusPlace]:
    """Yield the bus that the options name; with `--alone`, or if no robot is up, one with a router of its own.

    Raises:
        NotDoneError: if there is none.
    """
    is_named = arguments.router is not None or arguments.robot is not None
    if is_named or (robots_up() and not arguments.alone):
        yield find_place(arguments)
        return
    with _own_router() as endpoint:
        tell(f"a router of its own is at {endpoint}: 'rbxcompose topic echo TOPIC --router {endpoint}'")
        yield BusPlace(endpoint, arguments.domain or 0)


@contextmanager
def _own_router() -> Iterator[str]:
    for port in range(_PORT, _PORT + _TRIES):
        endpoint = tcp_endpoint(port)
        try:
            session = open_router(endpoint)
        except OSError:
            continue
        try:
            yield endpoint
        finally:
            session.close()  # type: ignore[no-untyped-call]
        return
    raise NotDoneError(NO_ROUTER.at(None, f"no port from {_PORT} to {_PORT + _TRIES - 1} is free for a router"))
