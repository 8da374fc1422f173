"""Runs a module on a host of a test, as `ip netns exec` has it run there: `inside.py NAMESPACE MODULE [WORD ...]`.

It is for processes that `tests/forked.py` starts, which no other program can bring to a host any more.
"""

from __future__ import annotations

import ctypes
import os
import runpy
import sys
from pathlib import Path

_NETWORK, _MOUNTS = 0x4000_0000, 0x2_0000  # of setns(2) and unshare(2)
_READ_ONLY, _ALL_BELOW, _SLAVE = 0x1, 0x4000, 0x8_0000  # of mount(2)
_DETACH = 0x2  # of umount2(2)
_LIBC = ctypes.CDLL(None, use_errno=True)


def main(namespace: str, module: str, *words: str) -> None:
    """Enter the network of the host, with its devices in `/sys` and memory of its own, and run the module."""
    with open(f"/run/netns/{namespace}") as network:
        _check(_LIBC.setns(network.fileno(), _NETWORK))
    _check(_LIBC.unshare(_MOUNTS))
    _mount("none", "/", "", _SLAVE | _ALL_BELOW)
    is_fixed = bool(os.statvfs("/sys").f_flag & os.ST_RDONLY)
    _LIBC.umount2(b"/sys", _DETACH)
    _mount("sysfs", "/sys", "sysfs", _READ_ONLY if is_fixed else 0)
    _mount("tmpfs", "/dev/shm", "tmpfs")  # hosts share no memory
    sys.path[0], sys.argv[1:] = str(Path(__file__).parents[2]), words
    runpy.run_module(module, run_name="__main__", alter_sys=True)


def _mount(source: str, target: str, kind: str, flags: int = 0) -> None:
    _check(_LIBC.mount(source.encode(), target.encode(), kind.encode() or None, ctypes.c_ulong(flags), None))


def _check(result: int) -> None:
    if result:
        raise OSError(number := ctypes.get_errno(), os.strerror(number))


if __name__ == "__main__":
    main(*sys.argv[1:])
