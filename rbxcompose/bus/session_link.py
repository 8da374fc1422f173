"""A link with one session and nobody else's: it shows what that session has."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import zenoh

from rbxcompose.bus.zenoh_session import open_beside

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
