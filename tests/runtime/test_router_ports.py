"""Each robot of a machine finds a port for its router, however many there are."""

from __future__ import annotations

import socket

from rbxcompose.bus.endpoints import LOOPBACK
from rbxcompose.runtime.process_group.router import free_ports


def test_a_port_at_which_a_router_listens_is_passed_over_and_the_next_one_is_taken() -> None:
    with socket.create_server((LOOPBACK, 0)) as taken:
        port = taken.getsockname()[1]
        assert port not in list(free_ports(port))
        assert next(free_ports(port)) > port
    assert next(free_ports(port)) == port


def test_no_port_is_above_the_largest_one() -> None:
    assert max(free_ports(65000), default=0) < 65536
