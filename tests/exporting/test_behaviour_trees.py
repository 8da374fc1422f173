"""Missions become trees of BehaviorTree.CPP and come back as they were; what no tree can say is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.findings import Report, Span
from rbxcompose.commands.importing.foreign_files import ForeignFile
from rbxcompose.commands.importing.importer import ImportedFiles
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.program import MissionNode, Program
from rbxcompose.tools.behaviour_trees.scripts import unplaced
from rbxcompose.tools.exporting.behaviour_tree import exported, xml_of
from rbxcompose.tools.importers.bt import bt
from tests.loops import for_all
from tests.missions.simulated import tree

Node = Any


def imported(xml: str, name: str = "tried") -> tuple[ImportedFiles, Report]:
    report = Report()
    made = bt([ForeignFile(f"{name}.xml", MappingNode(), xml)], name, report)
    assert isinstance(made, ImportedFiles)
    return made, report


def program_of(text: str) -> Program:
    report = Report()
    program = read_program(tree(text), report)
    assert program is not None
    assert not report.has_errors, (text, list(report))
    return program


def meaning(thing: Any) -> Any:
    """Return a part of a program without its places in the text."""
    match thing:
        case Span() | None:
            return None
        case Expression():
            return unplaced(thing.tree)
        case ScalarNode():
            return thing.text
        case SequenceNode():
            return [meaning(item) for item in thing.items]
        case MappingNode():
            return {name: meaning(entry.value) for name, entry in thing.entries.items()}
        case dict():
            return {key: meaning(value) for key, value in thing.items()}
        case tuple() | list():
            return [meaning(each) for each in thing]
    if hasattr(type(thing), "__dataclass_fields__"):
        left_out = ("end", "file", "root", "wanted", "scalar", *(["asked"] if isinstance(thing, MissionNode) else []))
        fields = (name for name in type(thing).__dataclass_fields__ if name not in left_out)
        return (type(thing).__name__, {name: meaning(getattr(thing, name)) for name in fields})
    return thing


def same(before: str, after: str) -> None:
    first, second = program_of(before), program_of(after)
    assert meaning(first.nodes) == meaning(second.nodes)
    for part in ("inputs", "data", "outputs", "rate", "about", "interrupts"):
        assert meaning(getattr(first, part)) == meaning(getattr(second, part)), part


def round_trip(mission: dict[str, Any]) -> str:
    written = yaml.safe_dump({"rbx": 1, "kind": "Mission", "name": "tried", **mission}, sort_keys=False, width=10_000)
    before = written.replace(": null", ":")
    report = Report()
    xml = xml_of({"tried": tree(before)}, "tried", report)
    assert not report.has_errors, list(report)
    made, told = imported(xml)
    assert not told.has_errors, list(told)
    same(before, made.text)
    again = xml_of({"tried": tree(made.text)}, "tried", report)
    assert imported(again)[0].text == made.text
    return xml


CONDITIONS = st.sampled_from(
    ["$door", "not $door", "$n > 3", "$n == 1 or $m == 'a'", "($door or $n < 2) and not ($n == 1)", "$battery > 20 %",
     "-$n * 2 - (1 - $n) < 0.5", "true", "$far <= 15 cm"]
)  # fmt: skip
DURATIONS = st.sampled_from(["1 s", "250 ms", "2 min", "$n * 1 ms"])
SETS = st.dictionaries(
    st.sampled_from(["n", "k"]), st.sampled_from(["$j + 1", "0", "5 cm", "$battery", "'x'"]), min_size=1
)
LEAVES = st.one_of(
    st.sampled_from(["a", "b", "sleep", "is_door_open", {"go_to": "dock"}, {"say": "$m"}, {"say": "it's $$5"}]),
    st.just({"go_to": {"pose": "dock", "tolerance": "10 cm"}}),
    st.builds(lambda text: {"check": text}, CONDITIONS),
    st.builds(lambda text: {"wait_for": text}, CONDITIONS),
    st.builds(lambda text: {"wait": text}, DURATIONS),
    st.builds(lambda assigned: {"set": assigned}, SETS),
    st.just({"log": "n is $n", "level": "warn"}),
    st.just({"look": None, "save": "seen", "on_success": {"set": {"n": "$seen.people"}}}),
)
MODIFIERS = st.one_of(
    st.sampled_from([{"optional": True}, {"invert": True}, {"once": True}, {"attempts": 3}, {"attempts": "$n"}]),
    st.builds(lambda text: {"only_if": text}, CONDITIONS),
    st.builds(lambda text: {"skip_if": text}, CONDITIONS),
    st.builds(lambda text: {"as_long_as": text}, CONDITIONS),
    st.builds(lambda text: {"timeout": text}, DURATIONS),
    st.builds(lambda hook, assigned: {hook: {"set": assigned}},
              st.sampled_from(["on_success", "on_failure", "on_halt"]), SETS),
)  # fmt: skip


def _nodes(inner: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    some = st.lists(inner, min_size=1, max_size=3)
    options = st.sampled_from([{}, {"reactive": True}, {"history": "last"}])
    cases = st.dictionaries(st.sampled_from(["kitchen", 1, 2.5, True, "'a b'"]), inner, min_size=2, max_size=4)
    return st.one_of(
        st.builds(lambda steps, more: {"sequence": steps, **more}, some, options),
        st.builds(lambda steps, more: {"fallback": steps, **more}, some, st.sampled_from([{}, {"reactive": True}])),
        st.builds(lambda one, two, three, more: {"parallel": [one, two, three], **more}, inner, inner, inner,
                  st.sampled_from([{}, {"succeed_when": "any"}, {"succeed_when": 2, "fail_when": 2},
                                   {"succeed_when": "$n", "fail_when": "$n"},
                                   {"fail_when": "all", "succeed_when": "any", "wait_for_all": True},
                                   {"wait_for_all": True}])),
        st.builds(lambda one, two: {"parallel": {"work": one, "watch": two}, "fail_when": "all"}, inner, inner),
        st.builds(lambda rounds, do: {"repeat": rounds, "do": do}, st.sampled_from([2, "forever", "$n"]), inner),
        st.builds(lambda items, do: {"for": "item", "in": items, "do": do},
                  st.sampled_from([[1, 2], ["dock", "kitchen"], ["'a'", "b"], [True], ["5 cm"], "$left"]), inner),
        st.builds(lambda asked, one, two: {"if": asked, "then": one, "else": two}, CONDITIONS, inner, inner),
        st.builds(lambda asked, one: {"if": asked, "then": one}, CONDITIONS, inner),
        st.builds(lambda cases, other: {"choose": "$m", "cases": cases, "else": other}, cases, inner),
        st.builds(lambda cases: {"choose": "$m", "cases": cases}, cases),
        st.builds(_with, inner, MODIFIERS),
        st.builds(_with, inner, MODIFIERS),
    )  # fmt: skip


def _with(node: Node, more: dict[str, Node]) -> Node:
    node = {node: None} if isinstance(node, str) else node
    is_both = "save" in node or more.keys() & node.keys() or ({"check", "attempts"} <= {*node, *more})
    return {"sequence": [node], **more} if is_both else node | more


NODES = st.recursive(LEAVES, _nodes, max_leaves=8)
DATA = {"n": 0, "k": "5 cm", "m": "a b", "left": [1, 2], "door": True}
HEADS = st.sampled_from(
    [
        {"data": DATA},
        {"about": "Try it.", "rate": "10 Hz", "data": {**DATA, "pairs": {"a": 1}}},
        {"inputs": {"j": {"type": "count", "default": 2, "max": 5}}, "data": DATA, "outputs": {"n": "$n"}},
    ]
)


@given(HEADS, NODES)
def test_a_mission_that_can_be_exported_comes_back_as_it_was(head: dict[str, Any], body: Node) -> None:
    round_trip({**head, "do": body})


USED = """
rbx: 1
kind: Mission
name: back
inputs:
  tries: {type: count, default: 2}
  where: {type: place}
data: {done: 0}
outputs: {done: $done}
do:
  - {go_to: $where, attempts: $tries}
  - set: {done: $done + 1}
"""
USING = """
rbx: 1
kind: Mission
name: tried
data: {n: 0, spot: dock}
do:
  - use: back
    with: {where: $spot, tries: 3}
    save: trip
    on_success: {set: {n: $trip.done}}
    on_failure: {set: {n: $trip.done}}
  - {use: back, with: {where: kitchen}, timeout: 1 min}
"""


def test_missions_that_are_used_become_sub_trees_and_come_back(tmp_path: Path) -> None:
    for name, text in {"tried": USING, "back": USED}.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    report = Report()
    found = exported(tmp_path / "tried.yaml", report, {})
    assert not report.has_errors, list(report)
    made, told = imported(found["tried.xml"])
    assert not list(told)
    same(USING, made.text)
    same(USED, made.beside["back.yaml"])


def test_a_mission_that_is_not_beside_it_is_told(tmp_path: Path) -> None:
    (tmp_path / "tried.yaml").write_text(USING, encoding="utf-8")
    report = Report()
    assert exported(tmp_path / "tried.yaml", report, {}) == {}
    assert {(finding.code, finding.span.line if finding.span else 0) for finding in report} == {
        ("RBX2267", 7), ("RBX2267", 12)
    }  # fmt: skip


def test_a_script_that_was_edited_counts_and_not_what_the_mission_had_written() -> None:
    mission = {"data": {"n": 0}, "do": {"check": "$battery > 20 %"}}
    xml = round_trip(mission)
    assert 'code="battery &gt; 0.2"' in xml
    assert "check: $battery > 0.5" in imported(xml.replace("0.2", "0.5"))[0].text


CANNOT = {
    "interrupts: {low: {when: $door}}\ndo: a": 1,
    "machine: {start: one, states: {one: {do: a, next: {success: finished, failure: failed}}}}": 1,
    "do: {publish: greetings, message: hi}": 1,
    "do: [a, {call: reset}]": 1,
    "do: {end: success}": 1,
    "do:\n  say: hi $n": 2,
    "do:\n  say: $n + 1": 2,
    "do:\n  go_to: {pose: [1, 2]}": 2,
    "do:\n  check: distance($pose, dock) < 1 m": 2,
    "do:\n  check: 3 in $list": 2,
    "do:\n  sequence: [a]\n  history: deep": 2,
    "do:\n  sequence: [a]\n  order: random": 3,
    "do:\n  fallback: [a]\n  history: last": 2,
    "do:\n  a:\n  cooldown: 1 s": 3,
    "do:\n  a:\n  on_start: {log: hi}": 3,
    "do:\n  a:\n  on_success: {log: hi}": 3,
    "do:\n  a:\n  attempts: 2\n  attempt_pause: 1 s": 4,
    "do:\n  look:\n  save: seen": 3,
    "do:\n  look:\n  save: seen\n  on_success: {set: {n: $seen.people + 1}}": 3,
    "do:\n  repeat: 3\n  until: $door\n  do: a": 3,
    "do:\n  for: x\n  in: [1]\n  if_one_fails: next\n  do: a": 4,
    "do:\n  for: x\n  in: [1, true]\n  do: a": 2,
    "do:\n  parallel: {one: a, two: b}\n  ends_with: one": 3,
    "do:\n  parallel: [a, b, c]\n  succeed_when: 2\n  wait_for_all: true": 2,
    "do:\n  parallel: [a, b, c]\n  fail_when: $n\n  wait_for_all: true": 2,
    "do:\n  parallel: [a, b]\n  succeed_when: 3": 2,
    "do:\n  parallel: [a, b]\n  succeed_when: $n + 1": 2,
    "do:\n  choose: $n\n  cases: {1: a}": 2,
    "do:\n  choose: $n + 1\n  cases: {1: a, 2: b}": 2,
    "do:\n  wait: 0.1 ms": 2,
    "do:\n  wait: $n * 1 s": 2,
    "do:\n  repeat: $n + 1\n  do: a": 2,
    "do:\n  set: {n: $k, k: $n}": 2,
    "outputs:\n  m: $n + 1\ndo: a": 2,
}


@for_all("text", CANNOT)
def test_what_no_tree_can_say_is_told_at_its_place(text: str) -> None:
    report = Report()
    xml_of({"tried": tree(text)}, "tried", report)
    found = [(finding.code, finding.span.line if finding.span else 0) for finding in report]
    assert found == [("RBX2267", CANNOT[text])], list(report)
