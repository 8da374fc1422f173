"""The page about small machines: what was measured is what it shows."""

from __future__ import annotations

import json
import os

from docs.generating.small_machines import ABOUT, KEPT, WAYS, costs, small_machines
from rbxcompose.compiler.compile import compile_robot
from tests.packaging.builds import ROOT


def test_every_way_was_measured_and_every_process_is_explained() -> None:
    ways = json.loads(KEPT.read_text(encoding="utf-8"))["ways"]
    assert list(ways) == list(WAYS), "run `python -m docs.generating.small_machines`, then `make docs`"
    assert {process for way in ways.values() for process in way} <= ABOUT.keys()
    assert all(f"| {way} |" in small_machines() for way in WAYS)


def test_a_robot_in_one_process_is_smaller_and_the_page_takes_memory() -> None:
    ways = json.loads(KEPT.read_text(encoding="utf-8"))["ways"]
    whole = {name: sum(cost["memory"] for cost in way.values()) for name, way in ways.items()}
    assert whole["in one process"] < whole["as it is"] < whole["with a console"]


def test_the_processes_of_the_table_are_those_of_the_plan() -> None:
    ways = json.loads(KEPT.read_text(encoding="utf-8"))["ways"]
    for name, layers in (("as it is", ()), ("`--profile fleet`", ("fleet",))):
        plan = compile_robot(str(ROOT / "robots/turtlebot"), environment={}, profiles=layers).plan
        assert plan is not None
        assert set(plan.groups) == ways[name].keys() - {"supervisor", "parent", "router"}


def test_the_cost_of_a_process_is_measured() -> None:
    cost = next(iter(costs(os.getpid(), watched=0.05).values()))
    assert cost.memory > 1_000_000
    assert cost.processor >= 0
