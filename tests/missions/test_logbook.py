"""The log of a mission, and the mission run again from it."""

from __future__ import annotations

import contextlib
import copy
import json
from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.missions.engine.logbook import INPUTS, ReplayBudget, ReplayError, replay
from rbxcompose.missions.execution.requests import PauseMission, ResumeMission
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.sdk import Outcome
from tests.executive.fake_robot import Robot

MISSION = """
inputs:
  low:
    type: ratio
    default: 50 %
data:
  visited: []
  pause: 1 s
interrupts:
  battery_low:
    when: $battery < $low
    do:
      - go_to: dock
      - recharge
    afterwards: continue
do:
  - for: place
    in: [corner, dock]
    order: random
    do:
      go_to: $place
      timeout: 10 s
      optional: true
  - wait: $pause
  - fallback:
      - toy_raise
      - check: age($battery) < 1 s
      - say: enough
  - publish: words
    message: done at $battery
"""


def recorded() -> tuple[Robot, list[dict[str, Any]]]:
    """Run a mission with all that may happen to one, and return what was logged, as it comes from a file."""
    robot = Robot(MISSION)
    robot.mission.config.inputs["test"] = {"low": 0.5}
    robot.start()
    robot.level(100.0)
    robot.advance(2.0)
    robot.level(40.0)
    robot.advance(1.0)
    robot.go_to.end(Outcome.SUCCEEDED)
    robot.advance(1.0)
    robot.level(90.0)
    robot.recharge.end(Outcome.SUCCEEDED, result=Recharge.Result(level=90.0))
    robot.advance(3.0)
    robot.mission.handle(PauseMission())
    robot.advance(5.0)
    robot.mission.handle(ResumeMission())
    robot.advance(11.0)
    robot.go_to.end(Outcome.ABORTED, "stuck")
    robot.advance(20.0)
    assert robot.mission.missions.runs["test"].is_over, robot.lines
    return robot, [json.loads(json.dumps(record)) for record in robot.mission.missions.since(0).records]


def told(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    own = ("mission", "run", "step")
    return [{key: value for key, value in record.items() if key not in own} for record in records]


def test_a_replay_of_a_log_tells_the_same() -> None:
    robot, records = recorded()
    before = [record for record in records if record["event"] not in INPUTS]
    again = replay(records, robot.mission.config.programs["test"], robot.mission.config.names)
    assert told(again) == told(before)
    assert {"interrupt_started", "reported", "published", "mission_ended"} <= {record["event"] for record in again}


def test_what_came_in_is_not_published_but_what_was_done_is() -> None:
    robot, records = recorded()
    assert robot.published == [record for record in records if record["event"] not in INPUTS]


def test_a_log_without_its_beginning_cannot_be_replayed() -> None:
    robot, records = recorded()
    with pytest.raises(ReplayError):
        replay(records[1:], robot.mission.config.programs["test"], robot.mission.config.names)


def test_another_mission_gives_another_trace() -> None:
    robot, records = recorded()
    other = Robot(MISSION.replace("wait: $pause", "wait: 2 s")).mission.config
    assert replay(records, other.programs["test"], other.names) != replay(
        records, robot.mission.config.programs["test"], robot.mission.config.names
    )


SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.just(10**400)
KEYS = st.sampled_from(["map", "tuple", "number", "missing", "Place", "Result", "HeldNode", "value battery", "raised"])
PLAIN = st.recursive(
    SCALARS,
    lambda below: st.lists(below, max_size=3) | st.dictionaries(KEYS | st.text(max_size=3), below, max_size=2),
    max_leaves=6,
)
once = cache(recorded)


@given(st.data())
def test_a_log_with_anything_changed_is_replayed_or_refused(data: st.DataObject) -> None:
    robot, log = once()
    records: list[Any] = copy.deepcopy(log)
    for _ in range(data.draw(st.integers(1, 3))):
        change(records, data)
    with contextlib.suppress(ReplayError):
        replay(records, robot.mission.config.programs["test"], robot.mission.config.names)


def change(records: list[Any], data: st.DataObject) -> None:
    """Replace, remove or double something: a record that matters, or anything within one."""
    inputs = [
        at for at, record in enumerate(records) if isinstance(record, dict) and record.get("event") in list(INPUTS)
    ]
    place: Any = records
    key: Any = data.draw(st.sampled_from(inputs or [0]))
    while isinstance(place[key], dict | list) and place[key] and data.draw(st.booleans() | st.just(True)):
        place = place[key]
        key = data.draw(st.sampled_from(list(place) if isinstance(place, dict) else range(len(place))))
    match data.draw(st.sampled_from(["replace", "remove", "double"])):
        case "replace":
            place[key] = data.draw(PLAIN)
        case "remove" if len(place) > 1:
            del place[key]
        case "double" if isinstance(place, list):
            place.insert(key, copy.deepcopy(place[key]))


def test_a_replay_ends_with_its_budget() -> None:
    robot, records = recorded()
    names = robot.mission.config.programs["test"], robot.mission.config.names
    budget = ReplayBudget()
    replay(records, *names, budget)
    spent = ReplayBudget().left - budget.left
    assert spent > len(records)
    replay(records, *names, ReplayBudget(spent))
    with pytest.raises(ReplayError, match="too long"):
        replay(records, *names, ReplayBudget(spent - 1))


def test_a_deep_value_is_refused() -> None:
    robot, records = recorded()
    deep: Any = []
    for _ in range(300):
        deep = [deep]
    records[0]["inputs"]["low"] = deep
    with pytest.raises(ReplayError, match="levels"):
        replay(records, robot.mission.config.programs["test"], robot.mission.config.names)
