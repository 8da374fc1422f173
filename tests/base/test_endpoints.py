"""Endpoints: which are taken, and how ours are made."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
import zenoh

from rbxcompose.bus.endpoints import accepts, endpoint, is_private, socket_of, tcp_endpoint, unix_endpoint
from tests.loops import for_all

FINE = [
    "tcp/127.0.0.1:7447",
    "tcp/robot-1.local:1",
    "tcp/[::1]:65535",
    "tcp/[fe80::1]:7447#iface=eth0",
    "tls/lab.example:7447#root_ca_certificate_file=/etc/ca.pem",
    "udp/10.0.0.1:7447?rel=0",
    "unixsock-stream//run/user/1000/bus/router",
]
WRONG = [
    "",
    "7447",
    "localhost:7447",
    "tcp/localhost",
    "tcp/127.0.0.1:0",
    "tcp/127.0.0.1:65536",
    "tcp/127.0.0.1:7447;exec",
    "tcp/127.0.0.1:7447 ",
    "tcp/127.0.0.1:7447\n",
    "tcp/ho st:1",
    "http/127.0.0.1:80",
    "unixsock-stream/relative",
    "tcp/10.42.0.300:7447",
    "tcp/10.42.0:7447",
    "tcp/[::1::]:7447",
    "tcp/" + "a" * 100_000 + ":1",
]


@pytest.mark.parametrize("text", FINE)
def test_an_endpoint_is_taken_as_it_is_and_zenoh_reads_it(text: str) -> None:
    assert endpoint(text) == text
    zenoh.Config().insert_json5("connect/endpoints", f'["{text}"]')


@for_all("text", WRONG)
def test_what_is_no_endpoint_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"endpoint of Zenoh|between 1 and 65535|is no address"):
        endpoint(text)


def test_ours_are_endpoints(tmp_path: Path) -> None:
    made = unix_endpoint(Path("/run/user/7/bus"), "router")
    assert endpoint(made) == made
    assert (is_private(made), socket_of(made)) == (True, Path("/run/user/7/bus/router"))
    assert (endpoint(tcp_endpoint(7447)), is_private(tcp_endpoint(7447))) == ("tcp/127.0.0.1:7447", False)


def test_a_folder_too_long_for_sockets_is_refused_before_the_kernel_does() -> None:
    with pytest.raises(OSError, match="sockets need a path of less than 91 bytes"):
        unix_endpoint(Path("/" + "x" * 90), "router")
    unix_endpoint(Path("/" + "x" * 89), "router")


def test_whoever_listens_accepts_and_nobody_else_does(tmp_path: Path) -> None:
    private = unix_endpoint(tmp_path, "router")
    with socket.create_server(("127.0.0.1", 0)) as server, socket.socket(socket.AF_UNIX) as local:
        local.bind(str(socket_of(private)))
        local.listen()
        port = server.getsockname()[1]
        listening = [f"tcp/127.0.0.1:{port}", f"tls/127.0.0.1:{port}#root_ca_certificate_file=/etc/ca.pem", private]
        assert [accepts(text, 1.0) for text in listening] == [True] * 3
        assert not accepts(f"quic/127.0.0.1:{port}", 1.0)
    assert [accepts(text, 1.0) for text in listening] == [False] * 3
