"""A router that is not of the system, but has the certificate of its authority: it dials the link of host `r`."""

from __future__ import annotations

import os
import time
from pathlib import Path

from rbxcompose.bus.zenoh_session import RouterLink, open_router

LONGEST = 3.0  # [s] that a link may take


def main() -> None:
    """Print whether the link is made."""
    authority = next(Path(os.environ["XDG_CONFIG_HOME"]).rglob("ca.pem"))
    tls = {"root_ca_certificate": str(authority), "verify_name_on_connect": True}
    link = RouterLink((), ("tls/10.42.7.2:7447",), tls)
    session = open_router("tcp/127.0.0.1:7900", link)
    deadline = time.monotonic() + LONGEST
    while not session.info.routers_zid() and time.monotonic() < deadline:
        time.sleep(0.05)
    print("linked" if session.info.routers_zid() else "refused")  # noqa: T201 - its output is its answer
    session.close()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main()
