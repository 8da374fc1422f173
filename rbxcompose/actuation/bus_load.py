"""How much a cycle puts on the wire of a bus of servos: bytes, and pauses of servos before they answer.

It counts what the driver sends and what servos answer, if each does at the first request. A USB adapter adds its own
latency to each.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

from rbxcompose.actuation.cycle_items import FAST, slow_items
from rbxcompose.actuation.groups import FACTORY_DELAY, REPLY, ROOM, in_chunks, request_groups
from rbxcompose.actuation.servo_models import ServoModel
from rbxcompose.actuation.transfers import Stretch, read_plan, write_plans
from rbxcompose.dataclass import dataclass

_BITS = 10  # of a byte on the wire, with those that begin and end it
_REQUEST = {1: 6, 2: 10}  # [B] of a request without parameters, by protocol
_NUMBER = {1: 1, 2: 2}  # [B] of an address or a length


@dataclass(frozen=True, slots=True)
class BusLoad:
    """What a cycle puts on the wire: bytes in both directions, and replies."""

    length: int = 0
    replies: int = 0

    def __add__(self, other: BusLoad) -> BusLoad:
        """Return both, one after the other."""
        return BusLoad(self.length + other.length, self.replies + other.replies)

    def time(self, baud: float, delay: float = FACTORY_DELAY) -> float:
        """Return how long it takes [s] at a rate [bit/s], if servos pause before each reply [s]."""
        return _BITS * self.length / baud + self.replies * delay

    def baud_for(self, period: float, delay: float = FACTORY_DELAY) -> float:
        """Return the least rate [bit/s] at which it takes no longer than a period [s]; infinite if there is none."""
        left = period - self.replies * delay
        return _BITS * self.length / left if left > 0.0 else math.inf


def cycle_load(servos: Mapping[int, tuple[ServoModel, str]]) -> BusLoad:
    """Return the load of the longest cycle of servos, by id with their modes: all are read, and all get a new goal."""
    models = {id_: model for id_, (model, _) in servos.items()}
    slow = (_reading({id_: model}, slow_items(model)) for id_, model in models.items())
    longest = max(slow, key=lambda one: one.time(1_000_000), default=BusLoad())
    return _reading(models, FAST) + longest + _writing(servos)


def _reading(models: Mapping[int, ServoModel], items: Sequence[str]) -> BusLoad:
    plans = {id_: read_plan(model, items).stretches for id_, model in models.items()}
    load = BusLoad()
    for protocol, ids in request_groups(models):
        for turn in range(max(len(plans[id_]) for id_ in ids)):
            wanted = [plans[id_][turn] for id_ in ids if turn < len(plans[id_])]
            answers = sum(REPLY[protocol] + one.length for one in wanted)
            load += BusLoad(_request(protocol, wanted) + answers, len(wanted))
    return load


def _request(protocol: int, wanted: Sequence[Stretch]) -> int:
    """Return the length of a request for one stretch of each of several servos [B]."""
    place = 2 * _NUMBER[protocol]
    if len(wanted) == 1:
        return _REQUEST[protocol] + place
    if protocol == 1:
        return _REQUEST[1] + 1 + 3 * len(wanted)
    if len(set(wanted)) == 1:
        return _REQUEST[2] + place + len(wanted)
    return _REQUEST[2] + (1 + place) * len(wanted)


def _writing(servos: Mapping[int, tuple[ServoModel, str]]) -> BusLoad:
    groups: dict[tuple[int, Stretch], list[int]] = defaultdict(list)
    for id_, (model, mode) in servos.items():
        for plan in write_plans(model, [f"goal_{mode}"]):
            groups[model.protocol, plan.stretch].append(id_)
    return sum((_group_write(protocol, at, ids) for (protocol, at), ids in groups.items()), BusLoad())


def _group_write(protocol: int, at: Stretch, ids: Iterable[int]) -> BusLoad:
    """Return the load of writing the same stretch of several servos, which nobody answers."""
    each, head = 1 + at.length, _REQUEST[protocol] + 2 * _NUMBER[protocol]
    return BusLoad(sum(head + each * len(chunk) for chunk in in_chunks(ids, each, ROOM[protocol])))
