"""The patrol of the language page: cut short at a corner, it docks, recharges, and goes on at that corner."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.base.config import Place
from tests.missions.simulated import PLACES, Simulated, program_of
from tests.missions.test_composites import skills

PATROL = Path(__file__).parents[2] / "missions" / "patrol.yaml"


@pytest.fixture
def patrol(monkeypatch: pytest.MonkeyPatch) -> Simulated:
    """The patrol with one round; each leg takes 3 s, charging 5 s."""
    for name in ("corner_3", "corner_4"):
        monkeypatch.setitem(PLACES, name, Place(name, 0.0, 1.0, 0.0))
    program = program_of(PATROL.read_text(encoding="utf-8"))
    simulated = Simulated(program, {"rounds": 1.0}, takes={"go_to": 3.0, "recharge": 5.0})
    simulated.set("battery", 1.0)
    return simulated


def test_it_resumes_at_the_corner_where_it_was_cut_short(patrol: Simulated) -> None:
    patrol.at(4.0, lambda: patrol.set("battery", 0.2))
    assert patrol.advance(100.0) == "success"
    assert patrol.told[:9] == [
        "0 go_to corner_1",
        "3 go_to corner_1: success (3 s)",
        "3 go_to corner_2",
        "4 interrupt battery_low: $battery < $low (battery 20 %)",
        "4 go_to corner_2: halted (1 s)",
        "4 go_to dock",
        "7 go_to dock: success (3 s)",
        "7 recharge",
        "12 recharge: success (5 s)",
    ]
    assert patrol.told[9] == "12 interrupt battery_low done, back to go_to corner_2"
    assert skills(patrol)[4:] == ["12 go_to corner_2", "15 go_to corner_3", "18 go_to corner_4"]
    assert patrol.told[-1] == "21 mission test: success"
    assert patrol.story.skills() == "go_to 6 (5 success, 1 halted), recharge 1 (1 success)"


def test_a_corner_that_cannot_be_reached_does_not_end_it(patrol: Simulated) -> None:
    patrol.takes = {"go_to": 11.0}
    assert patrol.advance(100.0) == "success"
    assert skills(patrol) == [f"{10 * leg} go_to corner_{leg + 1}" for leg in range(4)]


def test_a_dock_that_cannot_be_reached_does(patrol: Simulated) -> None:
    patrol.fails = {"go_to": frozenset({3})}
    patrol.at(4.0, lambda: patrol.set("battery", 0.2))
    assert patrol.advance(100.0) == "failure"
