"""Trees of BehaviorTree.CPP become missions that do what they did; what cannot be said is told at its place."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.findings import Report
from rbxcompose.domains.body.xml_reader import quoted
from rbxcompose.missions.engine.events import SkillEnded, SkillStarted
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.behaviour_trees import forest_importer, nodes
from rbxcompose.tools.behaviour_trees.forest import TREE
from tests.importing.imports import EXAMPLES, Imported, import_files
from tests.loops import for_all
from tests.missions.simulated import ROBOT, Simulated, tree

ROOT = '<root BTCPP_format="4">{}</root>'


def of_text(folder: Path, text: str, name: str = "tried") -> Imported:
    path = folder / f"{name}.xml"
    path.write_text(text, encoding="utf-8")
    return import_files([path], name, "bt")


def of_body(folder: Path, body: str, more: str = "") -> Imported:
    return of_text(folder, ROOT.format(f'<{TREE} ID="Main">{body}</{TREE}>{more}').replace("><", ">\n<"))


def program(text: str) -> Program:
    report = Report()
    found = read_program(tree(text), report)
    assert found is not None
    assert not report.has_errors, (text, list(report))
    return found


def robot_of(made: Imported) -> RobotNames:
    """Return the robot with the missions beside the main one, and flags that conditions become."""
    missions = {name.removesuffix(".yaml"): program(text) for name, text in made.beside.items()}
    return replace(ROBOT, missions=missions, values={**ROBOT.values, "is_ready": FLAG})


def run(
    made: Imported,
    fails: Mapping[str, Iterable[int]] | None = None,
    takes: Mapping[str, float] | None = None,
    ready: Iterable[tuple[float, bool]] = (),
    until: float = 20,
) -> str:
    """Return how a mission ends, and when its skills were started, halted and ended otherwise than in success."""
    failing = {skill: frozenset(calls) for skill, calls in (fails or {}).items()}
    simulated = Simulated(program(made.text), fails=failing, takes=takes or {}, robot=robot_of(made))
    for when, value in ready:
        simulated.at(when, lambda value=value: simulated.set("is_ready", value))  # type: ignore[misc]
    status = simulated.advance(until)
    story = []
    for when, event in simulated.events:
        if isinstance(event, SkillStarted):
            story.append(f"{when:g} {event.skill}")
        elif isinstance(event, SkillEnded) and event.result != "success":
            story.append(f"{when:g} {event.skill} {event.result}")
    return f"{status}: {', '.join(story)}"


ALWAYS = range(1, 99)
AB = "<A/><B/>"
NOT_READY = [(0.0, True), (0.5, False)]
RUNS: Mapping[str, tuple[str, dict[str, object], str]] = {
    "Sequence": (f"<Sequence>{AB}</Sequence>", {}, "success: 0 a, 1 b"),
    "Sequence stops at a failure": (f"<Sequence>{AB}</Sequence>", {"fails": {"a": [1]}}, "failure: 0 a, 1 a failure"),
    "Sequence begins anew": (
        f'<RetryUntilSuccessful num_attempts="2"><Sequence>{AB}</Sequence></RetryUntilSuccessful>',
        {"fails": {"b": [1]}},
        "success: 0 a, 1 b, 2 b failure, 2 a, 3 b",
    ),
    "SequenceWithMemory goes on where it failed": (
        f'<RetryUntilSuccessful num_attempts="2"><SequenceWithMemory>{AB}</SequenceWithMemory></RetryUntilSuccessful>',
        {"fails": {"b": [1]}},
        "success: 0 a, 1 b, 2 b failure, 2 b",
    ),
    "SequenceWithMemory begins anew after success": (
        f'<Repeat num_cycles="2"><SequenceWithMemory>{AB}</SequenceWithMemory></Repeat>',
        {},
        "success: 0 a, 1 b, 2 a, 3 b",
    ),
    "AsyncSequence": (f"<AsyncSequence>{AB}</AsyncSequence>", {}, "success: 0 a, 1 b"),
    "ReactiveSequence halts": (
        "<ReactiveSequence><IsReady/><A/></ReactiveSequence>",
        {"ready": NOT_READY},
        "failure: 0 a, 0.5 a halted",
    ),
    "ReactiveSequence goes through": (
        "<ReactiveSequence><IsReady/><A/></ReactiveSequence>",
        {"ready": [(0.0, True)]},
        "success: 0 a",
    ),
    "Fallback": (f"<Fallback>{AB}</Fallback>", {"fails": {"a": [1]}}, "success: 0 a, 1 a failure, 1 b"),
    "Fallback ends at a success": (f"<Fallback>{AB}</Fallback>", {}, "success: 0 a"),
    "AsyncFallback": (f"<AsyncFallback>{AB}</AsyncFallback>", {"fails": {"a": [1]}}, "success: 0 a, 1 a failure, 1 b"),
    "ReactiveFallback halts": (
        "<ReactiveFallback><IsReady/><A/></ReactiveFallback>",
        {"ready": [(0.0, False), (0.5, True)]},
        "success: 0 a, 0.5 a halted",
    ),
    "Parallel waits for all": (f"<Parallel>{AB}</Parallel>", {"takes": {"b": 2.0}}, "success: 0 a, 0 b"),
    "Parallel fails at the first failure": (
        f"<Parallel>{AB}</Parallel>",
        {"takes": {"b": 2.0}, "fails": {"a": [1]}},
        "failure: 0 a, 0 b, 1 a failure, 1 b halted",
    ),
    "Parallel with thresholds": (
        f'<Parallel success_count="1" failure_count="2">{AB}</Parallel>',
        {"takes": {"b": 2.0}, "fails": {"a": [1]}},
        "success: 0 a, 0 b, 1 a failure",
    ),
    "Parallel counts from the end": (
        f'<Parallel success_count="-2" failure_count="-1">{AB}</Parallel>',
        {"takes": {"b": 2.0}},
        "success: 0 a, 0 b, 1 b halted",
    ),
    "ParallelAll lets all end": (
        f"<ParallelAll>{AB}</ParallelAll>",
        {"takes": {"b": 2.0}, "fails": {"a": [1]}},
        "failure: 0 a, 0 b, 1 a failure",
    ),
    "ParallelAll allows failures": (
        f'<ParallelAll max_failures="2">{AB}</ParallelAll>',
        {"fails": {"a": [1]}},
        "success: 0 a, 0 b, 1 a failure",
    ),
    "IfThenElse": ("<IfThenElse><A/><B/><C/></IfThenElse>", {"fails": {"a": [1]}}, "success: 0 a, 1 a failure, 1 c"),
    "IfThenElse does not try the other one": (
        "<IfThenElse><A/><B/><C/></IfThenElse>",
        {"fails": {"b": [1]}},
        "failure: 0 a, 1 b, 2 b failure",
    ),
    "IfThenElse without else": (
        "<IfThenElse><A/><B/></IfThenElse>",
        {"fails": {"a": [1]}},
        "failure: 0 a, 1 a failure",
    ),
    "WhileDoElse changes over": (
        "<WhileDoElse><IsReady/><A/><B/></WhileDoElse>",
        {"ready": [(0.0, True), (0.25, False), (0.5, True)]},
        "success: 0 a, 0.25 a halted, 0.25 b, 0.5 b halted, 0.5 a",
    ),
    "WhileDoElse of two": (
        "<WhileDoElse><IsReady/><A/></WhileDoElse>",
        {"ready": NOT_READY},
        "failure: 0 a, 0.5 a halted",
    ),
    "Switch2": (
        '<Sequence><Script code="x := 2"/>'
        '<Switch2 variable="{x}" case_1="1" case_2="2"><A/><B/><C/></Switch2></Sequence>',
        {},
        "success: 0 b",
    ),
    "Switch3 has a default": (
        "<Sequence><Script code=\"x := 'c'\"/>"
        '<Switch3 variable="{x}" case_1="a" case_2="b" case_3="d"><A/><B/><C/><D/></Switch3></Sequence>',
        {},
        "success: 0 d",
    ),
    "TryCatch": ("<TryCatch><A/><B/><C/></TryCatch>", {"fails": {"a": [1]}}, "failure: 0 a, 1 a failure, 1 c"),
    "TryCatch without a failure": ("<TryCatch><A/><B/><C/></TryCatch>", {}, "success: 0 a, 1 b"),
    "Inverter": ("<Inverter><A/></Inverter>", {}, "failure: 0 a"),
    "ForceSuccess": ("<ForceSuccess><A/></ForceSuccess>", {"fails": {"a": [1]}}, "success: 0 a, 1 a failure"),
    "ForceFailure": ("<ForceFailure><A/></ForceFailure>", {}, "failure: 0 a"),
    "RetryUntilSuccessful": (
        '<RetryUntilSuccessful num_attempts="2"><A/></RetryUntilSuccessful>',
        {"fails": {"a": ALWAYS}},
        "failure: 0 a, 1 a failure, 1 a, 2 a failure",
    ),
    "RetryUntilSuccessful for ever": (
        '<RetryUntilSuccessful num_attempts="-1"><A/></RetryUntilSuccessful>',
        {"fails": {"a": [1, 2]}},
        "success: 0 a, 1 a failure, 1 a, 2 a failure, 2 a",
    ),
    "RecoveryNode": (f'<RecoveryNode number_of_retries="2">{AB}</RecoveryNode>', {}, "success: 0 a"),
    "RecoveryNode tries again after its second child": (
        f'<RecoveryNode number_of_retries="2">{AB}</RecoveryNode>',
        {"fails": {"a": [1]}},
        "success: 0 a, 1 a failure, 1 b, 2 a",
    ),
    "RecoveryNode does not recover after the last failure": (
        f"<RecoveryNode>{AB}</RecoveryNode>",
        {"fails": {"a": ALWAYS}},
        "failure: 0 a, 1 a failure, 1 b, 2 a, 3 a failure",
    ),
    "RecoveryNode fails with its second child": (
        f'<RecoveryNode number_of_retries="6">{AB}</RecoveryNode>',
        {"fails": {"a": ALWAYS, "b": ALWAYS}},
        "failure: 0 a, 1 a failure, 1 b, 2 b failure",
    ),
    "RecoveryNode in another one begins anew": (
        '<Sequence><Script code="n := 1"/><RecoveryNode number_of_retries="{n}">'
        f"<RecoveryNode>{AB}</RecoveryNode><C/></RecoveryNode></Sequence>",
        {"fails": {"a": [1, 2, 3]}},
        "success: 0 a, 1 a failure, 1 b, 2 a, 3 a failure, 3 c, 4 a, 5 a failure, 5 b, 6 a",
    ),
    "Repeat": ('<Repeat num_cycles="2"><A/></Repeat>', {}, "success: 0 a, 1 a"),
    "Repeat ends at a failure": (
        '<Repeat num_cycles="-1"><A/></Repeat>',
        {"fails": {"a": [2]}},
        "failure: 0 a, 1 a, 2 a failure",
    ),
    "KeepRunningUntilFailure": (
        "<KeepRunningUntilFailure><A/></KeepRunningUntilFailure>",
        {"fails": {"a": [2]}},
        "failure: 0 a, 1 a, 2 a failure",
    ),
    "Timeout halts": ('<Timeout msec="500"><A/></Timeout>', {}, "failure: 0 a, 0.5 a halted"),
    "Timeout of nothing": ('<Timeout msec="0"><A/></Timeout>', {}, "success: 0 a"),
    "Timeout from an entry": (
        '<Sequence><Script code="t := 500"/><Timeout msec="{t}"><A/></Timeout></Sequence>',
        {},
        "failure: 0 a, 0.5 a halted",
    ),
    "Delay": ('<Delay delay_msec="500"><A/></Delay>', {}, "success: 0.5 a"),
    "Sleep": (f'<Sequence><Sleep msec="1500"/>{AB}</Sequence>', {}, "success: 1.5 a, 2.5 b"),
    "RunOnce": (
        '<Repeat num_cycles="2"><Sequence><RunOnce><A/></RunOnce><B/></Sequence></Repeat>',
        {},
        "success: 0 a, 1 b, 2 b",
    ),
    "Precondition": ('<Precondition if="1 > 2"><A/></Precondition>', {}, "failure: "),
    "Precondition succeeds": ('<Precondition if="1 > 2" else="SUCCESS"><A/></Precondition>', {}, "success: "),
    "Precondition skips": (
        '<Fallback><Precondition if="1 > 2" else="SKIPPED"><A/></Precondition><B/></Fallback>',
        {},
        "success: 0 b",
    ),
    "Precondition waits": (
        '<Precondition if="is_ready" else="RUNNING"><A/></Precondition>',
        {"ready": [(0.0, False), (2.0, True)]},
        "success: 2 a",
    ),
    "BlackboardCheckInt": (
        '<Sequence><Script code="n := 2"/><BlackboardCheckInt value_A="{n}" value_B="2" return_on_mismatch="FAILURE">'
        '<A/></BlackboardCheckInt><BlackboardCheckDouble value_A="{n}" value_B="3" return_on_mismatch="SUCCESS">'
        "<B/></BlackboardCheckDouble><C/></Sequence>",
        {},
        "success: 0 a, 1 c",
    ),
    "BlackboardCheckString": (
        '<Sequence><SetBlackboard output_key="s" value="x"/>'
        '<BlackboardCheckString value_A="{s}" value_B="x" return_on_mismatch="FAILURE">'
        '<BlackboardCheckBool value_A="true" value_B="false" return_on_mismatch="FAILURE"><A/></BlackboardCheckBool>'
        "</BlackboardCheckString></Sequence>",
        {},
        "failure: ",
    ),
    "LoopInt": ('<LoopInt queue="1;2" value="{n}"><A/></LoopInt>', {}, "success: 0 a, 1 a"),
    "LoopBool": ('<LoopBool queue="true;false" value="{n}"><A/></LoopBool>', {}, "success: 0 a, 1 a"),
    "LoopDouble": ('<LoopDouble queue="1;2;3" value="{n}"><A _skipIf="n &gt; 1.5"/></LoopDouble>', {}, "success: 0 a"),
    "LoopString ends at a failure": (
        '<LoopString queue="x;y;z" value="{n}"><A/></LoopString>',
        {"fails": {"a": [2]}},
        "failure: 0 a, 1 a, 2 a failure",
    ),
    "AlwaysSuccess": ("<Sequence><AlwaysSuccess/><A/></Sequence>", {}, "success: 0 a"),
    "AlwaysFailure": ("<Sequence><AlwaysFailure/><A/></Sequence>", {}, "failure: "),
    "Script": (
        '<Sequence><Script code="x := 1; y := x + 1; x += y"/>'
        '<ScriptCondition code="x == 3 &amp;&amp; y == 2"/><A/></Sequence>',
        {},
        "success: 0 a",
    ),
    "ScriptCondition": (
        """<Sequence><Script code="x:='a'"/><ScriptCondition code="x != 'a' || !(1 &lt; 2 &lt; 3)"/><A/></Sequence>""",
        {},
        "failure: ",
    ),
    "SetBlackboard": (
        '<Sequence><SetBlackboard value="7" output_key="x"/><SetBlackboard value="{x}" output_key="{y}"/>'
        '<ScriptCondition code="y == 7"/><A/></Sequence>',
        {},
        "success: 0 a",
    ),
    "Log": ('<Sequence><Log message="hello"/><A/></Sequence>', {}, "success: 0 a"),
    "_skipIf": ('<Sequence><A _skipIf="true"/><B/></Sequence>', {}, "success: 0 b"),
    "_successIf": ('<Sequence><A _successIf="1 &lt; 2"/><B/></Sequence>', {}, "success: 0 b"),
    "_failureIf": ('<Fallback><A _failureIf="1 &lt; 2" _successIf="true"/><B/></Fallback>', {}, "success: 0 b"),
    "_while": (
        '<Sequence><A _while="is_ready"/><B/></Sequence>',
        {"ready": NOT_READY},
        "success: 0 a, 0.5 a halted, 0.5 b",
    ),
    "_while at the start": (
        '<Sequence><A _while="is_ready"/><B/></Sequence>',
        {"ready": [(0.0, False)]},
        "success: 0 b",
    ),
    "_onSuccess": (
        '<Sequence><Script code="x := 0"/><A _onSuccess="x := 5" _onFailure="x := 6"/>'
        '<ScriptCondition code="x == 5"/><B/></Sequence>',
        {},
        "success: 0 a, 1 b",
    ),
    "_onFailure": (
        '<Sequence><Script code="x := 0"/><ForceSuccess><A _onSuccess="x := 5" _onFailure="x := 6"/></ForceSuccess>'
        '<ScriptCondition code="x == 6"/><B/></Sequence>',
        {"fails": {"a": [1]}},
        "success: 0 a, 1 a failure, 1 b",
    ),
    "_onHalted": (
        '<Sequence><Script code="x := 0"/>'
        '<ForceSuccess><Timeout msec="500"><A _onHalted="x := 6"/></Timeout></ForceSuccess>'
        '<ScriptCondition code="x == 6"/><B/></Sequence>',
        {},
        "success: 0 a, 0.5 a halted, 0.5 b",
    ),
    "_post": (
        '<Sequence><Script code="x := 0"/><A _post="x += 1"/><ScriptCondition code="x == 1"/><B/></Sequence>',
        {},
        "success: 0 a, 1 b",
    ),
    "all skipped": (
        '<Fallback><Sequence><A _skipIf="true"/><B _skipIf="true"/></Sequence><C/></Fallback>',
        {},
        "success: 0 c",
    ),
    "decorators in any order": (
        '<Timeout msec="5000"><Inverter><ForceFailure>'
        '<RetryUntilSuccessful num_attempts="2"><A/></RetryUntilSuccessful>'
        "</ForceFailure></Inverter></Timeout>",
        {"fails": {"a": [1]}},
        "success: 0 a, 1 a failure, 1 a",
    ),
}
SUBTREES: Mapping[str, tuple[str, str, str]] = {
    "SubTree": ('<SubTree ID="Sub"/>', "<A/>", "success: 0 a"),
    "an input and an output": (
        '<Sequence><Script code="start := 4"/><SubTree ID="Sub" from="{start}" to="{found}"/>'
        '<ScriptCondition code="found == 5"/><B/></Sequence>',
        '<Sequence><A/><Script code="to := from + 1"/></Sequence>',
        "success: 0 a, 1 b",
    ),
    "an output although it fails": (
        '<Fallback><SubTree ID="Sub" to="{found}"/>'
        '<Sequence><ScriptCondition code="found == 5"/><B/></Sequence></Fallback>',
        '<Sequence><Script code="to := 5"/><AlwaysFailure/></Sequence>',
        "success: 0 b",
    ),
    "a port that is both": (
        '<Sequence><Script code="x := 4"/><SubTree ID="Sub" n="{x}"/><ScriptCondition code="x == 5"/><B/></Sequence>',
        '<Script code="n := n + 1"/>',
        "success: 0 b",
    ),
    "autoremap": (
        '<Sequence><Script code="x := 4"/><SubTree ID="Sub" _autoremap="true"/>'
        '<ScriptCondition code="y == 8"/><B/></Sequence>',
        '<Script code="y := x * 2"/>',
        "success: 0 b",
    ),
    "what is not passed is another entry": (
        '<Sequence><Script code="x := 4"/><SubTree ID="Sub"/><ScriptCondition code="x == 4"/><B/></Sequence>',
        '<Script code="x := 9"/>',
        "success: 0 b",
    ),
    "a literal": ('<SubTree ID="Sub" n="3"/>', '<Repeat num_cycles="{n}"><A/></Repeat>', "success: 0 a, 1 a, 2 a"),
}


@for_all("name", RUNS)
def test_it_ends_and_halts_as_there(name: str, tmp_path: Path) -> None:
    body, settings, expected = RUNS[name]
    made = of_body(tmp_path, body)
    assert not made.report.has_errors, made.words
    assert run(made, **settings) == expected, made.text  # type: ignore[arg-type]


@pytest.mark.parametrize("name", SUBTREES)
def test_a_sub_tree_is_another_mission(name: str, tmp_path: Path) -> None:
    body, sub, expected = SUBTREES[name]
    made = of_body(tmp_path, body, f'<{TREE} ID="Sub">{sub}</{TREE}>')
    assert not made.report.has_errors, made.words
    assert run(made) == expected, (made.text, made.beside)


def test_each_node_of_the_table_is_tried_or_told() -> None:
    tried = " ".join([*RUNS, *(body for body, *_ in (*RUNS.values(), *SUBTREES.values()))])
    left_out = {name for name, row in nodes.NODES.items() if row.ours == nodes.NOT_IMPORTED}
    switches = {f"Switch{count}" for count in (4, 5, 6)}  # as Switch2 and Switch3
    missing = [name for name in (*nodes.NODES, *nodes.CONDITIONS) if name not in tried]
    assert set(missing) <= left_out | switches
    readers = forest_importer._READERS
    read = {name for name, row in nodes.NODES.items() if not row.word} - left_out
    assert read <= readers.keys() <= nodes.NODES.keys()


SUB = f'<{TREE} ID="Sub"><A/></{TREE}>'
WRONG: Mapping[str, tuple[str, str, list[tuple[str, int]]]] = {
    "a circle": ('<SubTree ID="Sub"/>', f'<{TREE} ID="Sub"><SubTree ID="Main"/></{TREE}>', [("RBX2264", 6)]),
    "itself": ('<SubTree ID="Main"/>', "", [("RBX2264", 3)]),
    "no such tree": ('<SubTree ID="Su"/>', SUB, [("RBX2266", 2), ("RBX2264", 3)]),
    "two of one name": ("<A/>", f'<{TREE} ID="Main"><B/></{TREE}>', [("RBX2264", 5)]),
    "a tree with two nodes": ("<A/>", f'<{TREE} ID="Sub"><A/><B/></{TREE}>', [("RBX2264", 5)]),
    "no ID": ("<Action/>", "", [("RBX2264", 3)]),
    "no such port": ('<Sleep msec="1" mesc="2"/>', "", [("RBX2264", 3)]),
    "no value for a port": ("<Sleep/>", "", [("RBX2264", 3)]),
    "too few children": ("<Inverter/>", "", [("RBX2264", 3)]),
    "too many children": ("<Sequence><A/><IfThenElse><A/></IfThenElse></Sequence>", "", [("RBX2264", 5)]),
    "no number": ('<RetryUntilSuccessful num_attempts="many"><A/></RetryUntilSuccessful>', "", [("RBX2265", 3)]),
    "no number of times": ('<Repeat num_cycles="0"><A/></Repeat>', "", [("RBX2265", 3)]),
    "no time": ('<Timeout msec="-5"><A/></Timeout>', "", [("RBX2265", 3)]),
    "a threshold too high": ('<Parallel success_count="3"><A/><B/></Parallel>', "", [("RBX2265", 3)]),
    "a threshold in words": ('<Parallel failure_count="any"><A/><B/></Parallel>', "", [("RBX2265", 3)]),
    "a threshold of an entry": (
        '<ParallelAll max_failures="{n}"><A/><B/></ParallelAll>',
        "",
        [("RBX2266", 2), ("RBX2265", 3)],
    ),
    "an unknown attribute": ('<A _skipIF="true"/>', "", [("RBX2264", 3)]),
    "bits": ('<ScriptCondition code="(a &amp; 4) == 4"/>', "", [("RBX2265", 3)]),
    "a choice in a script": ('<Script code="a := b ? 1 : 2"/>', "", [("RBX2265", 3)]),
    "no script": ('<Script code="a := := 3"/>', "", [("RBX2265", 3)]),
    "a remap to nothing": ('<SubTree ID="Sub" x="{y}"/>', SUB, [("RBX2266", 3)]),
    "nodes with children": ("<Mine><A/></Mine>", "", [("RBX2265", 3)]),
    "nodes without a counterpart": ('<UnsetBlackboard key="x"/>', "", [("RBX2265", 3)]),
    "an action that is done again there": ('<ReactiveSequence><A x="1"/><B/></ReactiveSequence>', "", [("RBX2266", 4)]),
    "a shared entry": ('<A x="{@home}"/>', "", [("RBX2265", 2), ("RBX2266", 2)]),
    "a port that is two": (
        "<A/>",
        '<TreeNodesModel><Action ID="A"><input_port name="x"/><output_port name="x"/></Action></TreeNodesModel>',
        [("RBX2264", 8)],
    ),
    "a port of no model": (
        '<A y="1"/>',
        '<TreeNodesModel><Action ID="A"><input_port name="x"/></Action></TreeNodesModel>',
        [("RBX2264", 3)],
    ),
    "a port without a value": (
        '<SubTree ID="Sub"/>',
        f'<TreeNodesModel><SubTree ID="Sub"><input_port name="x"/></SubTree></TreeNodesModel>{SUB}',
        [("RBX2264", 3)],
    ),
    "a package of ROS": ("<A/>", '<include ros_pkg="a" path="b.xml"/>', [("RBX2264", 5)]),
    "a file that is not there": ("<A/>", '<include path="b.xml"/>', [("RBX2264", 5)]),
}


@for_all("name", WRONG)
def test_what_is_wrong_is_told_at_its_place_and_fails_instead(name: str, tmp_path: Path) -> None:
    body, more, told = WRONG[name]
    made = of_body(tmp_path, body, more)
    assert made.told == told, made.words
    for text in (made.text, *made.beside.values()):
        program(text)


def test_what_was_left_out_fails(tmp_path: Path) -> None:
    made = of_body(tmp_path, "<Sequence><ManualSelector><A/></ManualSelector><B/></Sequence>")
    assert run(made) == "failure: "
    assert "# tried.xml:4: 'ManualSelector' is left out" in made.text


def test_nodes_of_nav2_without_a_counterpart_are_told_with_what_comes_near(tmp_path: Path) -> None:
    made = of_body(tmp_path, '<RateController hz="1.0"><A/></RateController>')
    assert [(found.code, "`every`" in found.help) for found in made.report] == [("RBX2265", True)]
    assert "your program" not in made.words


REFUSED = {
    "no XML": ("<root", "RBX2001"),
    "another root": ("<robot/>", "RBX2231"),
    "entities": ('<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><root>&b;</root>', "RBX2001"),
    "no tree": (ROOT.format(""), "RBX2238"),
    "ten thousand levels": (ROOT.format("<Sequence>" * 10_000 + "</Sequence>" * 10_000), "RBX1103"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_file_of_trees_is_refused(name: str, tmp_path: Path) -> None:
    text, code = REFUSED[name]
    made = of_text(tmp_path, text)
    assert [found for found, _ in made.told] == [code], made.words
    assert not made.text


def test_large_files_take_bounded_time(tmp_path: Path) -> None:
    before = time.process_time()
    wide = of_body(tmp_path, f"<Sequence>{'<A/>' * 20_000}</Sequence>")
    twice = "<Sequence><SubTree ID='T{0}'/><SubTree ID='T{0}' _autoremap='1'/></Sequence>"
    trees = "".join(f'<{TREE} ID="T{n}">{twice.format(n - 1)}</{TREE}>' for n in range(1, 200))
    bushy = of_body(
        tmp_path, '<SubTree ID="T199" _autoremap="true"/>', f'<{TREE} ID="T0"><A x="{{y}}"/></{TREE}>{trees}'
    )
    entries = "".join(f'<A x="{{e{n}}}"/>' for n in range(5_000))
    passing = of_body(
        tmp_path,
        f"<Sequence>{'<SubTree ID=%sS%s _autoremap=%s1%s/>' % ((chr(34),) * 4) * 5_000}</Sequence>",
        f'<{TREE} ID="S"><Sequence>{entries}</Sequence></{TREE}>',
    )
    assert ("RBX2264", 8) in passing.told
    assert time.process_time() - before < 15
    assert wide.text
    assert len(bushy.beside) == 200
    deep = of_body(tmp_path, "<Inverter><Sequence>" * 29 + "<A/>" + "</Sequence></Inverter>" * 29)
    assert not deep.report.has_errors
    too_deep = of_body(tmp_path, "<Sequence>" * 50 + "<A/>" + "</Sequence>" * 50)
    assert too_deep.told == [("RBX2264", 2)]


def test_files_are_included_once_and_version_3_is_told(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/other.xml").write_text(
        f'<root><include path="../tried.xml"/><{TREE} ID="Sub"><SequenceStar><A/></SequenceStar></{TREE}></root>'
    )
    body = f'<include path="sub/other.xml"/><{TREE} ID="Main"><SubTreePlus ID="Sub" __autoremap="1"/></{TREE}>'
    made = of_text(tmp_path, f'<root main_tree_to_execute="Main">{body}</root>')
    assert made.told == [("RBX2266", 1), ("RBX2266", 1)]
    assert run(made) == "success: 0 a"


@pytest.mark.parametrize("version", [3, 4])
def test_texts_without_braces_are_entries_for_sub_trees_of_version_3(version: int, tmp_path: Path) -> None:
    main = (
        '<Sequence><SetBlackboard output_key="goal" value="dock"/>'
        '<SubTree ID="Sub" target="goal" result="found"/><SubTreePlus ID="Sub" target="goal"/></Sequence>'
    )
    sub = '<Sequence><Go to="{target}"/><SetBlackboard output_key="result" value="done"/></Sequence>'
    trees = f'<{TREE} ID="Main">{main}</{TREE}><{TREE} ID="Sub">{sub}</{TREE}>'
    made = of_text(tmp_path, f'<root BTCPP_format="{version}">{trees}</root>')
    _, *used = made.data["do"]["sequence"]
    assert [step["with"]["target"] for step in used] == ["$goal" if version == 3 else "goal", "goal"]
    kept = {"set": {"found": "$sub_result.result"}}
    assert used[0].get("on_success") == (kept if version == 3 else None), made.text
    assert not made.told


def test_an_entry_that_nothing_sets_is_named_as_the_mission_reads_it(tmp_path: Path) -> None:
    made = of_body(tmp_path, '<Sequence><A/><B port="{a}" goal="{theGoal}" n="{n}"/></Sequence>')
    assert made.data["do"]["sequence"][1]["b"]["port"] == "$a_2"
    assert "sets 'a', here 'a_2', 'theGoal', here 'the_goal', 'n'" in made.words


def test_a_main_tree_that_is_not_there_is_told(tmp_path: Path) -> None:
    made = of_text(
        tmp_path, f'<root BTCPP_format="4" main_tree_to_execute="Man"><{TREE} ID="Main"><A/></{TREE}></root>'
    )
    assert [(found.code, found.help) for found in made.report] == [("RBX2264", "did you mean 'Main'?")]
    assert run(made) == "success: 0 a"


def test_what_is_written_and_what_is_told(golden: Golden) -> None:
    made = import_files([EXAMPLES / "bt/watch.xml"], "watch", "bt")
    golden.check("bt_watch.yaml", "---\n".join([made.text, *made.beside.values()]))
    golden.check("bt_watch.txt", made.words)
    for text in (made.text, *made.beside.values()):
        program(text)


def test_names_follow_one_rule() -> None:
    names = {"GoTo": "go_to", "IsDoorClosed": "is_door_closed", "moveGoal": "move_goal", "HTTPGet": "http_get",
             "Wait": "wait_skill", "my node-2": "my_node_2", "Ünïted": "n_ted", "42": "unnamed"}  # fmt: skip
    assert {name: nodes.skill_name(name) for name in names} == names
    assert {name: nodes.node_name(name) for name in ("go_to", "a_b", "sleep", "go_2")} == {
        "go_to": "GoTo", "a_b": "a_b", "sleep": "sleep", "go_2": "go_2"
    }  # fmt: skip


def test_outputs_of_nodes_are_set_and_guessed_without_a_model(tmp_path: Path) -> None:
    body = '<Sequence><Look people="{n}"/><Say words="{n}"/></Sequence>'
    guessed = of_body(tmp_path, body)
    assert guessed.told == [("RBX2266", 2)]
    model = '<TreeNodesModel><Action ID="Look"><output_port name="people"/></Action></TreeNodesModel>'
    made = of_body(tmp_path, body, model)
    assert not made.told
    for found in (guessed, made):
        steps = found.data["do"]["sequence"]
        assert steps[0] == {
            "look": None, "save": "look_result", "on_success": {"set": {"n": "$look_result.people"}}
        }  # fmt: skip
        assert steps[1] == {"say": {"words": "$n"}}


TAGS = st.sampled_from([*nodes.NODES, *nodes.EXPLICIT, "Walk", "name", "optional"])
PORTS = st.sampled_from(
    sorted({*nodes.CONDITIONS, "ID", "name", "goal", *(port for row in nodes.NODES.values() for port in row.ports)})
)
VALUES = st.sampled_from(
    [
        "",
        "{x}",
        "{=}",
        "-1",
        "1;2",
        "{@g}",
        "true",
        "a b",
        "x := 1",
        "x < 1",
        "$x",
        "1e400",
        "0x1F",
        "Sub",
        "SKIPPED",
        "'",
    ]
)
GIVEN = st.dictionaries(PORTS, VALUES, max_size=4)
LEAF: st.SearchStrategy[Any] = st.builds(lambda tag, given: (tag, given, []), TAGS, GIVEN)
ELEMENTS = st.recursive(
    LEAF, lambda inner: st.tuples(TAGS, GIVEN, st.lists(inner, min_size=1, max_size=4)), max_leaves=8
)


def _written(element: tuple[str, dict[str, str], list[Any]]) -> str:
    tag, given, children = element
    head = " ".join([tag, *(f"{key}={quoted(text)}" for key, text in given.items())])
    return f"<{head}>{''.join(map(_written, children))}</{tag}>"


@given(ELEMENTS, ELEMENTS)
def test_whatever_a_file_says_what_is_written_can_be_read(
    tmp_path_factory: pytest.TempPathFactory, main: Any, sub: Any
) -> None:
    made = of_body(tmp_path_factory.mktemp("any"), _written(main), f'<{TREE} ID="Sub">{_written(sub)}</{TREE}>')
    for text in (made.text, *made.beside.values()):
        program(text)
