"""Laws of the engine for random missions: nothing raises, every leaf that starts ends or is halted exactly once."""

from __future__ import annotations

import textwrap
from collections import Counter

from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.findings import Report
from rbxcompose.missions.events import SkillEnded, SkillStarted
from rbxcompose.missions.reading import read_program
from rbxcompose.missions.statuses import IDLE, RUNNING
from tests.missions.simulated import Simulated, tree

LEAVES = (
    "a",
    "b",
    "recharge",
    "wait: 0.7 s",
    "check: $battery > 50 %",
    "wait_for: $door",
    "set:\n  n: $n + 1",
    "log: hi",
)
MODIFIERS = ("optional: true", "timeout: 1.3 s", "attempts: 2", "only_if: $door", "attempts: forever")


def indented(text: str) -> str:
    return textwrap.indent(text, "  ")


def listed(nodes: list[str]) -> str:
    return "\n".join("- " + textwrap.indent(node, "  ").lstrip() for node in nodes)


def with_colon(node: str) -> str:
    return node if ":" in node else f"{node}:"


def composites(nodes: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    lists = st.lists(nodes, min_size=1, max_size=3).map(listed)
    return st.one_of(
        lists.map(lambda steps: f"sequence:\n{indented(steps)}"),
        lists.map(lambda steps: f"fallback:\n{indented(steps)}"),
        st.tuples(st.integers(0, 3), nodes).map(lambda one: f"repeat: {one[0]}\ndo:\n{indented(one[1])}"),
        nodes.map(lambda node: f"repeat: forever\nuntil: $battery < 50 %\nevery: 0.4 s\ndo:\n{indented(node)}"),
        nodes.map(lambda node: f"for: item\nin: [1, 2]\nif_one_fails: next\ndo:\n{indented(node)}"),
        st.tuples(nodes, nodes).map(lambda pair: f"if: $door\nthen:\n{indented(pair[0])}\nelse:\n{indented(pair[1])}"),
        st.tuples(nodes, st.sampled_from(MODIFIERS)).map(modified),
    )


def modified(pair: tuple[str, str]) -> str:
    node, modifier = pair
    key = modifier.split(":", maxsplit=1)[0]
    return node if f"{key}:" in node else f"{with_colon(node)}\n{modifier}"


NODES = st.recursive(st.sampled_from(LEAVES), composites, max_leaves=8)
CHANGES = st.lists(
    st.tuples(st.integers(0, 60).map(lambda tenths: tenths / 10), st.sampled_from(("door", "low", "full", "pause"))),
    max_size=8,
)


def mission(body: str, reaction: str) -> str:
    return (
        f"data: {{n: 0}}\ninterrupts:\n  open:\n    when: $door\n    do: b\n"
        f"  low:\n    when: $battery < 50 %\n    do:\n{textwrap.indent(reaction, '      ')}\ndo:\n{indented(body)}\n"
    )


def run(body: str, reaction: str, changes: list[tuple[float, str]], failing: frozenset[int]) -> Simulated:
    report = Report()
    # A loop variable is used twice where one loop stands in another: that is a finding, but no matter here.
    program = read_program(tree(mission(body, reaction)), report)
    assert program is not None
    assert not report.has_errors, list(report)
    simulated = Simulated(program, fails=dict.fromkeys(("a", "b"), failing), takes={"b": 0.3})
    simulated.set("battery", 1.0)
    for time, change in changes:
        simulated.at(time, lambda time=time, change=change: alter(simulated, time, change))  # type: ignore[misc]
    simulated.advance(8.0)
    return simulated


def alter(simulated: Simulated, time: float, change: str) -> None:
    match change:
        case "door":
            simulated.set("door", simulated.values.get("door") is not True)
        case "low" | "full":
            simulated.set("battery", 0.2 if change == "low" else 1.0)
        case _ if simulated.engine.is_paused:
            simulated.engine.resume(time)
        case _:
            simulated.engine.pause(time)


@settings(max_examples=150, deadline=None)
@given(NODES, NODES, CHANGES, st.frozensets(st.integers(1, 4)))
def test_every_leaf_that_starts_ends_or_is_halted_exactly_once(
    body: str, reaction: str, changes: list[tuple[float, str]], failing: frozenset[int]
) -> None:
    simulated = run(body, reaction, changes, failing)
    simulated.engine.abort(simulated.now)
    assert simulated.running == {}
    assert simulated.engine.status not in (IDLE, RUNNING)
    assert RUNNING not in [simulated.engine.statuses[leaf] for leaf in simulated.engine._leaves]
    running: set[int] = set()
    for _, event in simulated.events:
        if isinstance(event, SkillStarted):
            assert event.leaf not in running
            running.add(event.leaf)
        elif isinstance(event, SkillEnded):
            running.remove(event.leaf)
    assert not running


@settings(max_examples=50, deadline=None)
@given(NODES, NODES, CHANGES, st.frozensets(st.integers(1, 4)))
def test_the_same_mission_with_the_same_events_tells_the_same_story(
    body: str, reaction: str, changes: list[tuple[float, str]], failing: frozenset[int]
) -> None:
    first, second = (run(body, reaction, changes, failing) for _ in range(2))
    assert first.told == second.told
    assert Counter(first.calls) == Counter(second.calls)


@settings(max_examples=50, deadline=None)
@given(NODES, st.frozensets(st.integers(1, 4)), st.lists(st.integers(0, 80), max_size=10))
def test_ticks_at_which_nothing_is_due_change_nothing(body: str, failing: frozenset[int], extra: list[int]) -> None:
    plain = run(body, "react", [], failing)
    disturbed = run(body, "react", [(tenths / 10 + 0.037, "full") for tenths in extra], failing)
    assert disturbed.told == plain.told
