"""Mistakes round parts: told once, at their place, with the way to the file."""

from __future__ import annotations

import pytest

from rbxcompose.base.findings import Related
from tests.parts.project import BATTERY, Project

SPARE = "places: {dock: {x: 0 m, y: 0 m}}\ninclude:\n  spare: {part: ../../parts/battery.yaml, with: {runtime: 9 s}}\n"


def codes(project: Project) -> list[str]:
    return [finding.code for finding in project.findings]


def chain(related: tuple[Related, ...]) -> list[str]:
    return [f"{item.span.file}:{item.span.line} {item.message}" for item in related]


def test_a_finding_inside_a_part_tells_the_chain_of_includes(project: Project) -> None:
    arm = "include:\n  hand: battery.yaml\n"
    broken = BATTERY.replace("type: charger", "type: chargr")
    project.check("include:\n  arm: ../../parts/arm.yaml\n", {"arm": arm, "battery": broken})
    (finding,) = (candidate for candidate in project.findings if candidate.code == "RBX3004")
    assert str(finding.span) == "parts/battery.yaml:9:19"
    assert chain(finding.related) == [
        "parts/arm.yaml:5 included here as 'arm.hand'",
        "robots/one/robot.yaml:5 included here as 'arm'",
    ]


def test_a_mistake_of_a_part_with_two_instances_is_told_once(project: Project) -> None:
    robot = "include:\n  a: ../../parts/p.yaml\n  b: ../../parts/p.yaml\n"
    project.check(robot, {"p": "components:\n  base: {type: diff_drive_sim, max_sped: 1 m/s}\n"})
    assert codes(project).count("RBX1001") == 1


def test_a_part_that_cannot_be_read_hides_what_would_only_follow_from_it(project: Project) -> None:
    robot = SPARE + "components:\n  spare_battery: {warn: 40 %}\nvalues: {b: spare_battery.battery_level}\n"
    project.check(robot.replace("battery.yaml", "batery.yaml"), {"battery": BATTERY})
    (finding,) = project.findings
    assert (finding.code, finding.help) == ("RBX1301", "did you mean 'battery.yaml'?")


@pytest.mark.parametrize(
    ("files", "names"),
    [
        ({"a": "include: {again: a.yaml}\n"}, "parts/a.yaml -> parts/a.yaml"),
        (
            {"a": "include: {b: b.yaml}\n", "b": "include: {c: c.yaml}\n", "c": "include: {a: a.yaml}\n"},
            "parts/a.yaml -> parts/b.yaml -> parts/c.yaml -> parts/a.yaml",
        ),
    ],
)
def test_a_circle_is_named_whole(project: Project, files: dict[str, str], names: str) -> None:
    project.check("include:\n  first: ../../parts/a.yaml\n", files)
    (finding,) = project.findings
    assert finding.code == "RBX1308"
    assert finding.message == f"parts include each other in a circle: {names}"
    assert len([one for one in finding.related if "is included here" in one.message]) == len(files)


def test_parts_lie_at_most_16_deep(project: Project) -> None:
    files = {f"p{n}": f"include: {{n: p{n + 1}.yaml}}\n" for n in range(30)}
    project.check("include:\n  n: ../../parts/p0.yaml\n", files)
    (finding,) = project.findings
    assert (finding.code, finding.message) == ("RBX1103", "parts include each other more than 16 deep")


def test_parts_that_multiply_end_in_one_finding(project: Project) -> None:
    files = {f"p{n}": f"include: {{a: p{n + 1}.yaml, b: p{n + 1}.yaml}}\n" for n in range(10)}
    project.check("include:\n  n: ../../parts/p0.yaml\n", {**files, "p10": "components: {}\n"})
    assert {finding.message for finding in project.findings} == {"this robot has more than 500 instances of parts"}


def test_a_part_may_not_lead_out_of_the_project(project: Project) -> None:
    project.check("include:\n  p: ../../../elsewhere.yaml\n")
    assert codes(project) == ["RBX1306"]


MISTAKES = [
    ("spare: {part: ../../parts/battery.yaml, with: {runtme: 9 s}}", "RBX1001", "part 'spare' has no argument"),
    ("spare: {part: ../../parts/battery.yaml, with: {runtime: 9 m}}", "RBX1003", "'runtime' must be a time"),
    ("spare: {part: ../../parts/needy.yaml}", "RBX1206", "part 'spare' needs a value for its argument 'port'"),
    ("spare: {part: ../../parts/battery.yaml, conect: {}}", "RBX1001", "unknown key 'conect'"),
    ("spare: {part: robot.yaml}", "RBX1304", "this must name a file of kind Part"),
    ("spare: {with: {}}", "RBX1002", "part 'spare' needs the key 'part'"),
    ('spare: {part: "${args.x}"}', "RBX1003", "a part's file cannot use"),
    ("Spare: {part: ../../parts/battery.yaml}", "RBX1006", "'Spare' is not a valid name"),
    (
        "spare: {part: ../../parts/battery.yaml, connect: {batery_level: x}}",
        "RBX1309",
        "the part of the instance 'spare' has no topic 'batery_level'",
    ),
    ("spare: {part: ../../parts/started.yaml}", "RBX1001", "unknown key 'start' in this file"),
]


@pytest.mark.parametrize(("entry", "code", "message"), MISTAKES, ids=[mistake[2][:40] for mistake in MISTAKES])
def test_a_mistake_of_an_include_is_found(project: Project, entry: str, code: str, message: str) -> None:
    parts = {"battery": BATTERY, "needy": "args: {port: {type: text}}\n", "started": "start: tour\n"}
    project.check(f"places: {{dock: {{x: 0 m, y: 0 m}}}}\ninclude:\n  {entry}\n", parts)
    assert any(finding.code == code and finding.message.startswith(message) for finding in project.findings), (
        project.text
    )


def test_two_parts_that_bring_the_same_input_are_told_at_the_second(project: Project) -> None:
    robot = "include:\n  base: rbx:parts/base.yaml\n  a: rbx:parts/teleop.yaml\n  b: rbx:parts/teleop.yaml\n"
    project.check(robot)
    (finding,) = project.findings
    assert (finding.code, str(finding.span)) == ("RBX1307", "robots/one/robot.yaml:7:3")
    assert finding.message == "part 'b' and part 'a' both bring 'teleop' of mux 'cmd_vel'"
    assert [one.message for one in finding.related] == ["from part 'a'", "from part 'b'"]


def test_two_parts_whose_names_meet_are_told(project: Project) -> None:
    robot = "include:\n  a: ../../parts/one.yaml\n  a_b: ../../parts/two.yaml\n"
    text, two = "components: {b_c: {type: go_to}}\n", "components: {c: {type: go_to}}\n"
    project.check(robot, {"one": text, "two": two})
    (finding,) = project.findings
    assert finding.message == "part 'a_b' and part 'a' both bring 'a_b_c' of 'components'"


def test_a_misspelt_component_of_a_part_is_told_in_the_robot(project: Project) -> None:
    project.check(SPARE + "components:\n  spare_batery: {warn: 40 %}\n", {"battery": BATTERY})
    (finding,) = project.findings
    assert (finding.code, finding.help) == ("RBX1302", "did you mean 'spare_battery'?")


def test_a_fix_never_writes_a_name_of_the_robot_into_a_part(project: Project) -> None:
    part = (
        "components:\n  battery_sensor: {type: battery_sim, runtime: 9 s}\nvalues: {b: battery_senso.battery_level}\n"
    )
    project.check("include:\n  a: ../../parts/p.yaml\n", {"p": part})
    (finding,) = (
        candidate
        for candidate in project.findings
        if candidate.code == "RBX3009" or "battery_senso" in candidate.message
    )
    assert finding.fix is None


NEED = "needs: {ports: {cmd_vel: geometry_msgs/Twist}}\ncomponents: {go_to: {type: go_to}}\n"


@pytest.mark.parametrize(
    ("robot", "is_met"),
    [
        ("components: {base: {type: diff_drive_sim}}", True),
        ("components: {base: {type: diff_drive_sim, connect: {cmd_vel: x}}}", False),
        ("components: {other: {type: go_to, connect: {go_to: x}}}", False),  # writes as well: nobody listens
        ("components: {battery: {type: battery_sim, runtime: 9 s, connect: {battery_level: cmd_vel}}}", False),
    ],
)
def test_a_need_is_met_by_the_other_end_of_the_wire(project: Project, robot: str, is_met: bool) -> None:
    project.check(f"include: {{nav: ../../parts/nav.yaml}}\n{robot}\n", {"nav": NEED})
    assert ("RBX3021" in codes(project)) is not is_met


def test_what_a_part_provides_is_checked(project: Project) -> None:
    provides = "provides:\n  ports: {battery_level: std_msgs/Float32}\n  skills: [recharge]\n  values: [level]\n"
    part = BATTERY + "values: {level: battery.battery_level}\n"
    connected = SPARE.replace("}}\n", "}, connect: {recharge: charge_it, battery_level: x/level}}\n").replace(
        "{x: 0 m, y: 0 m}, connect: {recharge: charge_it, battery_level: x/level}}", "{x: 0 m, y: 0 m}}"
    )
    for robot in (SPARE, connected):
        project.check(robot, {"battery": part + provides})
        assert "RBX3022" not in codes(project), project.text
    broken = provides.replace("Float32", "Float64").replace("[recharge]", "[charge]").replace("[level]", "[volume]")
    project.check(SPARE, {"battery": part + broken})
    assert sorted(finding.message for finding in project.findings if finding.code == "RBX3022") == [
        "part 'spare' does not have the skill 'charge', which it says it provides",
        "part 'spare' does not have the topic 'battery_level' (std_msgs/Float64), which it says it provides",
        "part 'spare' does not have the value 'volume', which it says it provides",
    ]
