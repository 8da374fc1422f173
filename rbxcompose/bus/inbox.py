"""Inboxes: other threads put in what arrives, and the scheduler takes it out one item at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Generic, TypeVar

T = TypeVar("T")
Post = Callable[[str, Callable[[], None]], object]  # makes the scheduler run a callback for an owner, soon


class Inbox(Generic[T]):
    """A bounded queue that keeps the newest items; any thread may call `put`, only the scheduler's the rest."""

    def __init__(self, owner: str, depth: int | None, handle: Callable[[T], None], post: Post) -> None:
        """Call `handle` for `owner` once per item; without a `depth`, nothing is ever dropped."""
        self._owner, self._handle, self._post = owner, handle, post
        self._items: deque[T] = deque(maxlen=depth)
        self._is_posted = False
        self._arrivals = count(1)  # unlike `+= 1`, its `next` is atomic
        self._arrived = 0
        self._taken = 0

    def put(self, item: T, post: Post, *, at: int = 1) -> None:
        """Put in an item. `post` must suit the calling thread; it is called once `at` items wait."""
        self._items.append(item)
        self._arrived = next(self._arrivals)
        # One wake-up suffices, however much arrives before it takes effect.
        if not self._is_posted and len(self._items) >= at:
            self._is_posted = True
            post(self._owner, self._take)

    def take_all(self) -> None:
        """Handle all waiting items immediately."""
        while self._items:
            self._taken += 1
            self._handle(self._items.popleft())

    def hold(self) -> None:
        """Keep arriving items waiting until `go_on`."""
        self._is_posted = True  # as if the items were about to be taken

    def go_on(self) -> None:
        """Handle the waiting items, and new ones as they arrive."""
        self._is_posted = bool(self._items)
        if self._is_posted:
            self._post(self._owner, self._take)

    @property
    def dropped(self) -> int:
        """Return how many items had to make room for newer ones."""
        return max(0, self._arrived - self._taken - len(self._items))

    def close(self) -> list[T]:
        """Handle no more items and return those left."""
        left = list(self._items)
        self._items = deque(maxlen=0)
        return left

    def _take(self) -> None:
        self._is_posted = False  # before looking: later arrivals post again
        if not self._items:
            return
        item = self._items.popleft()
        self._taken += 1
        if self._items and not self._is_posted:
            # One item per event: a busy inbox takes turns with the others, and an exception loses only one item.
            self._is_posted = True
            self._post(self._owner, self._take)
        self._handle(item)
