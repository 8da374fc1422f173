"""What comes after the reaction to an interrupt: continue, restart, end; and what stands still meanwhile."""

from __future__ import annotations

import pytest

from tests.missions.simulated import Simulated, simulate
from tests.missions.test_composites import fails, skills

OPEN = """
data: {{n: 0}}
interrupts:
  open:
    when: $door
    do: react
    afterwards: {afterwards}
do:
{body}
"""


def opened(afterwards: str, body: str, *, at: float = 1.5, **settings: object) -> Simulated:
    """Return a mission that is cut short when the door opens."""
    lines = "\n".join(f"  {line}" for line in body.splitlines())
    simulated = simulate(OPEN.format(afterwards=afterwards, body=lines), **settings)
    simulated.at(at, lambda: simulated.set("door", True))
    return simulated


def test_continue_is_the_default() -> None:
    simulated = opened("continue", "- a\n- b")
    default = simulate(OPEN.replace("    afterwards: {afterwards}\n", "").format(body="  - a\n  - b"))
    default.at(1.5, lambda: default.set("door", True))
    assert (simulated.advance(20), simulated.told) == (default.advance(20), default.told)


def test_a_named_node_begins_again_and_what_was_before_it_stays_done() -> None:
    simulated = opened("{restart: middle}", "- a\n- sequence: [b, c]\n  name: middle\n- d", at=2.5)
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 c", "2.5 react", "3.5 b", "4.5 c", "5.5 d"]


def test_a_named_node_that_does_not_run_is_no_reason_to_restart() -> None:
    simulated = opened("{restart: last}", "- a\n- b\n- sequence: [c, d]\n  name: last")
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 react", "2.5 b", "3.5 c", "4.5 d"]


def test_the_current_round_of_a_loop_begins_again() -> None:
    simulated = opened("{restart: word}", "for: word\nin: [1, 2, 3]\ndo:\n  - say: $word\n  - b", at=3.5)
    assert simulated.advance(20) == "success"
    assert skills(simulated)[3:6] == ["3 b", "3.5 react", "4.5 say 2"]
    assert [line.split()[-1] for line in skills(simulated) if "say" in line] == ["1", "2", "2", "3"]


@pytest.mark.parametrize(
    ("afterwards", "at", "told"),
    [
        ("continue", 1.5, "interrupt open done, back to b"),
        ("restart", 1.5, "interrupt open done, the mission starts again"),
        ("{restart: last}", 2.5, "interrupt open done, last starts again"),
        ("{restart: last}", 1.5, "interrupt open done, back to b"),  # it does not run
    ],
)
def test_the_story_tells_how_it_goes_on(afterwards: str, at: float, told: str) -> None:
    simulated = opened(afterwards, "- a\n- b\n- sequence: [c, d]\n  name: last", at=at)
    simulated.advance(20)
    assert [line.partition(" ")[2] for line in simulated.told if "open done" in line] == [told]


def test_restart_begins_the_whole_with_fresh_data() -> None:
    simulated = opened("restart", "- set: {n: $n + 1}\n- a\n- b")
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 react", "2.5 a", "3.5 b"]
    assert simulated.engine.data["n"] == 1


def test_end_ends_in_success_and_halts_what_was_cut_short() -> None:
    simulated = opened("end", "- a\n- b")
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 react"]
    assert simulated.ended == "success"


def test_restart_drops_the_reactions_that_were_cut() -> None:
    text = """
    interrupts:
      open:
        when: $door
        do: first
        afterwards: restart
      low:
        when: $battery < 50 %
        do: [second, react]
    do: a
    """
    simulated = simulate(text, takes={"a": 3.0})
    simulated.set("battery", 1.0)
    simulated.at(1.0, lambda: simulated.set("battery", 0.1))
    simulated.at(1.5, lambda: simulated.set("door", True))
    simulated.at(1.5, lambda: simulated.set("battery", 1.0))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 second", "1.5 first", "2.5 a"]


@pytest.mark.parametrize(("result", "outcome"), [("success", "success"), ("failure", "failure")])
def test_end_as_a_node_ends_the_mission_from_anywhere_in_it(result: str, outcome: str) -> None:
    text = (
        "do:\n  - parallel:\n      one: a\n      two:\n"
        f"        - b\n        - end: {result}\n          message: enough\n  - c"
    )
    simulated = simulate(text, takes={"a": 9.0})
    assert simulated.advance(20) == outcome
    assert simulated.running == {}
    assert skills(simulated) == ["0 a", "0 b"]
    assert simulated.told[-1] == f"1 mission test: {outcome}: enough" or outcome == "success"


def test_end_in_a_reaction_ends_the_mission() -> None:
    text = (
        "interrupts:\n  open:\n    when: $door\n    do:\n"
        "      - react\n      - end: failure\n        message: an open door\ndo: a"
    )
    simulated = simulate(text, takes={"a": 9.0})
    simulated.at(1.0, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "failure"
    assert simulated.told[-1] == "2 mission test: failure: an open door"


def test_end_ignores_modifiers_around_it() -> None:
    simulated = simulate("do:\n  sequence: [{end: failure}]\n  optional: true\n  attempts: 3")
    assert simulated.advance(5) == "failure"


def test_a_skill_that_can_pause_is_held_and_resumed() -> None:
    simulated = opened("continue", "hold:\ntimeout: 4 s", takes={"hold": 3.0, "react": 5.0})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 hold", "1.5 react"]
    assert simulated.now == 8.0


def test_a_skill_that_is_held_is_halted_when_the_mission_ends() -> None:
    simulated = opened("end", "hold", takes={"hold": 3.0})
    simulated.advance(20)
    assert (simulated.held, simulated.running) == ({}, {})


def test_attempt_pause_goes_on_with_the_rest() -> None:
    simulated = opened(
        "continue", "a:\nattempts: 2\nattempt_pause: 3 s", takes={"react": 5.0}, fails={"a": fails(1)}, at=2.0
    )
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "2 react", "9 a"]


def test_timers_around_what_was_cut_short_stand_still() -> None:
    simulated = opened("continue", "sequence: [a, b]\ntimeout: 3.6 s", takes={"react": 9.0})
    assert simulated.advance(40) == "success"
    simulated = opened("continue", "sequence: [a, b]\ntimeout: 2.4 s", takes={"react": 9.0})
    assert simulated.advance(40) == "failure"
    assert simulated.now == pytest.approx(11.4)


USED = """
interrupts:
  low:
    when: $battery < 50 %
    do: recharge
    {}
do: [a, b]
"""


def test_the_interrupts_of_a_sub_mission_count_while_it_runs_and_after_those_of_its_caller() -> None:
    text = "interrupts:\n  open:\n    when: $door\n    do: react\ndo:\n  - use: inner\n  - c"
    simulated = simulate(text, {"inner": USED.format("")})
    simulated.set("battery", 1.0)
    simulated.at(0.5, lambda: simulated.set("door", True))
    simulated.at(0.5, lambda: simulated.set("battery", 0.1))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "0.5 react", "1.5 recharge", "2.5 a", "3.5 b", "4.5 c"]
    late = simulate(text, {"inner": USED.format("")})
    late.set("battery", 1.0)
    late.at(2.5, lambda: late.set("battery", 0.1))
    late.advance(20)
    assert skills(late) == ["0 a", "1 b", "2 c"]


def test_the_end_of_a_sub_mission_ends_only_that() -> None:
    simulated = simulate("do:\n  - use: inner\n  - c", {"inner": USED.format("afterwards: end")})
    simulated.set("battery", 0.1)
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 recharge", "1 c"]
    ended = simulate("do:\n  - use: inner\n    optional: true\n  - c", {"inner": "do: [a, {end: failure}, b]"})
    assert ended.advance(20) == "success"
    assert skills(ended) == ["0 a", "1 c"]


def test_a_mission_that_a_sub_mission_fails_tells_why() -> None:
    used = {"inner": "do: [a, {end: failure, message: no way in}]"}
    simulated = simulate("do: [{use: inner}]", used)
    simulated.advance(20)
    assert simulated.told[-1].endswith("failure: mission.yaml:1: no way in")


def test_a_sub_mission_that_its_reaction_ends_has_a_plain_outcome() -> None:
    text = """
    machine:
      start: s
      states:
        s:
          do: {use: inner}
          next: {success: finished, failure: failed}
    """
    used = "interrupts:\n  low:\n    when: $battery < 50 %\n    do: look\n    afterwards: end\ndo: a"
    simulated = simulate(text, {"inner": used}, outcomes={"look": ["person"]})
    simulated.set("battery", 0.1)
    assert simulated.advance(20) == "success"
    assert "person" not in simulated.told[-1]


def test_restarting_a_state_by_name_begins_its_body_again() -> None:
    text = """
    interrupts:
      open:
        when: $door
        afterwards: {restart: two}
    machine:
      start: one
      states:
        one:
          do: a
          next: {success: two, failure: failed}
        two:
          do: [b, c]
          next: {success: finished, failure: failed}
    """
    simulated = simulate(text)
    simulated.at(2.5, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 c", "2.5 b", "3.5 c"]


def test_a_reaction_does_not_see_the_items_of_loops() -> None:
    text = (
        "interrupts:\n  open:\n    when: $door\n    do:\n      say: $word\n"
        "do:\n  for: word\n  in: [1]\n  do:\n    say: $word"
    )
    with pytest.raises(AssertionError, match="word"):
        simulate(text)


THREE = """
interrupts:
  high:
    when: $door
    do: first
    afterwards: {{restart: {}}}
  low:
    when: $battery < 50 %
    do:
      - sequence: [second, react]
        name: inner
do:
  - a
  - sequence: [b, c]
    name: outer
  - d:
    name: last
"""


@pytest.mark.parametrize(
    ("name", "rest"),
    [
        ("inner", ["5 second", "6 react", "7 c", "8 d"]),  # in the reaction that was cut
        ("outer", ["5 react", "6 b", "7 c", "8 d"]),  # below it, in the mission itself
        ("last", ["5 react", "6 c", "7 d"]),  # what does not run
    ],
)
def test_what_is_restarted_may_be_in_a_later_reaction_or_below_it(name: str, rest: list[str]) -> None:
    simulated = simulate(THREE.format(name))
    simulated.set("battery", 1.0)
    simulated.at(2.5, lambda: simulated.set("battery", 0.1))
    simulated.at(4.0, lambda: simulated.set("door", True))
    assert simulated.advance(40) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 c", "2.5 second", "3.5 react", "4 first", *rest]


def test_restart_arms_the_other_interrupts_again() -> None:
    text = """
    interrupts:
      open:
        when: $door
        do: first
        afterwards: restart
      low:
        when: $battery < 50 %
        do: second
    do: a
    """
    simulated = simulate(text, takes={"a": 9.0})
    simulated.set("battery", 0.1)
    simulated.at(2.0, lambda: simulated.set("door", True))
    assert simulated.advance(40) == "success"
    assert skills(simulated) == ["0 second", "1 a", "2 first", "3 second", "4 a"]


LIMITED = "do:\n  sequence:\n    - a\n  timeout: 4 s"
CUTTING = "interrupts:\n  low:\n    when: $battery < 50 %\n    do: recharge\n"


@pytest.mark.parametrize(
    ("outer", "inner", "end", "at"),
    [
        ("", CUTTING + LIMITED, "success", 13.0),  # the sub-mission's own interrupt: its timer stands still
        (CUTTING, LIMITED, "success", 13.0),  # its caller's: also
        (CUTTING, "do: a\n", "success", 13.0),  # and the timer of the caller
        ("", CUTTING + "do: a\n", "failure", 4.0),  # but not the caller's, while the sub-mission reacts
    ],
)
def test_timers_stand_still_in_the_mission_whose_interrupt_acts(outer: str, inner: str, end: str, at: float) -> None:
    timeout = "" if "timeout" in inner else "\n  timeout: 4 s"
    simulated = simulate(f"{outer}do:\n  use: inner{timeout}", {"inner": inner}, takes={"a": 2.0, "recharge": 10.0})
    simulated.set("battery", 1.0)
    simulated.at(1.0, lambda: simulated.set("battery", 0.1))
    assert simulated.advance(40) == end
    assert simulated.now == at


def test_a_sub_mission_is_restarted_with_what_it_was_given() -> None:
    used = "inputs: {n: {type: number}}\ndata: {m: 0}\ninterrupts:\n  open:\n    when: $door\n    afterwards: restart\n"
    used += "do: [{set: {m: $m + 1}}, {log: $n and $m}, a]"
    text = "data: {n: 7}\ndo: [{use: one, with: {n: $n}, on_start: {set: {n: 8}}}, b]"
    simulated = simulate(text.replace("on_start", "on_success"), {"one": used})
    simulated.at(0.5, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    assert [line for line in simulated.told if " and " in line] == ["0 7 and 1", "0.5 7 and 1"]
    assert skills(simulated) == ["0 a", "0.5 a", "1.5 b"]


@pytest.mark.parametrize(("afterwards", "outcome", "end"), [("end", "person", "success"), ("end", "empty", "failure")])
def test_the_outcome_of_what_a_reaction_did_is_not_that_of_the_mission(afterwards: str, outcome: str, end: str) -> None:
    text = f"interrupts:\n  open:\n    when: $door\n    do: look\n    afterwards: {afterwards}\ndo: a"
    simulated = simulate(text, outcomes={"look": [outcome]})
    simulated.set("door", True)
    assert simulated.advance(20) == end
    assert simulated.ended == end


@pytest.mark.parametrize("branches", ["{end: success}, {end: failure}", "{end: failure}, {end: success}"])
def test_of_two_ends_at_one_tick_failure_counts_whatever_their_order(branches: str) -> None:
    simulated = simulate(f"do:\n  parallel: [{branches}]")
    assert simulated.advance(5) == "failure"
