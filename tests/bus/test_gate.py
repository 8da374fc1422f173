from __future__ import annotations

from dataclasses import dataclass, field

from rbxcompose.bus.local import Gate, Participant
from rbxcompose.bus.names import Attachment
from rbxcompose.bus.transport import Question
from tests.bus.conftest import Alone


@dataclass
class Asked:
    """A question of somebody elsewhere."""

    attachment: bytes = b""
    payload: bytes = b""
    refused: list[str] = field(default_factory=list)

    def reply(self, payload: bytes, attachment: bytes, reason: str = "") -> None:
        raise AssertionError("nobody answers here")

    def fail(self, error: str) -> None:
        self.refused.append(error)


def by(client: int) -> Asked:
    return Asked(Attachment(1, 0, bytes([client] * 16)).encode())


def gate(alone: Alone, taken: list[Question], rate: float = 10.0) -> Gate:
    return Gate(Participant(alone.bus._process, "base"), "/set_level", rate, taken.append)


def test_so_many_are_taken_in_a_second_and_the_rest_is_told_to_who_asks_and_to_us(alone: Alone) -> None:
    taken: list[Question] = []
    one = gate(alone, taken)
    asked = [by(1) for _ in range(25)]
    for question in asked:
        one(question)
    assert taken == asked[:10]
    assert all(question.refused == ["more than 10 requests a second"] for question in asked[10:])
    assert one.refusals.total == 15
    alone.settle(0.5)
    for question in asked:
        one(question)
    assert len(taken) == 15


def test_a_flood_costs_other_askers_nothing(alone: Alone) -> None:
    taken: list[Question] = []
    one = gate(alone, taken)
    for _ in range(100):
        one(by(1))
    calm = by(2)
    one(calm)
    assert taken[-1] is calm


def test_who_does_not_say_who_it_is_shares_one_allowance(alone: Alone) -> None:
    taken: list[Question] = []
    one = gate(alone, taken)
    for number in range(30):
        one(Asked(b"x" * number))
    assert len(taken) == 10


def test_a_gate_is_known_until_it_is_closed(alone: Alone) -> None:
    one = gate(alone, [])
    assert list(alone.bus.gates) == [one]
    one.close()
    assert list(alone.bus.gates) == []
