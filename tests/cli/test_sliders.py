"""Sliders for joints: what keys do, what is shown, and that no position leaves its range."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.printable import columns
from rbxcompose.domains.body.command_pose import Slider, SliderPanel, bar, is_end, sliders_of, split_keys
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from rbxcompose.testing.golden import Golden
from tests.loops import for_all

JOINT = '<joint name="{name}" type="{kind}"><parent link="base"/><child link="{name}_link"/>{more}</joint>'
LIMIT = '<limit lower="{0}" upper="{1}" effort="1" velocity="1"/>'
JOINTS = (
    ("head_pan_joint", "revolute", LIMIT.format(-2.5, 2.5)),
    ("wheel", "continuous", LIMIT.format(0, 0)),
    ("lift", "prismatic", LIMIT.format(0.1, 0.4)),
    ("follower", "revolute", LIMIT.format(-1, 1) + '<mimic joint="lift"/>'),
    ("mount", "fixed", ""),
)
UP, DOWN, RIGHT, LEFT, FAR_RIGHT, FAR_LEFT = "\x1b[A", "\x1b[B", "\x1b[C", "\x1b[D", "\x1b[1;2C", "\x1b[6~"
KEYS = [UP, DOWN, RIGHT, LEFT, FAR_RIGHT, FAR_LEFT, "0", "c", "r", "Z", "C", "R", "x", "\x1bOC"]


def sliders() -> list[Slider]:
    links = "".join(f'<link name="{name}_link"/>' for name, _, _ in JOINTS)
    joints = "".join(JOINT.format(name=name, kind=kind, more=more) for name, kind, more in JOINTS)
    root = read_urdf(f'<robot name="r"><link name="base"/>{links}{joints}</robot>', "r.urdf")
    assert isinstance(root, XmlElement)
    body, findings = read_body(root)
    assert findings == []
    return sliders_of(body)


def panel() -> SliderPanel:
    return SliderPanel(sliders(), lambda lower, upper: lower + (upper - lower) / 4)


def test_joints_that_move_by_themselves_have_sliders_over_their_range() -> None:
    assert [(slider.name, slider.lower, slider.upper) for slider in sliders()] == [
        ("head_pan_joint", -2.5, 2.5),
        ("wheel", -math.pi, math.pi),
        ("lift", 0.1, 0.4),
    ]
    assert panel().positions == {"head_pan_joint": 0.0, "wheel": 0.0, "lift": 0.1}


@for_all(
    "keys, joint, position",
    [
        ([RIGHT], "head_pan_joint", math.radians(1)),
        ([LEFT, FAR_LEFT], "head_pan_joint", math.radians(-11)),
        (["r"], "head_pan_joint", -1.25),
        (["r", "0"], "head_pan_joint", 0.0),
        ([UP, RIGHT], "lift", 0.11),
        ([DOWN, DOWN, FAR_RIGHT], "lift", 0.2),
        ([UP, "c"], "lift", 0.25),
        ([UP, "c", "0"], "lift", 0.1),
        (["C"], "lift", 0.25),
        (["R"], "lift", 0.175),
        (["R", "Z"], "lift", 0.1),
        ([UP, *[FAR_RIGHT] * 9], "lift", 0.4),
    ],
)
def test_a_key_moves_a_joint(keys: list[str], joint: str, position: float) -> None:
    shown = panel()
    for key in keys:
        shown.press(key)
    assert shown.positions[joint] == pytest.approx(position)


@given(st.lists(st.sampled_from(KEYS), max_size=40))
def test_whatever_is_pressed_no_joint_leaves_its_range(keys: list[str]) -> None:
    shown = panel()
    for key in keys:
        before = dict(shown.positions)
        assert shown.press(key) == (shown.positions != before)
    assert all(slider.lower <= shown.positions[slider.name] <= slider.upper for slider in shown.sliders)


@given(st.lists(st.sampled_from(KEYS), max_size=10), st.integers(0, 30))
def test_keys_that_arrive_in_pieces_are_the_same_keys(keys: list[str], cut: int) -> None:
    text = "".join(keys)
    first, rest = split_keys(text[:cut])
    second, left = split_keys(rest + text[cut:])
    assert (first + second, left) == (keys, "")


def test_an_unknown_key_of_several_characters_is_none_of_its_characters() -> None:
    assert split_keys("\x1b[1;5Cq\x1b") == (["\x1b[1;5C", "q"], "\x1b")
    assert [key for key in ("q", "\x04", "0", UP) if is_end(key)] == ["q", "\x04"]


@given(st.integers(0, 12), st.integers(1, 12), st.integers(30, 120))
def test_the_selected_joint_is_always_shown_and_the_screen_is_enough(steps: int, height: int, width: int) -> None:
    many = SliderPanel([Slider(f"joint_{number}", True, -1.0, 1.0, 0.0) for number in range(9)], min)
    for _ in range(steps):
        many.press(DOWN)
    lines = many.lines("robot", width, height)
    assert len(lines) <= height
    assert all(columns(line) <= width for line in lines)
    assert height < 6 or any(line.startswith(f"> {many.selected}") for line in lines)


@given(st.floats(-3.0, 3.0), st.integers(8, 60))
def test_the_bar_shows_where_a_position_is(at: float, width: int) -> None:
    shown = bar(Slider("a", True, -2.0, 2.0, 0.0), at, width)
    assert (len(shown), shown.count("#")) == (width, 1)
    assert abs((shown.index("#") - 1) / (width - 3) * 4 - 2 - min(max(at, -2.0), 2.0)) <= 4 / (width - 3)


def test_the_screen_reads_well(golden: Golden) -> None:
    shown = panel()
    for key in ("r", DOWN, FAR_RIGHT, RIGHT):
        shown.press(key)
    golden.check("sliders.txt", "".join(f"{line}\n" for line in shown.lines("/joint_states", 80, 24)))


@pytest.mark.parametrize(
    ("text", "position"), [("0.6", 0.6), ("-35 deg", math.radians(-35)), ("35deg", math.radians(35)), ("0.5 rad", 0.5)]
)
def test_a_position_is_read_with_its_unit(text: str, position: float) -> None:
    assert sliders()[0].read(text) == pytest.approx(position)
    assert sliders()[2].read("15 cm") == sliders()[2].read("0.15") == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("5 cm", "must be an angle, such as '90 deg', not a length"),
        ("3", "must be between -143.2 deg and 143.2 deg"),
        ("up", "not a number with a unit"),
        ("nan", "not a number with a unit"),
    ],
)
def test_a_wrong_position_is_told(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        sliders()[0].read(text)


def test_sliders_begin_where_the_joints_are_as_far_as_that_is_known() -> None:
    there = SliderPanel(sliders(), min, {sliders()[0].name: 0.2, "another": 3.0}).positions
    assert there == {
        slider.name: slider.within(0.2) if index == 0 else slider.rest for index, slider in enumerate(sliders())
    }
