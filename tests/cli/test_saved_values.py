"""Live values in the files of a robot: only they change, and the robot compiles to them."""

from __future__ import annotations

import difflib
import re
import shutil
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.config import Config
from rbxcompose.commands.console import NotDoneError
from rbxcompose.runtime.folder import NO_LAYERS, ChosenLayers, RobotState
from rbxcompose.runtime.processes import Process
from rbxcompose.sdk import Component, Live, component
from rbxcompose.sdk.parameters import settings
from rbxcompose.tools.live_rules import compiled_with
from rbxcompose.tools.parameters.files import LiveSettings, NewTexts, files_with, write
from tests.conftest import ROOT
from tests.soak import rare


class Axis(Config):
    p: Annotated[float, Live()] = 1.0
    i: Annotated[float, Live()] = 0.0


class GroupedConfig(Config):
    """Two groups of settings."""

    left: Axis = Axis()
    right: Axis = Axis()


@component("toy_grouped")
class Grouped(Component[GroupedConfig]):
    """Has settings in groups."""


GROUPED = """\
rbx: 1
kind: Robot
name: one
args:
  gain: {type: number, default: 2, max: 3}
components:
  arm:
    type: toy_grouped
    left:
      p: ${args.gain}
      # how it forgets
      i: 0.1   # slowly
  leg: {type: toy_grouped, left: {p: 3}}
"""
PART = """rbx: 1
kind: Part
name: legs
args:
  fast: {type: speed, default: 0.2 m/s}
  wide: {type: length, default: 5 cm}
components:
  go_to: {type: go_to, speed: "${args.fast}", tolerance: "${args.wide}"}
"""
ROBOT = """\
# A robot with one of everything.
rbx: 1
kind: Robot
name: one
args:
  speed: {type: speed, default: 0.3 m/s, max: 0.5 m/s}   # for all
  half: {type: angular_speed, default: 60 deg/s}
include:
  legs:
    part: legs.yaml
    with: {fast: "${args.speed}"}   # given
components:
  battery:
    type: battery_sim
    runtime: 45 s   # short

    warn: '50 %'
    # the last words
  base: {type: diff_drive_sim, max_speed: 0.5}
  second:
    type: battery_sim
    runtime: ${args.speed / 1 m/s * 100 s}
    connect: {battery_level: second/level, set_battery_level: second/set}
profiles:
  tired:
    components:
      battery:
        runtime: 1 min
"""
OVERLAY = """rbx: 1
kind: Overlay
name: over
components:
  battery: {warn: 40 %}
"""
NUMBERS = st.floats(0.01, 0.49).map(lambda one: float(f"{one:.4g}")) | st.floats(0.01, 0.49)


def state_of(folder: Path, layers: ChosenLayers) -> RobotState:
    nobody = Process(0, 0)
    return RobotState("one", str(folder / "robot.yaml"), nobody, {}, (), layers=layers)


def project(folder: Path, robot: str = ROBOT) -> None:
    for name, text in (("robot.yaml", robot), ("legs.yaml", PART), ("over.yaml", OVERLAY)):
        (folder / name).write_bytes(text.encode())


def live(state: RobotState, **values: Any) -> LiveSettings:
    """Return a robot that runs, with values such as `battery__runtime` that somebody has set."""
    found = compiled_with(state.file, state.layers)
    assert found.robot is not None
    assert found.plan is not None, list(found.report)
    now: dict[str, Config] = {name: robot_component.config for name, robot_component in found.robot.components.items()}
    for path, value in values.items():
        name, _, field = path.partition("__")
        now[name] = now[name].model_copy(update={field: value})
    return LiveSettings(found.robot, found.plan, found.sources, now)


def saved(folder: Path, layers: ChosenLayers = NO_LAYERS, **values: Any) -> Mapping[str, list[str]]:
    """Save values; return the changed lines of each file, after the robot was compiled again with the new values."""
    state = state_of(folder, layers)
    before = live(state, **values)
    texts = files_with(before, list(before.changes), partial(compiled_with, state.file, state.layers))
    write(texts)
    assert list(replace(live(state), now=before.now).changes) == []
    return {path.name: lines(texts, path) for path in texts.after}


def lines(texts: NewTexts, path: Path) -> list[str]:
    old, new = (each[path].decode().splitlines() for each in (texts.before, texts.after))
    return [one for one in difflib.ndiff(old, new) if one[0] in "-+"]


def test_each_value_is_written_at_its_place_and_every_other_byte_stays(tmp_path: Path) -> None:
    project(tmp_path)
    changed = saved(
        tmp_path, battery__runtime=30.0, battery__warn=0.6, battery__error=0.1, base__max_speed=0.4,
        base__acceleration=2.0, legs_go_to__tolerance=0.04, legs_go_to__turn_rate=0.5,
    )  # fmt: skip
    assert changed == {
        "robot.yaml": [
            '-     with: {fast: "${args.speed}"}   # given',
            '+     with: {fast: "${args.speed}", wide: 0.04 m}   # given',
            "-     runtime: 45 s   # short",
            "+     runtime: 30 s   # short",
            "-     warn: '50 %'",
            "+     warn: 60 %",
            "+     error: 10 %",
            "-   base: {type: diff_drive_sim, max_speed: 0.5}",
            "+   base: {type: diff_drive_sim, max_speed: 0.4, acceleration: 2 m/s^2}",
        ],
        "legs.yaml": [
            '-   go_to: {type: go_to, speed: "${args.fast}", tolerance: "${args.wide}"}',
            '+   go_to: {type: go_to, speed: "${args.fast}", tolerance: "${args.wide}", turn_rate: 0.5 rad/s}',
        ],
    }


def test_settings_in_groups_are_written_at_their_places(tmp_path: Path) -> None:
    project(tmp_path, GROUPED)
    arm, leg = GroupedConfig(left=Axis(p=2.5, i=0.2), right=Axis(p=4, i=5)), GroupedConfig(left=Axis(p=3, i=1))
    assert saved(tmp_path, arm__left=arm.left, arm__right=arm.right, leg__left=leg.left) == {
        "robot.yaml": [
            "-   gain: {type: number, default: 2, max: 3}",
            "+   gain: {type: number, default: 2.5, max: 3}",
            "+     right: {p: 4, i: 5}",
            "-       i: 0.1   # slowly",
            "+       i: 0.2   # slowly",
            "-   leg: {type: toy_grouped, left: {p: 3}}",
            "+   leg: {type: toy_grouped, left: {p: 3, i: 1}}",
        ]
    }


def test_the_limit_of_an_argument_holds_for_a_setting_in_a_group(tmp_path: Path) -> None:
    project(tmp_path, GROUPED)
    arm = live(state_of(tmp_path, NO_LAYERS)).robot.components["arm"]
    assert {name: bound.most for name, (bound,) in arm.bounds.items()} == {"left.p": 3.0}


@given(
    values=st.fixed_dictionaries(
        {},
        optional={
            "battery__runtime": NUMBERS,
            "battery__warn": NUMBERS.map(lambda one: one / 2 + 0.5),
            "battery__error": NUMBERS.map(lambda one: one / 2),
            "base__max_speed": NUMBERS.map(lambda one: one + 0.5),
            "base__turn_acceleration": NUMBERS,
            "legs_go_to__tolerance": NUMBERS,
        },
    ),
    newline=st.sampled_from(["\n", "\r\n"]),
    mark=st.sampled_from(["", "\ufeff"]),
    profile=st.booleans(),
    overlay=st.booleans(),
)
def test_a_saved_robot_has_the_live_values_and_a_line_for_each(
    tmp_path_factory: pytest.TempPathFactory,
    values: dict[str, float],
    newline: str,
    mark: str,
    profile: bool,
    overlay: bool,
) -> None:
    folder = tmp_path_factory.mktemp("saved")
    project(folder, mark + ROBOT.replace("\n", newline))
    layers = ChosenLayers(("tired",) if profile else (), (str(folder / "over.yaml"),) if overlay else ())
    changed = saved(folder, layers, **values)
    new = [line for file in changed.values() for line in file if line[0] == "+"]
    old = [line for file in changed.values() for line in file if line[0] == "-"]
    assert len(new) <= len(values)
    assert len(old) <= len(new)
    assert ("over.yaml" in changed) == (overlay and "battery__warn" in values)


REFUSED = [
    ({"second__runtime": 20.0}, (), "it is computed: '${args.speed / 1 m/s * 100 s}'"),
    ({"legs_go_to__speed": 0.2}, (), "'second.runtime' would change, too"),
    ({"battery__runtime": 20.0}, ("battery.runtime=30 s",), "it was given by '--set', which is in no file"),
]


@pytest.mark.parametrize(("values", "sets", "reason"), REFUSED, ids=[row[2] for row in REFUSED])
def test_what_no_file_can_say_alone_is_refused_and_nothing_is_written(
    tmp_path: Path, values: dict[str, float], sets: tuple[str, ...], reason: str
) -> None:
    project(tmp_path)
    with pytest.raises(NotDoneError, match=re.escape(reason)):
        saved(tmp_path, ChosenLayers(sets=sets), base__max_speed=0.4, **values)
    assert (tmp_path / "robot.yaml").read_text(encoding="utf-8") == ROBOT


def test_a_value_that_others_follow_without_being_written_is_saved(tmp_path: Path) -> None:
    project(tmp_path, ROBOT + "console: {}\n")
    state = state_of(tmp_path, ChosenLayers())
    before = live(state, base__max_speed=0.4)
    (text,) = files_with(before, list(before.changes), partial(compiled_with, state.file, state.layers)).after.values()
    assert b"base: {type: diff_drive_sim, max_speed: 0.4}" in text


def test_a_file_that_changes_before_it_is_written_stays(tmp_path: Path) -> None:
    project(tmp_path)
    state = state_of(tmp_path, ChosenLayers())
    before = live(state, battery__runtime=30.0)
    texts = files_with(before, list(before.changes), partial(compiled_with, state.file, state.layers))
    project(tmp_path, ROBOT.replace("45 s", "50 s"))
    with pytest.raises(NotDoneError, match="it has changed meanwhile"):
        write(texts)
    assert "runtime: 50 s" in (tmp_path / "robot.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("robot", ["turtlebot", *rare("rooms", "rover")])
def test_every_live_setting_of_shipped_robots_is_saved_in_one_line_or_refused(robot: str, tmp_path: Path) -> None:
    for name in ("robots", "missions"):
        shutil.copytree(ROOT / name, tmp_path / name)
    state = state_of(tmp_path / "robots" / robot, ChosenLayers())
    start = live(state)
    for name, config in start.now.items():
        for one in (setting for setting in settings(config).values() if setting.is_live):
            value = one.value * 0.9375 + 0.001 if isinstance(one.value, float) else one.value
            now = {**start.now, name: config.model_copy(update={one.name: value})}
            assert lines_or_code(replace(start, now=now), state) in (2, 1, "RBX9044")


def lines_or_code(live: LiveSettings, state: RobotState) -> int | str:
    try:
        texts = files_with(live, list(live.changes), partial(compiled_with, state.file, state.layers))
    except NotDoneError as error:
        return error.finding.code
    return sum(len(lines(texts, path)) for path in texts.after)


def test_a_setting_of_a_library_part_is_refused_with_its_cure(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "robots/rooms", tmp_path / "robots/rooms")
    shutil.copytree(ROOT / "missions", tmp_path / "missions")
    state = state_of(tmp_path / "robots/rooms", ChosenLayers())
    before = live(state, base_wheels__acceleration=0.5)
    with pytest.raises(NotDoneError) as refused:
        files_with(before, list(before.changes), partial(compiled_with, state.file, state.layers))
    assert "components: {base_wheels: {acceleration: ...}}" in refused.value.finding.help
    before = live(state, base_wheels__max_speed=0.6)
    with pytest.raises(NotDoneError, match="the part 'base' has its own default for the argument 'max_speed'"):
        files_with(before, list(before.changes), partial(compiled_with, state.file, state.layers))
