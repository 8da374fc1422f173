"""Random missions of all kinds and modifiers, with events from outside; all times are quarters of a second."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

from rbxcompose.base.findings import Report
from rbxcompose.missions.engine.world import PLAIN, Settings
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.program import Program, RobotNames
from tests.missions.simulated import Simulated, robot_with, tree

Node = Any  # a word, a list or a map, as YAML has it

USED = """
data: {m: 0}
outputs: {m: $m}
interrupts:
  open:
    when: $door
    do: c
do:
  - set: {m: $m + 1}
  - a
  - sequence: [b, {wait: 0.5 s}]
    history: last
"""
ROBOT: RobotNames = robot_with({"inner": USED})

LEAVES: Sequence[Node] = (
    "a",
    "b",
    "look",
    "hold",
    "recharge",
    {"say": "hi $n"},
    {"wait": "0.75 s"},
    {"check": "$battery > 50 %"},
    {"wait_for": "$door"},
    {"set": {"n": "$n + 1"}},
    {"log": "n is $n"},
    {"publish": "greetings", "message": "hi $n"},
    {"call": "reset"},
    {"use": "inner"},
    {"use": "inner", "history": "deep"},
    {"for": "step", "in": "$steps", "do": {"run": "$step"}},
)
MODIFIERS: Sequence[dict[str, Node]] = (
    {"optional": True},
    {"invert": True},
    {"once": True},
    {"cooldown": "1 s"},
    {"only_if": "$door"},
    {"skip_if": "$door"},
    {"as_long_as": "$battery > 10 %"},
    {"timeout": "1.25 s"},
    {"attempts": 2},
    {"attempts": "forever", "attempt_pause": "0.25 s", "attempt_timeout": "2 s"},
    {"on_start": {"log": "on"}, "on_success": {"set": {"n": "$n + 1"}}, "on_halt": {"log": "off"}},
)
CHANGES = st.lists(
    st.tuples(
        st.integers(0, 24).map(lambda quarters: quarters / 4),
        st.sampled_from(("door", "low", "empty", "full", "pause")),
    ),
    max_size=8,
)
FAILING = st.frozensets(st.integers(1, 4))
OUTCOMES = st.lists(st.sampled_from(("", "person", "empty", "ghost")), max_size=3)


def _lists(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    options = st.fixed_dictionaries(
        {},
        optional={"reactive": st.just(True), "history": st.sampled_from(("last", "deep")), "order": st.just("random")},
    )
    kinds = st.sampled_from(("sequence", "fallback"))
    return st.builds(
        lambda kind, steps, more: {kind: steps, **more}, kinds, st.lists(nodes, min_size=1, max_size=3), options
    )


def _parallels(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    options = st.fixed_dictionaries(
        {},
        optional={
            "succeed_when": st.sampled_from(("any", 1, 2)),
            "fail_when": st.sampled_from(("all", 1, 2)),
            "wait_for_all": st.just(True),
        },
    )
    return st.builds(lambda steps, more: {"parallel": steps, **more}, st.lists(nodes, min_size=2, max_size=3), options)


def _machines(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    to = st.sampled_from(("one", "two", "finished", "failed", "lost"))
    state = st.builds(
        lambda do, won, lost: {
            "do": do,
            "next": {"success": won, "failure": lost},
            "on_enter": {"log": "in"},
            "on_exit": {"log": "out"},
        },
        nodes,
        to,
        to,
    )
    watched = st.builds(
        lambda do, won, lost: {
            "do": {
                "parallel": {"work": do, "watch": {"wait_for": "$door"}},
                "succeed_when": "any",
                "outcomes": {"opened": "$watch == success", "done": "$work == success", "other": "otherwise"},
            },
            "next": {"opened": won, "done": lost, "other": "lost"},
        },
        nodes,
        to,
        to,
    )
    return st.builds(
        lambda one, two, history: {
            "machine": {
                "start": "one",
                "states": {"one": one, "two": two},
                "ends": {"lost": "failure"},
                "history": history,
            }
        },
        state,
        st.one_of(state, watched),
        st.sampled_from(("none", "last", "deep")),
    )


def _modified(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    def put(node: Node, more: dict[str, Node]) -> Node:
        return {"sequence": [node], **more} if not isinstance(node, dict) or more.keys() & node.keys() else node | more

    return st.builds(put, nodes, st.sampled_from(MODIFIERS))


def _composites(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    orders = st.sampled_from(("written", "random"))
    return st.one_of(
        _lists(nodes),
        _parallels(nodes),
        _machines(nodes),
        _modified(nodes),
        _modified(nodes),
        st.builds(lambda rounds, do: {"repeat": rounds, "do": do}, st.integers(0, 3), nodes),
        nodes.map(lambda do: {"repeat": "forever", "until": "$battery < 50 %", "every": "0.5 s", "do": do}),
        st.builds(
            lambda do, order: {"for": "item", "in": [1, 2], "if_one_fails": "next", "order": order, "do": do},
            nodes,
            orders,
        ),
        nodes.map(lambda do: {"for": "item", "in": "$left", "remove_done": True, "succeed_when": "any", "do": do}),
        st.builds(lambda one, other: {"if": "$door", "then": one, "else": other}, nodes, nodes),
        st.builds(lambda one, other: {"choose": "$n", "cases": {"0": one, "1": other}}, nodes, nodes),
        nodes.map(lambda do: {"sequence": [do, {"if": "$n > 3", "then": {"end": "failure"}}]}),
    )


NODES = st.recursive(st.sampled_from(LEAVES), _composites, max_leaves=8)
AFTERWARDS = st.sampled_from(("continue", "restart", "end", {"restart": "tour"}))


@dataclass(frozen=True, slots=True)
class Case:
    """A mission, what happens to it from outside, and how its skills end."""

    body: Node
    reaction: Node
    afterwards: Node
    changes: Sequence[tuple[float, str]] = ()
    failing: frozenset[int] = frozenset()
    outcomes: Sequence[str] = ()

    def program(self) -> Program:
        """Return the mission. Names that clash are findings elsewhere, and no matter here."""
        interrupts = {
            "open": {"when": "$door", "do": "b"},
            "low": {"when": "$battery < 50 %", "do": self.reaction, "afterwards": self.afterwards},
        }
        mission = {
            "rate": "4 Hz",
            "data": {"n": 0, "left": [1, 2, 3], "steps": ["a", {"wait": "0.25 s"}]},
            "interrupts": interrupts,
            "do": [self.body, {"sequence": ["hold", self.body], "name": "tour"}],
        }
        report = Report()
        program = read_program(tree(json.dumps(mission)), report)
        assert program is not None
        assert not report.has_errors, list(report)
        return program

    def simulated(self, settings: Settings = PLAIN) -> Simulated:
        """Return the robot with this mission at its beginning."""
        made = Simulated(
            self.program(),
            robot=ROBOT,
            settings=settings,
            fails=dict.fromkeys(("a", "b", "reset"), self.failing),
            takes={"b": 0.25, "hold": 1.5},
            outcomes={"look": self.outcomes},
        )
        made.set("battery", 1.0)
        schedule(made, self.changes)
        return made


CASES = st.builds(Case, NODES, NODES, AFTERWARDS, CHANGES, FAILING, OUTCOMES)


def schedule(simulated: Simulated, changes: Sequence[tuple[float, str]]) -> None:
    """Let the changes happen in their order."""
    for time, change in changes:
        simulated.at(time, lambda time=time, change=change: alter(simulated, time, change))  # type: ignore[misc]


def alter(simulated: Simulated, time: float, change: str) -> None:
    """Let one thing happen."""
    match change:
        case "door":
            simulated.set("door", simulated.values.get("door") is not True)
        case "low" | "empty" | "full":
            simulated.set("battery", {"low": 0.25, "empty": 0.05, "full": 1.0}[change])
        case _ if simulated.engine.is_paused:
            simulated.engine.resume(time)
        case _:
            simulated.engine.pause(time)
