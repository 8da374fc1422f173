"""What is said to somebody who wrote one wrong thing in a mission: each finding names the cure."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

from rbxcompose.testing.manifests import check_text
from tests.loops import for_all
from tests.misconfig.corpus import HERE, VALUES

ROBOT = (HERE / "robot.yaml").read_text(encoding="utf-8") + VALUES
HEAD = "rbx: 1\nkind: Mission\nname: work\n"
OUTCOMES = """\
do:
  parallel:
    drive: {go_to: kitchen}
    watch: {wait_for: $battery < 20 %}
  succeed_when: any
  outcomes:
    done: $drive == never
    low: $watch == too_low
    other: otherwise
"""
PLACE = "declare 'NAME: {x: 1 m, y: 20 cm, heading: 90 deg}' under 'places' of the robot, and write its name"

CURES = [
    (
        "do: {for: guest, in: [anna, bob], do: {log: $guest}}",
        ["a text needs quotes: write '\"anna\"'; places: ", "a text needs quotes: write '\"bob\"'; places: "],
    ),
    ("do: {for: room, in: [dock, kitchn], do: {go_to: $room}}", ["did you mean 'kitchen'?"]),
    (
        "do: {for: guest, in: [anna, uncle bob], do: {log: $guest}}",
        ["a text needs quotes: write '\"anna\"'", "a text needs quotes: write '\"uncle bob\"'"],
    ),
    (
        "do: {for: room, in: [a, b], do: {go_to: $room}}",
        ["places: dock, kitchen, window", "places: dock, kitchen, window"],
    ),
    ("do: {for: room, in: [a], do: [{log: $room}, {go_to: {pose: $room}}]}", ["places: dock, kitchen, window"]),
    ("do: {for: room, in: [a], do: [{log: $room}, {go_to: dock}]}", ["a text needs quotes: write '\"a\"'; places: "]),
    ("data: {n: 0}\ndo: {set: {n: $n $n}}", [""]),
    ("do: {wait: five seconds}", [""]),
    (OUTCOMES, ["it ends with success or failure", "it ends with success"]),
    (
        "do: {go_to: {pose: {header: {frame_id: odom}, pose: {position: {x: 1, y: 0.2}}}}}",
        ["there are no poses in 'odom', all are in 'map': declare 'NAME: {x: 1 m, y: 0.2 m}' under 'places' of the "],
    ),
    ("do: {go_to: {x: 1 m, y: 20 cm, heading: 90 deg}}", [PLACE]),
    ("do: {go_to: {pose: {x: 1 m, y: 20 cm, heading: 90 deg}}}", [PLACE]),
    ("do: {go_to: {x: 1, y: 20cm, heading: 90}}", [PLACE]),  # no heading is 90 rad
    ("do: {go_to: {x: 1 metre, y: 20 cm, heading: 90°}}", [PLACE]),
    ("do: {go_to: {x: 1, y: 2, heading: 1.5}}", ["declare 'NAME: {x: 1 m, y: 2 m, heading: 1.5 rad}' under 'places'"]),
    ("do: {go_to: [1, 2]}", ["declare 'NAME: {x: 1 m, y: 2 m}' under 'places' of the robot, and write its name"]),
    ("do: {go_to: {pose: {frame: map}}}", ["declare a place under 'places' of the robot, and write its name"]),
    ("do: {go_to: {plce: dock}}", ["its arguments: pose, behavior_tree"]),
    ("do: {selector: [recharge]}", ["did you mean 'fallback'?"]),
    ("do: {parallel: [recharge, {wait: 1 s}], success_threshold: 1}", ["did you mean 'succeed_when'?"]),
    (
        "do: {set_battery_level: {data: 1}}",
        ["it is a service: write 'call: set_battery_level', and below it 'request: "],
    ),
    (
        "do: {cmd_vel/teleop: {linear: {x: 1}}}",
        ["it is a topic: write 'publish: cmd_vel/teleop', and below it 'messag"],
    ),
    (
        "do: /set_battery_level",
        ["it is a service: write 'call: /set_battery_level', and below it 'request: ...' if it"],
    ),
    ("do: [recharge, {timeout: 5 s}]", ["'timeout' is a setting of a step: write 'timeout: 5 s' without a dash"]),
    ("do: {repeat: -1, do: recharge}", ["write 'forever'"]),
    ("do: {for: a, in: range(3), do: recharge}", ["to do something a number of times, write 'repeat: 3'"]),
    ("do: {for: a, in: 3, do: recharge}", ["to do it 3 times, write 'repeat: 3'"]),
    ("do: {go_to: [dock, kitchen]}", ["to do it for each: 'for: one', 'in: [dock, kitchen]', 'do: {go_to: $one}'"]),
    ("do: {go_to: [dock]}", ["write 'go_to: dock', without brackets"]),
    ("do: {recharge: dock}", ["it has no arguments: write 'recharge:' with nothing behind it"]),
    ("do: {sequence: [recharge, recharge], history: always}", ["it can be: none, last, deep"]),
    ("do: {go: to the dock}", ["write 'go_to: dock'"]),
    ("do: {GO_TO: dock}", ["did you mean 'go_to'?"]),
    ("do: [wait for 5 s]", ["write 'wait: 5 s'"]),
    ("do: {sya: hello}", ["did you mean 'say'?"]),
    ("do: {wait: 5 metres}", ["units of a time: s, "]),
    ("do: {wait: 5 mins}", ["did you mean 'min'?"]),
    ("do: {wait: 5 m}", ["if these are minutes, write '5 min'"]),
    ("data: {least: 30}\ndo: {wait_for: $battery > $least}", ["give 'least' a unit where it is declared, such as"]),
    ("do: {use: tour}", ["list it under 'missions' of the robot, 'tour: FILE', or use one of them: work"]),
    ("do: {publish: cmd_vel/teleop, message: {linear: 0.2}}", ["write '{x: 0.2}'; its fields are x, y, z"]),
    ("do: {publish: cmd_vel/teleop, message: {linear: {x: 0.2 m}}}", ["write a speed, such as '0.3 m/s'"]),
    (
        "do:\n  - {for: a, in: [dock], do: {go_to: $a}, save: tour}\n  - {log: x, only_if: count($tour.errors) > 0}",
        ["entries: done, failed"],
    ),
    (
        "interrupts: {low: {when: $battery < 20 %, do: {go_to: $a}}}\ndo: {for: a, in: [dock], do: {go_to: $a}}",
        ["'$a' is known in its loop only: keep it there by 'set' in a datum, and read that"],
    ),
    (
        "data: {last: 0}\ndo:\n  - {set: {last: kitchen}}\n  - {log: $last}",
        ["a datum keeps the type of its first value: give 'last' one of this type under 'data'"],
    ),
    ("inputs: {room: {type: place}}\ndo: {go_to: '{room}'}", ["write '$room'"]),
    ("do: [{recharge: {}, save: got}, {check: $got.failed == 0}]", ["entries: "]),
    ("do: {yard/dust: dock}", ["a robot 'yard' of the system must share 'dust', and name this robot below 'callers'"]),
    (
        "do: [{parallel: {a: recharge, b: {repeat: forever, do: {wait: 1 s}}}, ends_with: b}, recharge]",
        ["name the branch that ends"],
    ),
    ('data: {l: []}\ndo: {set: {l: [3, dock, "a"]}}', ["put it in quotes: '[3, dock, \"a\"]'"]),
    ("data: {l: []}\ndo: {set: {l: [[3], 2]}}", ["put it in quotes: '[..., 2]'"]),
    ("data: {m: {}}\ndo: {set: {m: {a: 3}}}", ["give it a name under 'data', and write that: '$name'"]),
    ("do: {run: foo}", ["write it under 'data', and its name here, such as '$chore'"]),
    ("do: [{recharge now}]", ["inside {}, each key needs a value: 'key: value'", "write 'recharge: now'"]),
    ("do: [{log: Here I am, and now}]", ["inside {} and [] a comma ends a text: put quotes around the whole text"]),
    ("do: {wait: $(arg time)}", ["write '$time', and declare 'time' under 'inputs'"]),
    (
        "data: {got: 0}\ndo:\n  - {recharge: {}, save: got}\n  - check: $got > 1",
        ["write 'got: {}' under 'data', and read an entry of it as '$got.NAME'; or save it under another name"],
    ),
]


@for_all("text, cures", CURES)
def test_every_finding_about_a_mission_tells_the_cure(text: str, cures: list[str], tmp_path: Path) -> None:
    checked = check_text(ROBOT, tmp_path, others={"mission.yaml": HEAD + dedent(text)})
    found = [one for one in checked.compilation.report if one.span and one.span.file.endswith("mission.yaml")]
    assert len(found) == len(cures), found
    for finding, cure in zip(found, cures, strict=True):
        assert finding.help.startswith(cure)
        assert bool(finding.help) == bool(cure)


@for_all("arguments, is_one", [("{room: dock}", True), ("{room: dock, floor: dock}", False)])
def test_one_unknown_argument_may_be_meant_as_the_main_one(arguments: str, *, is_one: bool, tmp_path: Path) -> None:
    checked = check_text(ROBOT, tmp_path, others={"mission.yaml": f"{HEAD}do: {{go_to: {arguments}}}"})
    found = [finding for finding in checked.compilation.report if finding.code == "RBX4105"]
    assert ["write 'go_to: dock'" in finding.help for finding in found] == ([True] if is_one else [False, False])


def test_what_was_saved_is_a_map_so_it_is_no_number(tmp_path: Path) -> None:
    text = f"{HEAD}do:\n  - {{recharge: {{}}, save: got}}\n  - check: $got > 1\n  - check: $got.level > 1\n"
    (finding,) = (
        candidate for candidate in check_text(ROBOT, tmp_path, others={"mission.yaml": text}).compilation.report
    )
    assert (finding.code, finding.message) == ("RBX4106", "this must be a number; it is a map")
    assert finding.help == "read an entry of it: '$got.NAME'"
