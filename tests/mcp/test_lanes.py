"""Calls wait for others of their kind only, not for long, and not too many of them."""

from __future__ import annotations

import asyncio

from rbxcompose.tools.mcp.tools import MOST_WAITING, Lane, Lanes

LATE, BUSY = "it took more than 0.01 s, and was ended", "too many calls are waiting: try again"


async def never(lanes: Lanes, lane: Lane) -> None:
    """Make a call that does not end by itself."""
    async with lanes.turn(lane):
        await asyncio.Event().wait()


def test_a_call_ends_at_its_deadline_and_who_comes_while_too_many_wait_is_sent_away() -> None:
    async def crowd() -> list[str]:
        lanes = Lanes(0.01)
        calls = (never(lanes, Lane.COMPILE) for _ in range(Lane.COMPILE.at_once + MOST_WAITING + 3))
        return [str(end) for end in await asyncio.gather(*calls, return_exceptions=True)]

    assert asyncio.run(crowd()) == [LATE] * (Lane.COMPILE.at_once + MOST_WAITING) + [BUSY] * 3


def test_a_stop_waits_for_nothing_else() -> None:
    async def stop() -> str:
        lanes = Lanes(60.0)
        others = [
            asyncio.ensure_future(never(lanes, lane)) for lane in Lane for _ in range(10) if lane is not Lane.STOP
        ]
        await asyncio.wait(others, timeout=0)
        async with lanes.turn(Lane.STOP):
            done = "stopped"
        for other in others:
            other.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        return done

    assert asyncio.run(stop()) == "stopped"
