"""A link that delays and loses packets, by Linux's own `netem` where the kernel of this machine lacks it.

A machine with another kernel stands in the switch between two hosts, and forwards what it gets from one to the other.
The hosts themselves run here, at full speed. Its own delay is that of an emulated network card, about a millisecond.
"""

from __future__ import annotations

import subprocess
import time
from typing import Self

from tests.systems.emulated_kernel import emulator
from tests.systems.namespaces import SWITCH, Hosts, NotPermittedError

PROGRAMS = ("ip", "tc")
MODULES = ("e1000", "llc", "stp", "bridge", "sch_netem")
READY = "done"
_INIT = f"""
ip link add switch type bridge
for card in eth0 eth1; do ip link set $card master switch up; done
ip link set switch up
echo {READY}
while read words; do
  for card in eth0 eth1; do tc qdisc replace dev $card root netem $words; done
  echo {READY}
done
"""


class EmulatedLink:
    """Between the two hosts of a test; `shape` says in the words of netem how it is, each way."""

    def __init__(self, hosts: Hosts) -> None:
        """Put it between them.

        Raises:
            NotPermittedError: if there is no emulator, or no kernel for it.
        """
        words = emulator(hosts.folder, _INIT, PROGRAMS, MODULES, "128M")
        for number, host in enumerate(hosts.addresses):
            card, mac = f"card-{host}", f"52:54:00:00:00:{number:02x}"
            hosts.ip(SWITCH, "tuntap", "add", "dev", card, "mode", "tap")
            words += ["-netdev", f"tap,id={card},ifname={card},script=no,downscript=no"]
            words += ["-device", f"e1000,netdev={card},mac={mac}"]
        words += ["-serial", "stdio", "-monitor", "none"]
        self._process = subprocess.Popen(
            ["ip", "netns", "exec", hosts.namespace(SWITCH), *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._wait()
        for host in hosts.addresses:
            hosts.ip(SWITCH, "link", "add", f"side-{host}", "type", "bridge")
            hosts.ip(SWITCH, "link", "set", f"side-{host}", "up")
            for device in (f"card-{host}", host):  # from now on, all passes it
                hosts.ip(SWITCH, "link", "set", "dev", device, "master", f"side-{host}", "up")

    def _wait(self) -> None:
        assert self._process.stdout is not None
        told = []
        for line in self._process.stdout:
            if line.strip() == READY:
                return
            told.append(line)
        raise NotPermittedError("".join(told[-3:]))

    def shape(self, *words: str) -> float:
        """Delay or lose packets from now on, such as `delay 50ms loss 2%`; return the time [s, monotonic]."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{' '.join(words)}\n")
        self._process.stdin.flush()
        self._wait()
        return time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()
