"""Picking an object: planned by one process and by two, on tables that are easy and hard."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from benchmarks.measuring import Row, in_turns
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.arms.planning_processes import PlanningProcess
from rbxcompose.domains.body.model import Geometry
from rbxcompose.msgs.rbxcompose_msgs import PickObject
from tests.motion.pi_hand import HandBench, made
from tests.motion.test_ways_ahead import CONFINED, cluttered

MEASURES = ("rbxcompose/domains/arms",)

ROUNDS = 5
LIMIT = 2.0  # [s] for each motion
ROOF = PlacedObject("roof", Geometry("box", (0.1, 0.1, 0.02)), "base_footprint", Transform3((0.24, 0.0, 0.85)))
TABLES: dict[str, Callable[[], HandBench]] = {
    "an easy pick": HandBench,
    "a pick with all 98 grasps blocked": lambda: HandBench(ROOF),
    "a pick with no way to five grasps": lambda: cluttered(CONFINED),
}
HOW = f"until the pick has ended or failed, {LIMIT:g} s for each motion; robot, servos and fingers take no time"


def rows() -> list[Row]:
    """Return the figures of picking by two processes, beside one."""
    config, _, works = made()
    works.planner.settings, works.planner.now = replace(works.planner.settings, time=LIMIT), time.monotonic
    short = config.model_copy(update={"planner": config.planner.model_copy(update={"time": LIMIT})})
    helper, found = PlanningProcess(short, print, time.monotonic), []
    while not helper.is_idle:
        time.sleep(0.1)
    for what, table in TABLES.items():

        def picked(*helpers: PlanningProcess, table: Callable[[], HandBench] = table) -> object:
            works.helpers = helpers
            return table().carried_out(PickObject.Goal(object="target"))

        one, two = in_turns(picked, partial(picked, helper), rounds=ROUNDS, clock=time.perf_counter)
        found.append(Row(what, "s", HOW, two.median, two.p99, one.median, "one process", most_ratio=1.2))
    helper.close()
    return found
