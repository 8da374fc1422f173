"""Zenoh sessions: a peer for each process of a robot, the router that lets them find each other, links with others."""

from __future__ import annotations

import errno
import itertools
import json
import os
import re
import socket
from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Any

import zenoh

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus import shared_memory
from rbxcompose.bus.endpoints import LINK_LEASE, LOOPBACK, is_private, socket_of, tcp_endpoint, unix_endpoint

LEASE = round(1000 * LINK_LEASE)  # [ms] until a silent link counts as lost
PATIENCE, LONGER = 1000, 5000  # [ms] that a visitor waits for a router, and a process that cannot do without it
THREADS = "(rx: (worker_threads: 2), acc: (handover: rx), app: (handover: rx))"
"""Which threads Zenoh has: two that receive, one that sends, and one that keeps the network.

By default there are six, and a message passes three of them: one sees it, one reads it, one watches meanwhile. Those
that send must not be those that receive, or Zenoh waits for itself. And what keeps the network must not wait for
Python: withdrawing a latched publisher holds Python's lock until that thread has ended a task.
"""
_THREADS_WITH_LINKS = "(rx: (worker_threads: 2))"
"""Which threads a router has that is linked with others: those of Zenoh's defaults.

What computes the ways between routers must not run where messages are received. A link's end wakes it on the thread
that then waits for that link. Until the ways are computed, a link that is made again counts as known, and its routers
do not tell each other what they subscribe to and serve.
"""
_RETRY = {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 2}
_PRIORITIES = {"high": "interactive_high", "medium": "data", "low": "background"}
_DIALS_FOREVER = {  # in the background: who is dialled may come later
    "connect/retry": _RETRY,
    "connect/timeout_ms": -1,  # 0 would mean once
    "connect/exit_on_failure": False,
}
_LISTENS_OR_FAILS = {"listen/timeout_ms": 0, "listen/exit_on_failure": True}
_TAKEN = ("os error 98", "Unable to acquire lock")  # what Zenoh says of an endpoint in use
_WHERE = re.compile(r" at \S+\.rs:\d+\.")  # in the sources of Zenoh
_session_numbers = itertools.count()
_routers: list[zenoh.Session] = []
"""Every router that this process has opened, also when it is closed.

Freeing its session waits, with Python's lock held, for a task of Zenoh's threads, and these may wait for that lock.
"""


@dataclass(frozen=True, slots=True)
class RouterLink:
    """Where a router listens for the routers of other hosts, and to which of them it connects."""

    listen: tuple[str, ...] = ()
    connect: tuple[str, ...] = ()
    tls: Mapping[str, object] = field(default_factory=dict)  # settings of `transport/link/tls`
    access: Mapping[str, object] = field(default_factory=dict)  # `access_control`
    downsample: Mapping[str, float] = field(default_factory=dict)  # key -> most messages per second that leave [Hz]
    priorities: Mapping[str, str] = field(default_factory=dict)  # key -> high, medium or low, as it leaves
    largest: Mapping[str, int] = field(default_factory=dict)  # key -> largest message that leaves [bytes]
    lease: float = LINK_LEASE  # [s] of silence after which the others count us as gone, as we do them


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


def _common(lease: float = LINK_LEASE) -> dict[str, object]:
    return {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,  # without it, two peers of one router never exchange data
        # Else two peers that learn of each other connect twice, once from each side, and keep both links alive.
        "scouting/gossip/autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}},
        "scouting/delay": 0,  # a router would wait this long before it opens
        "timestamping/enabled": True,  # needed by the caches of latched topics
        "transport/link/tx/lease": round(1000 * lease),
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
        **_DIALS_FOREVER,
    }


def guest_settings(router: str, session: str) -> tuple[dict[str, object], str]:
    """Return the configuration of a program of others, and where it listens.

    It is a peer with this id, which tells with whom it is linked.
    """
    endpoint = _endpoint_beside(router) if is_private(router) else tcp_endpoint(_free_port())
    admin = {"enabled": True, "permissions": {"read": True, "write": False}}
    return {**peer_settings(router), "id": session, "listen/endpoints": [endpoint], "adminspace": admin}, endpoint


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def as_file(settings: Mapping[str, object]) -> str:
    """Return a configuration as the text of a file that every Zenoh reads."""
    whole: dict[str, Any] = {}
    for path, value in settings.items():
        *groups, name = path.split("/")
        place = whole
        for group in groups:
            place = place.setdefault(group, {})
        place[name] = value
    return json.dumps(whole, indent=2)


def lone_settings(router: str) -> dict[str, object]:
    """Return the configuration of a process that is linked with `router` only; all that it sends takes that way."""
    return {
        **client_settings(router),
        "scouting/gossip/enabled": False,
        "connect/retry": _RETRY,
        "connect/timeout_ms": LONGER,
        "transport/unicast/open_timeout": LONGER,
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
        **_common(link.lease),
        "mode": "router",
        "listen/endpoints": [endpoint, *link.listen],
        **_LISTENS_OR_FAILS,
        "scouting/gossip/multihop": False,
        "connect/endpoints": list(link.connect),
        **_DIALS_FOREVER,
        "transport/unicast/open_timeout": LEASE,  # QUIC waits that long for a host that is not there, and closing waits
        **{f"transport/link/tls/{name}": value for name, value in link.tls.items()},
        **({"access_control": link.access} if link.access else {}),
        **_leaving(link),
    }


def _leaving(link: RouterLink) -> dict[str, object]:
    """Return what is done with messages that leave; peers of this host get them from each other, past the router."""
    puts = {"messages": ["put"], "flows": ["egress"]}
    rates = [{"key_expr": key, "freq": rate} for key, rate in link.downsample.items()]
    sizes = [{**puts, "key_exprs": [key], "size_limit": size} for key, size in link.largest.items()]
    order = [
        {**puts, "key_exprs": [key], "overwrite": {"priority": _PRIORITIES[word]}}
        for key, word in link.priorities.items()
    ]
    found = {
        "downsampling": [{**puts, "rules": rates}] if rates else [],
        "low_pass_filter": sizes,
        "qos/network": order,
    }
    return {name: rules for name, rules in found.items() if rules}


def exchange_settings(link: RouterLink) -> dict[str, object]:
    """Return the configuration of a session that only talks to those that it dials, or that dial it."""
    return {
        **_common(link.lease),
        "scouting/gossip/enabled": False,
        "mode": "peer",
        "listen/endpoints": list(link.listen),
        **_LISTENS_OR_FAILS,
        "connect/endpoints": list(link.connect),
        **_DIALS_FOREVER,
        **{f"transport/link/tls/{name}": value for name, value in link.tls.items()},
        "access_control": link.access,
    }


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


def open_lone(router: str) -> zenoh.Session:
    """Open the session of a process that is linked with the router only.

    Raises:
        OSError: if the router does not answer; once it has, the session waits for it.
    """
    return _answered(lone_settings(router), router)


def open_client(router: str) -> zenoh.Session:
    """Open the session of a visitor.

    Raises:
        OSError: if `router` is no endpoint, or does not answer.
    """
    return _answered(client_settings(router), router)


def _answered(settings: Mapping[str, object], router: str) -> zenoh.Session:
    try:
        return _opened(settings)
    except zenoh.ZError as error:
        raise OSError(errno.ECONNREFUSED, f"no router answers at {router}") from error


def open_router(endpoint: str, link: RouterLink = NO_LINK) -> zenoh.Session:
    """Open a router; those of other hosts need not be there yet.

    Raises:
        OSError: if `endpoint` is taken.
    """
    try:
        threads = _THREADS_WITH_LINKS if link.listen or link.connect else THREADS
        _routers.append(session := _opened(router_settings(endpoint, link), threads))
        return session
    except zenoh.ZError as error:
        if not _is_taken(error):
            raise
        raise OSError(errno.EADDRINUSE, f"{endpoint} is taken") from error


def open_exchange(link: RouterLink) -> zenoh.Session:
    """Open the session by which a robot gives to others what is shared, and takes what they share.

    Raises:
        OSError: if an endpoint is taken.
    """
    try:
        return _opened(exchange_settings(link))
    except zenoh.ZError as error:
        why = "is taken" if _is_taken(error) else f"cannot be opened: {_WHERE.sub('', str(error))}"
        raise OSError(errno.EADDRINUSE, f"{' and '.join(link.listen)} {why}") from error


def _is_taken(error: zenoh.ZError) -> bool:
    return any(cause in str(error) for cause in _TAKEN)


def open_beside(endpoint: str) -> zenoh.Session:
    """Open a session that is linked with nobody but the one that listens at `endpoint`, as soon as it does."""
    return _opened(
        {
            **_common(),
            "scouting/gossip/enabled": False,
            "mode": "peer",
            "listen/endpoints": [],
            "connect/endpoints": [endpoint],
            **_DIALS_FOREVER,
        }
    )


def _opened(settings: Mapping[str, object], threads: str = THREADS) -> zenoh.Session:
    os.environ.setdefault("ZENOH_RUNTIME", threads)  # read once, when the first session of a process opens
    return zenoh.open(_config(settings))


def _config(settings: Mapping[str, object]) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


_REMOTE = zenoh.Locality.REMOTE


class SessionLink:
    """Finds what a session has at its keys without asking it.

    Zenoh's admin space would list it, but a session that is asked can come to a standstill (zenoh 1.10): it holds the
    lock of its routing tables while it answers and needs that lock again for each answer, behind anybody who wants to
    write. On a link of its own, what matches is that session's, as is what is heard.
    """

    def __init__(self, endpoint: str, id: str, subscribed: Iterable[str], served: Iterable[str]) -> None:
        """Link with the session that listens, or will listen, at an endpoint; look for what it has at these keys.

        `id` is that of the session: somebody else may have taken its port.
        """
        self._session = session = open_beside(endpoint)
        self._id = id
        self._partners: dict[str, Any] = {}  # Zenoh's stubs have another type for how they match
        for key in subscribed:
            self._partners[key] = session.declare_publisher(key, allowed_destination=_REMOTE)
        for key in served:
            self._partners[key] = session.declare_querier(key, allowed_destination=_REMOTE)
        self._heard: set[str] = set()
        self._subscriber: zenoh.Subscriber[None] | None = None

    @property
    def is_linked(self) -> bool:
        """Return whether that session is at the other end."""
        return self._id in map(str, self._session.info.peers_zid())

    def listen(self, keys: str | None) -> None:
        """Hear from now on what it publishes at `keys`, an expression; with None, nothing."""
        if self._subscriber is not None and keys is None:
            self._subscriber.undeclare()  # type: ignore[no-untyped-call]
            self._subscriber = None
        elif self._subscriber is None and keys is not None:
            hear = self._heard.add
            self._subscriber = self._session.declare_subscriber(keys, lambda sample: hear(str(sample.key_expr)))

    def heard(self) -> list[str]:
        """Return the keys at which something was heard."""
        return list(self._heard)

    def matching(self) -> list[str]:
        """Return the keys to which it subscribes, or which it serves, of those that are looked for."""
        return [key for key, partner in self._partners.items() if partner.matching_status.matching]

    def close(self) -> None:
        """End the link."""
        self._session.close()  # type: ignore[no-untyped-call]
