"""A skill that can pause is held by an interrupt only if it is to go on afterwards."""

from __future__ import annotations

from tests.missions.simulated import Simulated, simulate

TEXT = """
interrupts:
  opened:
    when: $door
    do: react
    afterwards: {afterwards}
do:
  for: room
  in: [dock, kitchen]
  do:
    - hold
    - log: done
"""


def opened(afterwards: str) -> Simulated:
    """Return a mission whose skill, of 4 s, is cut short by a reaction of 1 s when it has run for 1 s."""
    simulated = simulate(TEXT.format(afterwards=afterwards), takes={"hold": 4.0})
    simulated.at(1.0, lambda: simulated.set("door", True))
    return simulated


def test_one_that_goes_on_is_held_and_keeps_what_it_has_done() -> None:
    simulated = opened("continue")
    simulated.at(1.5, lambda: simulated.set("door", False))
    simulated.advance(1.5)
    assert len(simulated.held) == 1
    simulated.advance(20.0)
    assert "5 hold: success (5 s)" in simulated.told


def test_one_that_begins_again_is_halted_before_the_reaction() -> None:
    simulated = opened("{restart: room}")
    simulated.at(1.5, lambda: simulated.set("door", False))
    simulated.advance(1.5)
    assert simulated.held == {}
    assert simulated.told.index("1 hold: halted (1 s)") < simulated.told.index("1 react")
    simulated.advance(20.0)
    assert "6 hold: success (4 s)" in simulated.told
