"""The mission engine: many nodes at one tick, and many nodes read from a file."""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from typing import Any

from benchmarks.generate import mission
from benchmarks.measuring import Row, in_turns
from rbxcompose.expressions.types import TYPES
from rbxcompose.expressions.values import NotArrived, Value
from rbxcompose.findings import Report
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import Mapping as Tree
from rbxcompose.missions.engine import Engine
from rbxcompose.missions.events import MissionEvent
from rbxcompose.missions.program import Program, RobotNames
from rbxcompose.missions.reading import read_program
from rbxcompose.missions.semantics import check_program

NODES = 1000
TICKS = 50  # per sample
ROBOT = RobotNames({"battery": TYPES["ratio"]})
NOT_INSTALLED = "; py_trees is not installed (extra `bench`)"
HEAD = "rbx: 1\nkind: Mission\nname: many\ndo:\n  repeat: forever\n  every: 1 s\n  do:\n"


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

    def say(self, event: MissionEvent, /) -> None:
        """Count what is said."""
        self.said += 1


def rows() -> list[Row]:
    """Return the engine's figures."""
    return [
        _ticks("check: true", "steps that do nothing", "py_trees, Success", _py_trees(_successes)),
        _ticks("check: $battery > 5 %", "conditions", "py_trees, CheckBlackboardVariableValue", _py_trees(_conditions)),
        _reading(),
    ]


def _ticks(step: str, what: str, against: str, peer: Callable[[], object] | None) -> Row:
    times = in_turns(_engine(step), *([peer] if peer else []), rounds=15)
    speeds = [NODES * TICKS / one.median for one in times]
    return Row(
        name=f"{NODES:,} mission nodes per tick: {what}",
        unit="M nodes/s",
        how="a list, all of it done at each tick, statuses recorded" + ("" if peer else NOT_INSTALLED),
        ours=speeds[0] / 1e6,
        peer=speeds[1] / 1e6 if peer else None,
        against=against if peer else "",
        least_ratio=10,
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
    program = read_program(root, report) if isinstance(root, Tree) else None
    if program is not None:
        report.extend(check_program(program, ROBOT))
    if program is None or report.has_errors:
        raise ValueError(f"the mission has findings: {list(report)[:3]}")
    return program


def _engine(step: str) -> Callable[[], object]:
    engine = Engine(_program(HEAD + f"    - {step}\n" * (NODES - 2)), ROBOT, {}, World())
    now = [0.0]

    def run() -> None:
        for _ in range(TICKS):
            engine.tick(now[0])
            now[0] += 1.0

    return run


def _py_trees(leaves: Callable[[Any], list[Any]]) -> Callable[[], object] | None:
    if not find_spec("py_trees"):
        return None
    py_trees: Any = importlib.import_module("py_trees")
    root = py_trees.composites.Sequence("all", memory=False)
    root.add_children(leaves(py_trees))
    tree = py_trees.trees.BehaviourTree(root)  # without visitors: each node keeps its status, as ours do

    def run() -> None:
        for _ in range(TICKS):
            tree.tick()

    return run


def _successes(py_trees: Any) -> list[Any]:
    return [py_trees.behaviours.Success(f"step {number}") for number in range(NODES - 1)]


def _conditions(py_trees: Any) -> list[Any]:
    board = py_trees.blackboard.Client(name="bench")
    board.register_key("battery", access=py_trees.common.Access.WRITE)
    board.battery = 0.9
    check = py_trees.common.ComparisonExpression("battery", 0.05, operator.gt)
    kind = py_trees.behaviours.CheckBlackboardVariableValue
    return [kind(f"check {number}", check) for number in range(NODES - 1)]
