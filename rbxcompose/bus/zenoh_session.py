"""Zenoh sessions: one peer for each process of a robot, and the router that lets them find each other.

Nothing is left to Zenoh's defaults, which look for strangers on every network.
"""

from __future__ import annotations

import errno
import itertools
import json
import os
from collections.abc import Mapping
from dataclasses import field

import zenoh

from rbxcompose.bus import shared_memory
from rbxcompose.dataclass import dataclass
from rbxcompose.endpoints import is_private, socket_of, tcp_endpoint, unix_endpoint

LEASE = 2000  # [ms] until a silent link counts as lost
PATIENCE = 1000  # [ms] that a visitor waits for a router
THREADS = "(rx: (worker_threads: 2), acc: (handover: rx), net: (handover: rx), app: (handover: rx))"
"""Which threads Zenoh has: two that receive and do all else, and one that sends.

By default there are six, and a message passes three of them: one sees it, one reads it, one watches meanwhile. Those
that send must not be those that receive, or Zenoh waits for itself.
"""
_RETRY = {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 2}
_TAKEN = ("os error 98", "Unable to acquire lock")  # what Zenoh says of an endpoint in use
_session_numbers = itertools.count()


@dataclass(frozen=True, slots=True)
class RouterLink:
    """Where a router listens for the routers of other hosts, and to which of them it connects."""

    listen: tuple[str, ...] = ()
    connect: tuple[str, ...] = ()
    tls: Mapping[str, object] = field(default_factory=dict)  # settings of `transport/link/tls`
    access: Mapping[str, object] = field(default_factory=dict)  # `access_control`
    downsample: Mapping[str, float] = field(default_factory=dict)  # key -> most messages per second that leave [Hz]


def tls_settings(authority: str, certificate: str, key: str, *, mutual: bool) -> dict[str, object]:
    """Return how a router proves who it is, from the paths of its files; if `mutual`, those that dial it must, too.

    A host is dialled by the address that its certificate has.
    """
    own = {
        f"{side}_{what}": path
        for side in ("listen", "connect")
        for what, path in (("certificate", certificate), ("private_key", key))
    }
    return {"root_ca_certificate": authority, **own, "enable_mtls": mutual, "verify_name_on_connect": True}


NO_LINK = RouterLink()


def _common() -> dict[str, object]:
    return {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,  # without it, two peers of one router never exchange data
        # Else two peers that learn of each other connect twice, once from each side, and keep both links alive.
        "scouting/gossip/autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}},
        "scouting/delay": 0,  # a router would wait this long before it opens
        "timestamping/enabled": True,  # needed by the caches of latched topics
        "transport/link/tx/lease": LEASE,
        "transport/shared_memory/enabled": not shared_memory.problem(),  # else no session opens without room for it
        "transport/shared_memory/transport_optimization/pool_size": shared_memory.POOL,
    }


def peer_settings(router: str) -> dict[str, object]:
    """Return the configuration of a peer that finds others through `router` (`tcp/127.0.0.1:7447`)."""
    return {
        **_common(),
        "mode": "peer",
        "listen/endpoints": [_endpoint_beside(router)],  # other peers connect to it once they know of each other
        "connect/endpoints": [router],
        "connect/retry": _RETRY,
        "connect/timeout_ms": -1,  # retries forever, in the background; 0 would mean once
        "connect/exit_on_failure": False,
    }


def _endpoint_beside(router: str) -> str:
    if not is_private(router):
        return tcp_endpoint(0)
    # A session that is opened again must not wait until the stuck one lets go of its socket.
    return unix_endpoint(socket_of(router).parent, f"{os.getpid()}-{next(_session_numbers)}")


def router_settings(endpoint: str, link: RouterLink = NO_LINK) -> dict[str, object]:
    """Return the configuration of a router that listens at `endpoint`, and is linked with routers of other hosts.

    Gossip goes one hop far, so peers of different hosts do not learn of each other and only routers are linked.
    """
    return {
        **_common(),
        "mode": "router",
        "listen/endpoints": [endpoint, *link.listen],
        "listen/timeout_ms": 0,
        "listen/exit_on_failure": True,
        "scouting/gossip/multihop": False,
        "connect/endpoints": list(link.connect),
        "connect/retry": _RETRY,
        "connect/timeout_ms": -1,  # forever: the other host may come later
        "connect/exit_on_failure": False,
        **{f"transport/link/tls/{name}": value for name, value in link.tls.items()},
        **({"access_control": link.access} if link.access else {}),
        **_downsampling(link.downsample),
    }


def _downsampling(rates: Mapping[str, float]) -> dict[str, object]:
    """Return the limits for what leaves; peers of this host get it from each other, past the router."""
    rules = [{"key_expr": key, "freq": rate} for key, rate in rates.items()]
    return {"downsampling": [{"messages": ["put"], "flows": ["egress"], "rules": rules}]} if rules else {}


def client_settings(router: str) -> dict[str, object]:
    """Return the configuration of a visitor, which learns of everything at once through `router`."""
    return {
        **_common(),
        "mode": "client",
        "connect/endpoints": [router],
        "connect/timeout_ms": PATIENCE,
        "connect/exit_on_failure": True,
        "transport/unicast/open_timeout": PATIENCE,  # a stopped router accepts connections but says nothing
    }


def open_peer(router: str) -> zenoh.Session:
    """Open the session of a process; the router need not be there yet."""
    return _opened(peer_settings(router))


def open_client(router: str) -> zenoh.Session:
    """Open the session of a visitor.

    Raises:
        OSError: if `router` is no endpoint, or does not answer.
    """
    try:
        return _opened(client_settings(router))
    except zenoh.ZError as error:
        raise OSError(errno.ECONNREFUSED, f"no router answers at {router}") from error


def open_router(endpoint: str, link: RouterLink = NO_LINK) -> zenoh.Session:
    """Open a router; those of other hosts need not be there yet.

    Raises:
        OSError: if `endpoint` is taken.
    """
    try:
        return _opened(router_settings(endpoint, link))
    except zenoh.ZError as error:
        if not any(cause in str(error) for cause in _TAKEN):
            raise
        raise OSError(errno.EADDRINUSE, f"{endpoint} is taken") from error


def _opened(settings: Mapping[str, object]) -> zenoh.Session:
    os.environ.setdefault("ZENOH_RUNTIME", THREADS)  # read once, when the first session of a process opens
    return zenoh.open(_config(settings))


def _config(settings: Mapping[str, object]) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config
