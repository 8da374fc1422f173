"""Endpoints of the bus, in Zenoh's words: `tcp/127.0.0.1:7447`, `unixsock-stream//run/user/1000/...`."""

import errno
import os
import re
from pathlib import Path

from rbxcompose.base.config import require_possible

LINK_LEASE = 2.0  # [s] of silence after which a link counts as lost
LOOPBACK, _UNIX = "127.0.0.1", "unixsock-stream/"
_LONGEST_PATH, _LONGEST_NAME = 107, 16  # [bytes] of a Unix socket, which the kernel limits, and of ours in a folder
_LONGEST = 1000
_NETWORK = re.compile(
    r"(tcp|udp|tls|quic|ws)/(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):(?P<port>[0-9]{1,5})(\?[\w=;.-]+)?(#[^\s#]+)?"
)
_SOCKET = re.compile(r"unixsock-stream//[^\s#?]+")


def tcp_endpoint(port: int) -> str:
    """Return the endpoint of a port on the loopback interface, which every user of the machine can reach."""
    return f"tcp/{LOOPBACK}:{port}"


def unix_endpoint(folder: Path, name: str) -> str:
    """Return the endpoint of a Unix socket; only users who can open the folder can reach it.

    Raises:
        OSError: if the folder's path is too long for a socket in it.
    """
    most = _LONGEST_PATH - _LONGEST_NAME
    if len(os.fsencode(folder)) >= most:
        raise OSError(errno.ENAMETOOLONG, f"sockets need a path of less than {most} bytes", str(folder))
    return f"{_UNIX}{folder / name}"


def is_private(endpoint: str) -> bool:
    """Return whether an endpoint is a Unix socket, so that the mode of its folder decides who can connect."""
    return endpoint.startswith(_UNIX)


def socket_of(endpoint: str) -> Path:
    """Return the file of a Unix socket."""
    return Path(endpoint.removeprefix(_UNIX))


def accepts(endpoint: str, patience: float) -> bool:
    """Return whether connections are accepted at an endpoint within `patience` [s]; UDP and QUIC cannot tell."""
    import socket  # no check needs it

    protocol, _, place = re.split("[?#]", endpoint)[0].partition("/")
    host, _, port = place.rpartition(":")
    if protocol in ("udp", "quic"):
        return False
    try:
        if is_private(endpoint):
            with socket.socket(socket.AF_UNIX) as knocking:
                knocking.settimeout(patience)
                knocking.connect(str(socket_of(endpoint)))
        else:
            socket.create_connection((host.strip("[]"), int(port)), patience).close()
    except OSError:
        return False
    return True


def endpoint(text: str) -> str:
    """Return `text` if it is an endpoint to which a session can connect.

    Raises:
        ValueError: if it is none.
    """
    network = _NETWORK.fullmatch(text) if len(text) <= _LONGEST else None
    if network is None and not _SOCKET.fullmatch(text):
        raise ValueError("must be an endpoint of Zenoh, such as tcp/192.168.0.2:7447")
    if network is not None and not 0 < int(network["port"]) < 65536:
        raise ValueError("a port is between 1 and 65535")
    if network is not None:
        require_possible(network["host"].strip("[]"))
    return text
