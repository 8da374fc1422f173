"""Tells a service manager, such as systemd, that everything is up, and that the supervisor is alive: sd_notify(3)."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from contextlib import suppress

READY, ALIVE = b"READY=1", b"WATCHDOG=1"


class ServiceManager:
    """Sends to the socket in `NOTIFY_SOCKET`; without one, nobody listens."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        name = environment.get("NOTIFY_SOCKET", "")
        self._address = f"\0{name[1:]}" if name.startswith("@") else name
        self._is_watched = "WATCHDOG_USEC" in environment

    def tell(self, state: bytes) -> None:
        """Send a state; if it cannot be taken now, it is not needed any more."""
        if self._address and (state is not ALIVE or self._is_watched):
            with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
                sender.sendto(state, socket.MSG_DONTWAIT, self._address)


def of_this_process() -> ServiceManager:
    """Return the manager that has started this process."""
    return ServiceManager(os.environ)
