"""The mission engine: many nodes at one tick, and many nodes read from a file."""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from typing import Any

from benchmarks.generate import mission
from benchmarks.measuring import Row, in_turns
from rbxcompose.base.expressions.types import TYPES
from rbxcompose.base.expressions.values import NotArrived, Value
from rbxcompose.base.findings import Report
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.program import Program, RobotNames
from rbxcompose.missions.view.replica import Mirror

MEASURES = ("rbxcompose/manifest", "rbxcompose/missions")

NODES = 1000
TICKS = 50  # per sample
ROBOT = RobotNames({"battery": TYPES["ratio"]})
NOT_INSTALLED = "; py_trees is not installed (extra `bench`)"
HEAD = "rbx: 1\nkind: Mission\nname: many\ndo:\n  repeat: forever\n  every: 1 s\n  do:\n"
BRANCHES, STEPS = 32, 30  # about as many nodes
PARALLEL = HEAD + "    parallel:\n" + ("      - sequence:\n" + "          - check: true\n" * STEPS) * BRANCHES
STATE = "{do: {check: true}, next: {success: finished, failure: failed}}"
MACHINES = HEAD + f"    - machine: {{start: s, states: {{s: {STATE}}}}}\n" * (NODES // 3)


class World:
    """A robot whose battery is nearly full and which has no skills."""

    def __init__(self) -> None:
        self.said = 0

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the only value."""
        return 0.9

    def age(self, name: str, /) -> float | NotArrived:
        """Return that it is new."""
        return 0.0

    def count(self, name: str, /) -> int:
        """Return that it came once."""
        return 1

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Start nothing."""

    def halt(self, leaf: int, /) -> None:
        """Stop nothing."""

    def pause(self, leaf: int, /) -> None:
        """Hold nothing."""

    def resume(self, leaf: int, /) -> None:
        """Let nothing go on."""

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Publish nothing."""

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Call nothing."""

    def say(self, event: MissionEvent, /) -> None:
        """Count what is said."""
        self.said += 1


def rows() -> list[Row]:
    """Return the engine's figures."""
    return [
        _ticks("check: true", "steps that do nothing", "py_trees, Success", _py_trees(_successes)),
        _ticks("check: $battery > 5 %", "conditions", "py_trees, CheckBlackboardVariableValue", _py_trees(_conditions)),
        _row(_run(PARALLEL), "parallel lists", "py_trees, Parallel", _py_trees(_lists, is_parallel=True)),
        _row(_run(MACHINES), "machines, one after another", "", None),
        _watched(),
        _reading(),
    ]


def _ticks(step: str, what: str, against: str, peer: Callable[[], object] | None) -> Row:
    return _row(_engine(step), what, against, peer)


def _row(ours: Callable[[], object], what: str, against: str, peer: Callable[[], object] | None) -> Row:
    times = in_turns(ours, *([peer] if peer else []), rounds=15)
    speeds = [NODES * TICKS / time.median for time in times]
    return Row(
        name=f"{NODES:,} mission nodes per tick: {what}",
        unit="M nodes/s",
        how="all of them done at each tick, statuses recorded" + ("" if peer or not against else NOT_INSTALLED),
        ours=speeds[0] / 1e6,
        peer=speeds[1] / 1e6 if peer else None,
        against=against if peer else "",
        least_ratio=10 if peer else None,
    )


def _watched() -> Row:
    """Return what a viewer costs that looks after each tick."""
    step = "check: $battery > 5 %"
    watched, alone = in_turns(_engine(step, is_watched=True), _engine(step), rounds=15)
    return Row(
        name=f"{NODES:,} mission nodes per tick with a viewer",
        unit="ms",
        how="as above, conditions; all statuses and data are compared after each tick",
        ours=watched.median / TICKS * 1e3,
        peer=alone.median / TICKS * 1e3,
        against="without a viewer",
        most_ratio=1.25,
    )


def _reading() -> Row:
    text = mission(NODES)

    def read() -> None:
        program = _program(text)
        Engine(program, ROBOT, {}, World())

    (ours,) = in_turns(read, rounds=15)
    return Row(
        name=f"build a mission of {len(_program(text).nodes):,} nodes",
        unit="ms",
        how="from YAML text to an engine: read, checked, built",
        ours=ours.median * 1e3,
        p99=ours.p99 * 1e3,
        most=500,
    )


def _program(text: str) -> Program:
    root, findings = read_text(text, "mission.yaml")
    report = Report(list(findings))
    program = read_program(root, report) if isinstance(root, MappingNode) else None
    if program is not None:
        report.extend(check_program(program, ROBOT))
    if program is None or report.has_errors:
        raise ValueError(f"the mission has findings: {list(report)[:3]}")
    return program


def _engine(step: str, *, is_watched: bool = False) -> Callable[[], object]:
    return _run(HEAD + f"    - {step}\n" * (NODES - 2), is_watched=is_watched)


def _run(text: str, *, is_watched: bool = False) -> Callable[[], object]:
    engine = Engine(_program(text), ROBOT, {}, World())
    mirror, now, version = Mirror(engine), [0.0], [0]

    def run() -> None:
        for _ in range(TICKS):
            engine.tick(now[0])
            now[0] += 1.0
            if is_watched:
                version[0] = mirror.look(version[0])["version"]

    return run


def _py_trees(leaves: Callable[[Any], list[Any]], *, is_parallel: bool = False) -> Callable[[], object] | None:
    if not find_spec("py_trees"):
        return None
    py_trees: Any = importlib.import_module("py_trees")
    root = py_trees.composites.Sequence("all", memory=False)
    if is_parallel:
        root = py_trees.composites.Parallel("all", py_trees.common.ParallelPolicy.SuccessOnAll(synchronise=False))
    root.add_children(leaves(py_trees))
    tree = py_trees.trees.BehaviourTree(root)  # without visitors: each node keeps its status, as ours do

    def run() -> None:
        for _ in range(TICKS):
            tree.tick()

    return run


def _lists(py_trees: Any) -> list[Any]:
    lists = []
    for branch in range(BRANCHES):
        lists.append(py_trees.composites.Sequence(f"list {branch}", memory=False))
        lists[-1].add_children([py_trees.behaviours.Success(f"step {number}") for number in range(STEPS)])
    return lists


def _successes(py_trees: Any) -> list[Any]:
    return [py_trees.behaviours.Success(f"step {number}") for number in range(NODES - 1)]


def _conditions(py_trees: Any) -> list[Any]:
    board = py_trees.blackboard.Client(name="bench")
    board.register_key("battery", access=py_trees.common.Access.WRITE)
    board.battery = 0.9
    check = py_trees.common.ComparisonExpression("battery", 0.05, operator.gt)
    kind = py_trees.behaviours.CheckBlackboardVariableValue
    return [kind(f"check {number}", check) for number in range(NODES - 1)]
