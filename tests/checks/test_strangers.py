"""Somebody else's components count as much as ours: with theirs, the corpus gives the same findings."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose.base.findings import Finding
from rbxcompose.commands.new_files import AnswerError
from rbxcompose.runtime.folder import Gauge
from rbxcompose.runtime.supervision.supervisor import gauges_of
from rbxcompose.sdk import Drains, Setting
from rbxcompose.testing import check_text
from rbxcompose.tools.scaffold import read_base, robot_files
from tests.checks import strangers
from tests.misconfig.corpus import Case, cases, run

# The codes of all rules that need to know what a component can do.
CODES = {
    *("RBX3001", "RBX3013", "RBX3014", "RBX3102", "RBX3501", "RBX3502", "RBX3503", "RBX3504", "RBX3505", "RBX3509"),
    "RBX3513",
    "RBX3514",
    *("RBX4120", "RBX4121", "RBX4122", "RBX4123", "RBX4124", "RBX4130", "RBX4160", "RBX4185"),
}
TYPES = {"battery_sim": "cell", "diff_drive_sim": "wheels", "go_to": "pilot", "charger": "filler"}
KEYS = {
    **{"runtime": "lasts", "warn": "yellow", "error": "red"},
    **{"max_speed": "fastest", "max_turn_rate": "spin", "command_timeout": "patience"},
    **{"speed": "pace", "turn_rate": "turn", "tolerance": "off_by", "dock": "station", "reach": "arm"},
    **{"cmd_vel": "velocity", "odom": "where", "tf": "frames", "go_to": "goals", "recharge": "fill_up"},
    "battery_level": "charge",
}
# Robots with our fields, ports or process groups outside of a component's own lines.
ELSEWHERE = {"anchors", "own_process_groups", "two_batteries"}
ELSEWHERE |= {"count_with_rates", "profile_that_swaps", "two_named_batteries"}
ELSEWHERE |= {
    "profile_chosen",
    "profile_not_chosen",
    "set_from_outside",
    "settings_that_fit",
    "charge_too_late/profile",
}
_KEY = re.compile(rf"^( +)({'|'.join(KEYS)}): (?=[^\s{{#])", re.MULTILINE)
_COMPONENTS = re.compile(r"^components:\n(?: .*\n|\n)*", re.MULTILINE)
_OURS = re.compile(rf"^  \w+:.*\n    type: (?:{'|'.join(TYPES)})\n(?:    .*\n)*", re.MULTILINE)


def strange(text: str) -> str:
    """Return a text with their components in the place of ours, line by line."""
    text = _COMPONENTS.sub(lambda section: _OURS.sub(lambda one: _strange_component(one[0]), section[0]), text)
    text = text.replace("battery.battery_level", "battery.charge").replace("go_to.cmd_vel", "go_to.velocity")
    text = re.sub(r"\bgo_to: (?=[^\s#])", "take_to: ", text)
    return re.sub(r"\brecharge\b", "fill_up", text)


def _strange_component(text: str) -> str:
    for ours, theirs in TYPES.items():
        text = re.sub(rf"type: {ours}$", f"type: toy_{theirs}", text, flags=re.MULTILINE)
    return _KEY.sub(lambda found: f"{found[1]}{KEYS[found[2]]}: ", text)


def concerned() -> list[Case]:
    there = [case for case in cases() if case.name not in ELSEWHERE]
    return [case for case in there if not case.kind or CODES & {code for _, _, code in case.expected}]


def tried() -> list[Case]:
    """Return the first of the cases of each kind for each code, which is enough to try each rule."""
    found = {(case.kind, tuple(sorted({code for _, _, code in case.expected}))): case for case in concerned()[::-1]}
    return list(found.values())


@pytest.mark.timeout(200)
def test_a_strangers_robot_gets_the_findings_of_ours(tmp_path: Path) -> None:
    other: dict[str, object] = {}
    for case in tried():
        theirs = replace(case, files={name: strange(text) for name, text in case.files.items()})
        found, ours = (run(robot, tmp_path / who / case.name).found for who, robot in (("a", theirs), ("b", case)))
        other |= {case.name: (found, ours)} if found != ours else {}
    assert other == {}


def test_each_rule_is_tried_on_a_strangers_robot() -> None:
    changed = [case for case in tried() if any("toy_" in strange(text) for text in case.files.values())]
    assert {code for case in changed for _, _, code in case.expected} >= CODES


HEAD = "rbx: 1\nkind: Robot\nname: strange\n"


def found(components: str, folder: Path) -> list[Finding]:
    return list(check_text(f"{HEAD}components:\n{components}", folder).compilation.report)


def test_findings_name_the_strangers_own_settings(tmp_path: Path) -> None:
    [finding] = found("  base: {type: toy_wheels}\n  pilot:\n    type: toy_pilot\n    pace: 0.9 m/s\n", tmp_path)
    assert finding.help == "make 'pace' of 'pilot' at most 0.5 m/s"
    assert [one.message for one in finding.related] == ["'fastest' of the base"]
    [finding] = found("  base: {type: toy_wheels}\n  pilot:\n    type: toy_pilot\n    push: 2 m/s^2\n", tmp_path)
    assert finding.message == "'pilot' accelerates and brakes by 2 m/s^2, but its base 'base' can do 1 m/s^2 at most"
    assert finding.help == "make 'push' of 'pilot' at most 1 m/s^2"


def test_what_is_fixed_is_told_at_the_type(tmp_path: Path) -> None:
    text = "  base:\n    type: toy_fixed_wheels\n  pilot:\n    type: toy_fixed_pilot\n"
    [braking] = found(text, tmp_path)  # an error, with which no warning is told
    assert (braking.code, braking.span and braking.span.line, braking.help) == (
        "RBX3501",
        6,
        "take another type for one of them",
    )
    text = "  base: {type: toy_wheels}\n  pilot:\n    type: toy_fixed_pilot\n"
    [fast] = found(text, tmp_path)
    assert (fast.code, fast.span and fast.span.line) == ("RBX3503", 7)
    assert fast.help == "make 'fastest' of 'base' at least 1 m/s"


def test_how_far_above_its_limits_a_base_drops_commands_is_its_own_affair(tmp_path: Path) -> None:
    text = "  base: {{type: toy_fixed_wheels}}\n  pilot: {{type: toy_pilot, pace: {}}}\n"
    assert {finding.code for finding in found(text.format("1.4 m/s"), tmp_path)} == {"RBX3501"}
    told = [finding.message for finding in found(text.format("1.6 m/s"), tmp_path) if finding.code == "RBX3504"]
    assert told == ["'pilot' drives at 1.6 m/s, but its base 'base' drops commands above 3 times its limit of 0.5 m/s"]


def test_commands_are_followed_through_a_strangers_mux(tmp_path: Path) -> None:
    text = (
        "  base: {type: toy_wheels}\n  selector: {type: toy_selector}\n"
        "  pilot: {type: toy_pilot, pace: 0.9 m/s, connect: {velocity: selected}}\n"
    )
    assert [finding.code for finding in found(text, tmp_path)] == ["RBX3503"]
    [past] = found(text + "  spare: {type: toy_wheels, connect: {velocity: selected, frames: spare/tf}}\n", tmp_path)
    assert (past.code, past.help) == ("RBX3102", "subscribe to the mux's output: 'velocity: cmd_vel'")


def test_a_frame_that_can_be_set_is_told_where_it_is_set(tmp_path: Path) -> None:
    base = "  base: {type: toy_wheels}\n  trailer:\n    type: toy_wheels\n    connect: {velocity: hitch}\n"
    selector = "  selector: {type: toy_selector, connect: {give: hitch}}\n  pilot: {type: toy_pilot}\n"
    [finding] = found(f"{selector}{base}    body: base_footprint\n", tmp_path)
    assert (finding.code, finding.span and finding.span.line) == ("RBX3014", 11)
    assert found(f"{selector}{base}    body: trailer\n", tmp_path) == []


def test_the_frame_of_what_a_stranger_sees_is_known(tmp_path: Path) -> None:
    text = "  base: {{type: toy_wheels}}\n  seer: {{type: toy_seer}}\n  follow: {{type: tag_follower, frame: {}}}\n"
    [finding] = found(text.format("base_footprint"), tmp_path)
    assert (finding.code, finding.help) == ("RBX2026", "write 'frame: odom'")
    assert found(text.format("odom"), tmp_path) == []


def test_the_battery_of_a_stranger_has_a_gauge(tmp_path: Path) -> None:
    plan = check_text(f"{HEAD}components:\n  cell: {{type: toy_cell, lasts: 1 h}}\n", tmp_path).plan
    assert gauges_of(plan) == {"cell": Gauge("/soc", "std_msgs/msg/Float32", "%")}


def test_a_new_robot_may_have_a_strangers_base() -> None:
    text = robot_files("cart", base=read_base("toy_wheels"))["robots/cart/robot.yaml"]
    assert "    type: toy_wheels\n    fastest: 0.5 m/s\n    spin: 90 deg/s\n    patience: 0.5 s\n" in text
    with pytest.raises(AnswerError, match="does not follow 'cmd_vel'"):
        read_base("toy_pilot")


def muxed(mux: str) -> str:
    there = "  base: {type: toy_wheels, connect: {velocity: go}}\n  reflex: {type: toy_reflex}\n"
    return f"{there}muxes:\n  go: {mux}\n"


@pytest.mark.parametrize(
    ("mux", "codes"),
    [
        ("{inputs: {me: {priority: 5, timeout: 1 s}, flee: {from: reflex, priority: 9, timeout: 1 s}}}", []),
        ("{inputs: {me: {priority: 9, timeout: 1 s}, flee: {from: reflex, priority: 5, timeout: 1 s}}}", ["RBX3142"]),
        ("{mode: latest, inputs: {me: {timeout: 1 s}, flee: {from: reflex, timeout: 1 s}}}", ["RBX3142"]),
        (
            "{inputs: {me: {priority: 5, timeout: 1 s}, flee: {from: reflex, priority: 9, timeout: 1 s}},"
            " locks: {door: {priority: 7, timeout: 1 s}}}",
            [],
        ),
    ],
)
def test_nobody_overrules_what_protects_a_strangers_robot(mux: str, codes: list[str], tmp_path: Path) -> None:
    assert [finding.code for finding in found(muxed(mux), tmp_path)] == codes


@pytest.mark.parametrize(
    ("capability", "told"),
    [
        (Drains("level"), "the capability Drains of the type 'toy_wrong' names the port 'level', which it does not"),
        (Drains("port", Setting(1.0, "life")), "names the field 'life', which its configuration does not have"),
    ],
)
def test_a_capability_of_what_is_not_there_is_an_error_of_its_author(
    capability: Drains, told: str, tmp_path: Path
) -> None:
    thing = strangers.declaring("toy_wrong", capability)
    with pytest.raises(ValueError, match=told):
        found(f"  one: {{type: {thing.type_name}}}\n", tmp_path)


@pytest.mark.parametrize(
    ("setting", "code"),
    [
        ("track: 40 cm", "RBX2281"),
        ("size: 5 cm", "RBX2281"),
        ("port_wheel: r_wheel_joint", "RBX2282"),
        ("fastest: 2 m/s", "RBX2283"),
    ],
)
def test_a_strangers_wheels_are_compared_with_those_of_the_body(setting: str, code: str, tmp_path: Path) -> None:
    other = "\n    starboard_wheel: l_wheel_joint" if setting.startswith("port") else ""
    text = (
        f"{HEAD}body: {{xacro: rbx:parts/body/box_base.urdf.xacro}}\ninclude: {{teleop: rbx:parts/teleop.yaml}}\n"
        f"components:\n  base:\n    type: toy_rollers\n    {setting}{other}\n"
    )
    [finding] = check_text(text, tmp_path).compilation.report
    assert (finding.code, finding.span and finding.span.line) == (code, 9)
