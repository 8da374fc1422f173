"""How many calls are carried out at once, and for how long."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from enum import Enum

from rbxcompose.base.requests import Refused

MOST_WAITING = 16  # in each lane


class Lane(Enum):
    """Calls of one lane wait for each other, and never for those of another; the value is how many go at once."""

    COMPILE = "2 that compile"
    LOOK = "4 that look at a robot"
    OPERATE = "4 that operate one"
    STOP = "4 that stop one"

    @property
    def at_once(self) -> int:
        """Return how many calls are carried out at once."""
        return int(self.value.split()[0])


class Lanes:
    """Lets calls go on when it is their turn."""

    def __init__(self, deadline: float) -> None:
        self._deadline = deadline
        self._turns = {lane: asyncio.Semaphore(lane.at_once) for lane in Lane}
        self._waiting = dict.fromkeys(Lane, 0)

    @asynccontextmanager
    async def turn(self, lane: Lane) -> AsyncIterator[None]:
        """Wait for a turn, and end it after the deadline.

        Raises:
            Refused: if too many wait already, or it takes too long.
        """
        if self._waiting[lane] >= MOST_WAITING:
            raise Refused("too many calls are waiting: try again")
        self._waiting[lane] += 1
        try:
            await self._turns[lane].acquire()
        finally:
            self._waiting[lane] -= 1
        try:
            async with asyncio.timeout(self._deadline):
                yield
        except TimeoutError as error:
            raise Refused(f"it took more than {self._deadline:g} s, and was ended") from error
        finally:
            self._turns[lane].release()
