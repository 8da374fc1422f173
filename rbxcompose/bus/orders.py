"""Orders: messages whose sender knows whether those who carry them out are listening, here or in other processes."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from typing import TypeVar

from rbxcompose.bus.inbox import Inbox
from rbxcompose.bus.local import Participant
from rbxcompose.bus.tokens import EndpointToken, EntityKind, gid, parse_token, session_of
from rbxcompose.bus.topics import Publisher, Topics
from rbxcompose.msgs.types import Message
from rbxcompose.qos import Qos

M = TypeVar("M", bound=Message)


class OrderPublisher(Publisher[M]):
    """Publishes orders for the components `servers`.

    Only these count as listeners: a recorder or a person looking on does not carry out an order.
    """

    def __init__(
        self, topics: Topics, node: Participant, topic: str, message: type[M], qos: Qos, servers: Collection[str]
    ) -> None:
        super().__init__(topics, node, topic, message, qos)
        self._servers = frozenset(servers)
        self._elsewhere: dict[str, bytes] = {}  # tokens of subscriptions in other processes, each with its GID
        self._watchers: list[Callable[[], None]] = []
        self._inbox: Inbox[Callable[[], None]] = Inbox(
            node.owner, None, lambda callback: callback(), node.process.scheduler.post
        )
        pattern = node.peers(EntityKind.SUBSCRIPTION, topic, message)
        self._tokens = node.process.transport.watch(pattern, self._token_changed)

    @property
    def listeners(self) -> frozenset[bytes]:
        """Return the GIDs of the subscriptions that would receive an order now."""
        here = {one.gid for one in self._topics.subscriptions.at(self.route) if one.owner in self._servers}
        # A token may be known before its connection can be used.
        return frozenset(here | set(self._elsewhere.values() if self.has_match else ()))

    def watch(self, changed: Callable[[], None], /) -> None:
        """Call `changed` whenever a subscriber comes or goes."""
        self._watchers.append(changed)

    def look_again(self) -> None:
        """React to a change of the subscriptions in this process."""
        self._inbox.put(self._tell, self._process.scheduler.post)

    def close(self) -> None:
        """Withdraw the publisher and stop watching."""
        super().close()
        self._tokens.close()
        self._inbox.close()

    def _token_changed(self, key: str, is_there: bool) -> None:
        # In a thread of the transport.
        token = parse_token(key)
        is_ours = session_of(key) == self._process.transport.session
        if isinstance(token, EndpointToken) and token.node.name in self._servers and not is_ours:
            self._inbox.put(partial(self._note, key, is_there), self._process.transport.wake)

    def _note(self, key: str, is_there: bool) -> None:
        if is_there:
            self._elsewhere[key] = gid(key)
        else:
            self._elsewhere.pop(key, None)
        self._tell()

    def _tell(self) -> None:
        for watcher in self._watchers:
            watcher()
