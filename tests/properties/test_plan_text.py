"""A plan that is written down and read again is the same plan."""

from __future__ import annotations

import json
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.config import Place, Secret
from rbxcompose.compiler.plan.dump import PlanTextError, dump, load
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.muxes.config import MuxConfig
from rbxcompose.domains.power.components.charger import ChargerConfig
from rbxcompose.testing import check_text, instance, run_robot
from tests.loops import for_all
from tests.shipped import compiled
from tests.soak import Soak, rare

ROOT = Path(__file__).parents[2]
ROBOTS = sorted((ROOT / "robots").glob("*/robot.yaml"))
OFTEN = ("house", "kobuki", "porter")  # which together have every type of component of those robots
MISSION = """
rbx: 1
kind: Mission
name: visit
about: Every kind of value, and of node.
inputs:
  target: {{type: place, default: spot}}
  share: {{type: ratio, default: {share} %}}
  words: {{type: list, default: [a, {number}, true]}}
  table: {{type: map, default: {{x: {number}, a: spot}}}}
  colour: {{type: choice, choices: [red, green], default: red}}
data:
  seen: {{z: 1, a: [{number}, {number} s, "{word}"]}}
  done: false
interrupts:
  low:
    when: $battery < $share / 2
    do:
      - log: low at $target and $battery
do:
  - repeat: {rounds}
    do:
      for: each
      in: [spot, other]
      do:
        go_to: $each
        timeout: {number} s
        attempts: 2
        optional: true
    every: {number} s
  - if: not $done and count($words) > 1
    then:
      set: {{done: true}}
  - wait: {number} s
  - log: "{word}"
"""
ROBOT = """
rbx: 1
kind: Robot
name: round_trip
places:
  spot: {{x: {number} m, y: -{number} m, heading: {share} deg}}
  other: {{x: 0 m, y: 1 m, heading: 0 deg}}
values:
  battery: battery.battery_level
components:
  battery: {{type: battery_sim, runtime: {number} s, process: cells}}
  base: {{type: diff_drive_sim, max_turn_rate: {share} deg/s}}
  go_to: {{type: go_to, speed: {number} m/s, starts_after: [base]}}
  charger: {{type: charger, dock: spot, reach: {number} m}}
muxes:
  cmd_vel:
    inputs:
      teleop: {{priority: {rounds}00, timeout: {number} s}}
      navigation: {{from: go_to, priority: 1, timeout: 0.5 s}}
diagnostics:
  analyzers:
    all: {{match: ["*"]}}
    deep:
      analyzers:
        one: {{match: [{{any: [base, {{regex: "b.*"}}], not: {{name: x}}}}], debounce: {number} s, count: {rounds}}}
        two: {{match: ["bat*"], debounce: {{up: {number} s}}, count: {{max: {rounds}}}, suppressed_by: one, path: T}}
missions:
  visit: visit.yaml
start: visit
triggers:
  empty: {{when: "$battery < {share} % and $battery > 1 %", mission: visit}}
"""
NUMBERS = st.floats(0.01, 1e6).map(lambda value: f"{value:.12f}")
WORDS = st.text(alphabet=st.characters(codec="utf-8", categories=["L", "N", "P", "S", "Zs"]), max_size=20).map(
    lambda text: text.replace("\\", "").replace('"', "").replace("$", "")
)


def shipped(path: Path) -> Plan:
    out = compiled(str(path), environment={})
    assert out.plan
    return out.plan


@pytest.mark.parametrize(
    "path",
    [
        *(path for path in ROBOTS if path.parent.name in OFTEN),
        *rare(*(path for path in ROBOTS if path.parent.name not in OFTEN)),
    ],
    ids=lambda path: path.parent.name,
)
def test_a_shipped_robot_comes_back_as_it_was(path: Path) -> None:
    plan = shipped(path)
    text = dump(plan)
    again = load(text)
    assert again == plan
    assert dump(again) == text


@given(number=NUMBERS, share=st.integers(1, 99), rounds=st.integers(1, 9), word=WORDS)
def test_any_robot_comes_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, number: str, share: int, rounds: int, word: str
) -> None:
    values: dict[str, object] = {"number": number, "share": share, "rounds": rounds, "word": f"x{word}"}
    folder = tmp_path_factory.mktemp("robot")
    plan = check_text(ROBOT.format(**values), folder, others={"visit.yaml": MISSION.format(**values)}).compilation.plan
    if plan is not None:  # some numbers are refused together with others
        assert load(dump(plan)) == plan


def test_the_robot_of_these_tests_is_one(tmp_path: Path) -> None:
    values: dict[str, object] = {"number": "0.4", "share": 60, "rounds": 2, "word": "hello"}
    others = {"visit.yaml": MISSION.format(**values)}
    checked = check_text(ROBOT.format(**values), tmp_path, others=others)
    assert load(dump(checked.plan)) == checked.plan


def test_a_plan_that_came_back_runs_to_the_same_log() -> None:
    sets = ("missions.patrol.with.rounds=1",)
    plan = compiled(str(ROOT / "robots/turtlebot/robot.yaml"), sets=sets, environment={}).plan
    assert plan
    assert run_robot(load(dump(plan))).log == run_robot(plan).log


def test_a_map_comes_back_in_the_order_in_which_it_was_written() -> None:
    inputs = {"lap": {"priority": 1, "timeout": 1}, "dock": {"priority": 2, "timeout": 1}}
    plan = Plan("one", "one.yaml", (instance("cmd_vel", "mux", {"inputs": inputs, "output": "cmd_vel"}),))
    config = load(dump(plan)).instances[0].config
    assert isinstance(config, MuxConfig)
    assert [*config.inputs] == [*inputs]


def test_what_has_no_limit_comes_back_without_one(tmp_path: Path) -> None:
    robot = "rbx: 1\nkind: Robot\nname: one\ncomponents: {cell: {type: battery_sim, runtime: 1 h}}\nconsole: {}\n"
    plan = check_text(robot, tmp_path).plan
    assert load(dump(plan)) == plan  # there is no base, whose speeds the page would keep


def test_a_place_comes_back_as_the_place_itself() -> None:
    dock = Place("dock", 1.0, 2.0, 0.1 + 0.2)
    plan = Plan("one", "one.yaml", (instance("charger", "charger", {"dock": "dock"}, [dock]),))
    config = load(dump(plan)).instances[0].config
    assert isinstance(config, ChargerConfig)
    assert config.dock == dock


def test_nobody_is_shown_a_secret(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = Plan("one", "one.yaml", (instance("battery", "battery_sim", {"runtime": "45 s"}),))
    config = plan.instances[0].config.model_copy(update={"runtime": Secret("correct horse")})
    told = dump(replace(plan, instances=(replace(plan.instances[0], config=config),)))
    assert "correct horse" not in told
    assert "***" in told


@for_all(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"rbxcompose_plan": 2}',
        '{"rbxcompose_plan": 1}',
        '{"rbxcompose_plan": 1, "robot": "x", "file": "y", "instances": [{}]}',
        '{"rbxcompose_plan": 1, "robot": "x", "file": "y", "instances": [{"type": "os.system", "config": {}}]}',
        '{"rbxcompose_plan": 1, "robot": "x", "file": "y", "instances": [], "nonsense": 1}',
        '{"rbxcompose_plan": 1, "robot": null, "file": "y", "instances": []}',
        '{"rbxcompose_plan": 1, "robot": "x", "file": 7, "instances": []}',
        "[" * 100_000,
        "9" * 100_000,
    ],
)
def test_another_text_is_no_plan(text: str) -> None:
    with pytest.raises(PlanTextError):
        load(text)


def places(data: Any) -> list[tuple[Any, Any]]:
    keys = data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ()
    return [place for key in keys for place in [(data, key), *places(data[key])]]


def test_a_plan_that_was_meddled_with_is_a_plan_or_is_refused(soak: Soak) -> None:
    text = dump(shipped(ROOT / "robots/turtlebot/robot.yaml"))
    for seed in range(soak.examples(50, 1_000)):
        source = random.Random(seed)
        data = json.loads(text)
        around, key = source.choice(places(data))
        around[key] = source.choice([None, [], {}, "x", -1, 1e300, [around[key]], {"x": around[key]}, True])
        try:
            assert isinstance(load(json.dumps(data)), Plan)
        except PlanTextError:
            continue
