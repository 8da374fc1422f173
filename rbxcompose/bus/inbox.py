"""Inboxes: where other threads leave what arrives, and from where the scheduler takes it, one at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Generic, TypeVar

T = TypeVar("T")
Post = Callable[[str, Callable[[], None]], object]  # has a callback run for an owner by the scheduler, soon


class Inbox(Generic[T]):
    """A bounded queue that keeps the newest; `put` may be called by any thread, all else only by the scheduler's."""

    def __init__(self, owner: str, depth: int | None, handle: Callable[[T], None], post: Post) -> None:
        """Have `handle` called for `owner` once per item; without a `depth` nothing is ever dropped."""
        self._owner, self._handle, self._post = owner, handle, post
        self._items: deque[T] = deque(maxlen=depth)
        self._is_posted = False
        self._arrivals = count(1)  # unlike `+= 1`, its `next` is one step even with several threads
        self._arrived = 0
        self._taken = 0

    def put(self, item: T, post: Post, *, at: int = 1) -> None:
        """Leave an item. `post` must suit the thread that calls; it is called once `at` items wait."""
        self._items.append(item)
        self._arrived = next(self._arrivals)
        # One wake-up suffices, however much comes until it is heeded.
        if not self._is_posted and len(self._items) >= at:
            self._is_posted = True
            post(self._owner, self._take)

    def take_all(self) -> None:
        """Handle at once what waits."""
        while self._items:
            self._taken += 1
            self._handle(self._items.popleft())

    def hold(self) -> None:
        """Let what comes wait until `go_on`."""
        self._is_posted = True  # as if it was about to be taken

    def go_on(self) -> None:
        """Have what waits handled, and what comes."""
        self._is_posted = bool(self._items)
        if self._is_posted:
            self._post(self._owner, self._take)

    @property
    def dropped(self) -> int:
        """Return how many items had to make room for newer ones."""
        return max(0, self._arrived - self._taken - len(self._items))

    def close(self) -> list[T]:
        """Let no more be handled and return what was not."""
        left = list(self._items)
        self._items = deque(maxlen=0)
        return left

    def _take(self) -> None:
        self._is_posted = False  # before looking: what comes from now on posts again
        if not self._items:
            return
        item = self._items.popleft()
        self._taken += 1
        if self._items and not self._is_posted:
            # One item per event: a busy inbox takes turns with the others, and an exception loses one item only.
            self._is_posted = True
            self._post(self._owner, self._take)
        self._handle(item)
