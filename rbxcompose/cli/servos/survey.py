"""Which servos on a port can be one robot: those that answer alone at one rate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from rbxcompose.actuation.bus import FoundServo
from rbxcompose.actuation.dynamixel_bus import DynamixelBus
from rbxcompose.actuation.servo_findings import ID_TAKEN, OTHER_RATE, UNKNOWN_MODEL
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding

_IDS = range(1, 253)
_CHECKED = ("present_position", "present_temperature")


@dataclass(frozen=True, slots=True)
class Survey:
    """What answers at one rate: servos that are alone at their ids, and ids with more than one, in protocols."""

    found: Sequence[FoundServo]
    crowded: Sequence[int] = ()


@dataclass(frozen=True, slots=True)
class Choice:
    """The servos of a robot, all at one rate [bit/s], and what is to be said about the others."""

    baud: int
    servos: Sequence[FoundServo]
    findings: Sequence[Finding]


def survey(bus: DynamixelBus, ids: Iterable[int], protocols: Sequence[int]) -> Survey:
    """Look for servos; one that answers a ping but no read shares its id."""
    found: list[FoundServo] = []
    crowded: list[int] = []
    for one in ids:
        counted = {protocol: bus.count(one, protocol) for protocol in protocols}
        pings = (bus.ping(one, protocol) for protocol in protocols if counted[protocol] == 1)
        answers = [answer for answer in pings if answer]
        if sum(counted.values()) > 1 or not all(_is_readable(bus, answer) for answer in answers):
            crowded.append(one)
        else:
            found += answers
    return Survey(found, crowded)


def _is_readable(bus: DynamixelBus, found: FoundServo) -> bool:
    if found.model is None:
        return True
    bus.servos[found.id] = found.model
    is_readable = bool(bus.read([found.id], _CHECKED))
    del bus.servos[found.id]
    return is_readable


def choose(surveys: Mapping[int, Survey], port: str) -> Choice:
    """Return the servos at the rate that most of them have, the higher one if two have as many.

    Raises:
        ValueError: if there is no survey.
    """
    baud = max(surveys, key=lambda rate: (len(_usable(surveys[rate])), rate))
    chosen = _usable(surveys[baud])
    return Choice(baud, chosen, tuple(_left_out(surveys, baud, chosen, port)))


def _usable(one: Survey) -> list[FoundServo]:
    return [found for found in one.found if found.model]


def _left_out(surveys: Mapping[int, Survey], baud: int, chosen: Sequence[FoundServo], port: str) -> Iterator[Finding]:
    taken = {one.id for one in chosen}
    for rate, there in surveys.items():
        for id_ in there.crowded:
            message = f"more than one servo answers at id {id_} with {rate} bit/s; it is left out"
            yield ID_TAKEN.at(None, message, help=f"connect one alone: rbxcompose servo set-id {id_} NEW --port {port}")
        for found in there.found:
            if found.model is None:
                message = f"the servo at id {found.id} is {found.name}, which is not known; it is left out"
                yield UNKNOWN_MODEL.at(None, message)
            elif rate != baud:
                message = f"the {found.name} at id {found.id} has {rate} bit/s, the bus {baud}; it is left out"
                yield OTHER_RATE.at(None, message, help=_moved(found, baud, taken, port))
                taken.add(found.id)


def _moved(found: FoundServo, baud: int, taken: set[int], port: str) -> str:
    """Return how a servo comes to another rate, and to another id if its own is taken there."""
    code = found.model.code_of(baud) if found.model else None
    if code is None:
        return f"its model does not have {baud} bit/s: give the others a rate that it has"
    where = f"--port {port} --baud {found.baud}"
    steps, id_ = [], found.id
    if id_ in taken:
        id_ = next((one for one in _IDS if one not in taken), id_)
        steps.append(f"rbxcompose servo set-id {found.id} {id_} {where}")
    steps += [f"rbxcompose servo relax {id_} {where}", f"rbxcompose servo write {id_} baud={code} {where}"]
    return "; ".join(steps)
