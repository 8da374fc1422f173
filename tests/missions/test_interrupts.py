"""Interrupts: when they act, what they cut, how the mission goes on."""

from __future__ import annotations

from tests.missions.simulated import Simulated, simulate
from tests.missions.test_composites import fails, skills

LOW = """
interrupts:
  low:
    when: $battery < 50 %
    do: recharge
    afterwards: continue
do:
{}
"""


def low(body: str, *, at: float = 1.5, **settings: object) -> Simulated:
    """Return a mission whose battery is low at a time and full after `recharge`."""
    text = LOW.replace("{}", "\n".join(f"  {line}" for line in body.splitlines()))
    simulated = simulate(text, **settings)
    simulated.set("battery", 1.0)
    simulated.at(at, lambda: simulated.set("battery", 0.4))
    return simulated


def test_the_leaf_that_was_cut_short_starts_again_and_what_was_done_is_not_done_again() -> None:
    simulated = low("- a\n- b\n- c")
    assert simulated.advance(20) == "success"
    assert simulated.told == [
        "0 a",
        "1 a: success (1 s)",
        "1 b",
        "1.5 interrupt low: $battery < 50 % (battery 40 %)",
        "1.5 b: halted (0.5 s)",
        "1.5 recharge",
        "2.5 recharge: success (1 s)",
        "2.5 interrupt low done, back to b",
        "2.5 b",
        "3.5 b: success (1 s)",
        "3.5 c",
        "4.5 c: success (1 s)",
        "4.5 mission test: success",
    ]


def test_a_result_of_the_same_instant_comes_first_so_that_nothing_is_done_twice() -> None:
    simulated = low("- a\n- b", at=1.0)
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "1 recharge", "2 b"]


def test_wait_goes_on_with_the_rest() -> None:
    simulated = low("- wait: 4 s\n- a", takes={"recharge": 10.0})
    simulated.advance(40)
    assert skills(simulated) == ["1.5 recharge", "14 a"]


def test_every_goes_on_with_the_rest() -> None:
    simulated = low("repeat: 2\nevery: 5 s\ndo: a", takes={"recharge": 10.0})
    simulated.advance(40)
    assert skills(simulated) == ["0 a", "1.5 recharge", "15 a"]


def test_the_modifiers_of_the_leaf_start_again_and_those_around_it_go_on() -> None:
    own = low("- a:\n  timeout: 2 s", takes={"a": 1.9})
    assert own.advance(20) == "success"
    around = low("sequence:\n  - a\ntimeout: 2.8 s", takes={"a": 1.9})
    assert around.advance(20) == "failure"
    assert around.told[-2] == "3.8 a: halted (1.3 s): timeout of 2.8 s"


def test_attempts_of_the_leaf_start_again() -> None:
    simulated = low("a:\nattempts: 2", fails={"a": fails(1, 3)})
    assert simulated.advance(20) == "success"
    assert simulated.calls["a"] == 4


def test_an_interrupt_that_holds_from_the_start_comes_before_the_mission() -> None:
    simulated = low("- a")
    simulated.set("battery", 0.1)
    simulated.changes.clear()
    simulated.advance(20)
    assert skills(simulated) == ["0 recharge", "1 a"]


def test_an_interrupt_acts_again_only_after_its_condition_was_false() -> None:
    simulated = low("- a\n- b", takes={"a": 10.0})
    simulated.at(5.0, lambda: simulated.set("battery", 0.3))
    simulated.advance(40)
    assert simulated.calls["recharge"] == 2


def test_one_that_still_holds_after_its_reaction_is_reported_and_does_not_act_again() -> None:
    simulated = simulate(LOW.replace("recharge", "react").format("  a"), takes={"a": 3.0})
    simulated.set("battery", 0.1)
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 react", "1 a"]
    assert "1 mission.yaml:3: its condition still holds" in "\n".join(simulated.told)


def test_a_value_that_has_not_arrived_cuts_nothing() -> None:
    simulated = simulate(LOW.format("  a"))
    assert simulated.advance(20) == "success"
    assert simulated.calls == {"a": 1}


def test_a_failed_reaction_ends_the_mission_in_failure() -> None:
    simulated = low("- a\n- b", fails={"recharge": fails(1)})
    assert simulated.advance(20) == "failure"
    assert simulated.told[-1].endswith("the reaction of 'low' failed: mission.yaml:5: no luck")
    assert simulated.running == {}


def test_a_skipped_reaction_is_a_success() -> None:
    text = LOW.replace("do: recharge", "do:\n      react:\n      only_if: 1 > 2").format("  a")
    simulated = simulate(text)
    simulated.set("battery", 0.1)
    assert simulated.advance(20) == "success"
    assert simulated.calls == {"a": 1}


def test_an_interrupt_without_a_reaction_only_starts_the_leaf_again() -> None:
    simulated = low("- a").program
    text = LOW.replace("    do: recharge\n", "").format("  a")
    again = simulate(text)
    again.set("battery", 1.0)
    again.at(0.5, lambda: again.set("battery", 0.1))
    assert again.advance(20) == "success"
    assert skills(again) == ["0 a", "0.5 a"]
    assert simulated.interrupts[0].root is not None


TWO = """
interrupts:
  urgent:
    when: $door
    do: first
  low:
    when: $battery < 50 %
    do: [second, react]
do: a
"""


def two(**settings: object) -> Simulated:
    simulated = simulate(TWO, takes={"a": 10.0, "second": 2.0}, **settings)
    simulated.set("battery", 1.0)
    simulated.set("door", False)
    return simulated


def test_of_two_that_hold_the_first_wins_and_the_other_follows() -> None:
    simulated = two()
    simulated.at(1.0, lambda: simulated.set("door", True))
    simulated.at(1.0, lambda: simulated.set("battery", 0.1))
    simulated.advance(40)
    assert skills(simulated) == ["0 a", "1 first", "2 second", "4 react", "5 a"]


def test_an_earlier_interrupt_cuts_the_reaction_of_a_later_one_which_then_goes_on() -> None:
    simulated = two()
    simulated.at(1.0, lambda: simulated.set("battery", 0.1))
    simulated.at(2.0, lambda: simulated.set("door", True))
    simulated.advance(40)
    assert skills(simulated) == ["0 a", "1 second", "2 first", "3 second", "5 react", "6 a"]


def test_a_later_interrupt_waits_for_the_reaction_of_an_earlier_one() -> None:
    simulated = two()
    simulated.at(1.0, lambda: simulated.set("door", True))
    simulated.at(1.5, lambda: simulated.set("battery", 0.1))
    simulated.advance(40)
    assert skills(simulated) == ["0 a", "1 first", "2 second", "4 react", "5 a"]


def test_an_interrupt_never_cuts_its_own_reaction() -> None:
    simulated = low("- a", takes={"a": 9.0, "recharge": 4.0})
    simulated.at(2.0, lambda: simulated.set("battery", 0.9))
    simulated.at(3.0, lambda: simulated.set("battery", 0.2))
    simulated.at(3.2, lambda: simulated.set("battery", 0.9))
    simulated.advance(40)
    assert simulated.calls["recharge"] == 1


def test_the_mission_goes_on_only_after_the_interrupts_were_looked_at_once_more() -> None:
    simulated = two()
    simulated.at(1.0, lambda: simulated.set("door", True))
    simulated.at(2.0, lambda: simulated.set("battery", 0.1))
    simulated.advance(40)
    assert skills(simulated)[:3] == ["0 a", "1 first", "2 second"]


def test_two_interrupts_that_set_each_other_off_are_slowed_down_and_named() -> None:
    text = """
    data: {x: 0}
    interrupts:
      ping:
        when: $x == 0
        do:
          set: {x: 1}
      pong:
        when: $x == 1
        do:
          set: {x: 0}
    do: a
    """
    simulated = simulate(text)
    assert simulated.advance(0.2) == "running"
    assert any("does not wait" in line for line in simulated.told)


def test_a_condition_without_a_value_is_reported_once_and_does_not_hold() -> None:
    simulated = simulate(LOW.replace("$battery < 50 %", "1 / $battery > 2").format("  - a\n  - b"))
    simulated.set("battery", 0.0)
    assert simulated.advance(20) == "success"
    assert sum("division by zero" in line for line in simulated.told) == 1


def test_a_reaction_goes_on_although_its_condition_was_false_and_holds_again() -> None:
    simulated = low("- a", takes={"a": 9.0, "recharge": 4.0})
    simulated.at(2.0, lambda: simulated.set("battery", 0.9))
    simulated.at(3.0, lambda: simulated.set("battery", 0.2))
    assert simulated.advance(40) == "success"
    assert skills(simulated) == ["0 a", "1.5 recharge", "5.5 a"]


def test_one_whose_condition_was_false_during_its_reaction_acts_again_and_is_not_reported() -> None:
    simulated = simulate(LOW.replace("recharge", "react").format("  a"), takes={"a": 9.0, "react": 4.0})
    simulated.set("battery", 1.0)
    for time, level in ((1.0, 0.4), (2.0, 0.9), (3.0, 0.2), (6.0, 0.9)):
        simulated.at(time, lambda level=level: simulated.set("battery", level))  # type: ignore[misc]
    assert simulated.advance(40) == "success"
    assert skills(simulated) == ["0 a", "1 react", "5 react", "9 a"]
    assert not [line for line in simulated.told if "still holds" in line]


def test_new_counts_messages_since_the_interrupt_last_acted() -> None:
    simulated = simulate(LOW.replace("$battery < 50 %", "new($door)").replace("recharge", "react").format("  a"))
    simulated.set("door", True)
    simulated.takes = {"a": 9.0}
    for time in (1.0, 5.0):
        simulated.at(time, lambda: simulated.set("door", True))
    simulated.advance(40)
    assert skills(simulated) == ["0 a", "1 react", "2 a", "5 react", "6 a"]
