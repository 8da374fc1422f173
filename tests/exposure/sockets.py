"""Sockets as the kernel lists them: who listens where."""

from __future__ import annotations

import ipaddress
import os
import socket
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

_TABLES = ("tcp", "tcp6", "udp", "udp6")
_LISTENS = {"tcp": "0A", "udp": "07"}  # states of sockets that wait for strangers
_ACCEPTS = 0x10000  # flag of a unix socket that listens


@dataclass(frozen=True, slots=True)
class Listener:
    """A socket that others may connect to or send to: `place` is a port, or the path of a unix socket."""

    pid: int
    protocol: str
    address: str
    place: str

    @property
    def is_loopback(self) -> bool:
        """Tell whether only this machine reaches it."""
        return ipaddress.ip_address(self.address).is_loopback


def listeners(pids: Iterable[int]) -> list[Listener]:
    """Return what these processes listen on."""
    return [listener for pid in pids for listener in (*_internet(pid, _inodes(pid)), *_unix(pid, _inodes(pid)))]


def _inodes(pid: int) -> set[str]:
    links = (os.readlink(path) for path in Path(f"/proc/{pid}/fd").iterdir())
    return {link[len("socket:[") : -1] for link in links if link.startswith("socket:[")}


def _internet(pid: int, inodes: set[str]) -> Iterator[Listener]:
    for table in _TABLES:
        for line in Path(f"/proc/{pid}/net/{table}").read_text(encoding="ascii").splitlines()[1:]:
            fields = line.split()
            if fields[9] in inodes and fields[3] == _LISTENS[table[:3]]:
                address, _, port = fields[1].partition(":")
                yield Listener(pid, table, _address(address), str(int(port, 16)))


def _address(text: str) -> str:
    """Return an address that the kernel writes as words of 32 bits in the order of this machine."""
    packed = b"".join(struct.pack("=I", int(text[i : i + 8], 16)) for i in range(0, len(text), 8))
    return socket.inet_ntop(socket.AF_INET if len(packed) == 4 else socket.AF_INET6, packed)


def _unix(pid: int, inodes: set[str]) -> Iterator[Listener]:
    for line in Path(f"/proc/{pid}/net/unix").read_text(encoding="utf-8").splitlines()[1:]:
        _, _, _, flags, _, _, inode, *path = line.split(maxsplit=7)
        if inode in inodes and (int(flags, 16) & _ACCEPTS or path):
            yield Listener(pid, "unix", "", path[0] if path else "")
