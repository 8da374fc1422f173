"""Which servos one request can ask, how long packets are, and how long servos pause; known without the SDK."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from rbxcompose.actuation.servo_models import ServoModel

REPLY: Mapping[int, int] = {1: 6, 2: 11}
"""Length of a reply without data, by protocol [B]."""
ROOM: Mapping[int, int] = {1: 230, 2: 900}
"""What of several servos fits into one request, by protocol [B]."""
FACTORY_DELAY = 0.0005
"""Pause of servos before a reply, as they are sold [s]."""
_BULK, _REQUEST = 200, 5  # [B] of a bulk read in 1.0; of one servo in a group request, at most


def in_chunks(ids: Iterable[int], each: int, most: int) -> Iterator[list[int]]:
    """Yield ids in groups of which each fits into one request of `most` bytes, at `each` [B] per id."""
    whole, size = list(ids), max(1, most // each)
    for start in range(0, len(whole), size):
        yield whole[start : start + size]


def request_groups(models: Mapping[int, ServoModel]) -> Iterator[tuple[int, list[int]]]:
    """Yield a protocol and the ids that one request can ask."""
    two = [servo for servo, model in models.items() if model.protocol == 2]
    for chunk in in_chunks(two, _REQUEST, ROOM[2]):
        yield 2, chunk
    one = [servo for servo, model in models.items() if model.protocol == 1]
    bulk = [servo for servo in one if models[servo].family.has_bulk_read]
    for chunk in in_chunks(bulk, _REQUEST, _BULK):
        yield 1, chunk
    yield from ((1, [servo]) for servo in one if servo not in bulk)
