"""Overlay files, profiles that nobody chose, and where each value came from."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Report
from rbxcompose.base.units import ANGLE, LENGTH, RATIO, SPEED, TIME, Dimension, to_si
from rbxcompose.commands.main import main
from rbxcompose.compiler.composition.dump import dump_robot
from rbxcompose.manifest.fill import Names, fill
from rbxcompose.manifest.shapes import exact
from rbxcompose.manifest.tree import NOWHERE, Entry, MappingNode, ScalarNode
from tests.parts.project import BATTERY, Project

ROBOT = """\
components:
  battery: {type: battery_sim, runtime: 45 s}
values: {battery: battery.battery_level}
profiles:
  tired:
    components:
      battery: {runtime: 30 s}
"""
OVERLAY = "rbx: 1\nkind: Overlay\nname: outdoor\nabout: For the garden.\n"


def runtime(project: Project) -> object:
    config = project.manifest.components["battery"].config
    return config.model_dump()["runtime"] if config else None


def test_overlays_come_after_profiles_in_their_order_and_before_sets(project: Project) -> None:
    files = {f"{n}.yaml": OVERLAY + f"components:\n  battery: {{runtime: {n} s}}\n" for n in (1, 2)}

    def chosen(**layers: list[str]) -> object:
        project.check(ROBOT, files=files, **layers)  # type: ignore[arg-type]
        assert project.findings == [], project.text
        return runtime(project)

    assert chosen(profiles=["tired"]) == 30.0
    assert chosen(profiles=["tired"], overlays=["1.yaml", "2.yaml"]) == 2.0
    assert chosen(overlays=["2.yaml", "1.yaml"]) == 1.0
    assert chosen(overlays=["2.yaml"], sets=["battery.runtime=5 s"]) == 5.0


def test_an_overlay_keeps_the_name_of_the_robot(project: Project) -> None:
    project.check(ROBOT, files={"o.yaml": OVERLAY}, overlays=["o.yaml"])
    assert (project.manifest.name, project.manifest.about) == ("one", "")


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("components:\n  batery: {runtime: 1 s}\n", "RBX1302", "overlay 'o.yaml' changes the component 'batery'"),
        ("profiles: {}\n", "RBX1001", "unknown key 'profiles' in this file"),
        ("places: !remove\n", "RBX1302", "overlay 'o.yaml' removes 'places', which does not exist"),
    ],
)
def test_a_mistake_of_an_overlay_is_told_in_its_file(project: Project, text: str, code: str, message: str) -> None:
    project.check(ROBOT, files={"o.yaml": OVERLAY + text}, overlays=["o.yaml"])
    (finding,) = project.findings
    assert finding.span
    assert (finding.code, finding.span.file, finding.message.startswith(message)) == (code, "o.yaml", True)


def test_what_is_no_overlay_cannot_be_laid_over_a_robot(project: Project) -> None:
    project.check(ROBOT, overlays=["robots/one/robot.yaml", "nothing.yaml"])
    assert [finding.code for finding in project.findings] == ["RBX1301", "RBX1304"]


def test_the_commands_take_overlays(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    project.check(ROBOT, files={"o.yaml": OVERLAY + "components:\n  battery: {runtime: long}\n"})
    for verb in ("check", "up"):
        assert main([verb, "robots/one", "-f", "o.yaml"]) == 1
        told = capsys.readouterr()
        assert "o.yaml:6:22" in told.out + told.err


def test_a_broken_profile_is_found_before_it_is_used(project: Project) -> None:
    project.check(ROBOT.replace("runtime: 30 s", "runtme: 30 s"))
    (finding,) = project.findings
    assert (finding.code, str(finding.span)) == ("RBX1001", "robots/one/robot.yaml:10:17")


def test_a_profile_that_breaks_something_else_is_told_with_the_profile(project: Project) -> None:
    project.check(ROBOT.replace("battery: {runtime: 30 s}", "battery: !remove"))
    (finding,) = project.findings
    assert (finding.code, str(finding.span)) == ("RBX1310", "robots/one/robot.yaml:10:7")
    assert [str(one.span) for one in finding.related] == ["robots/one/robot.yaml:6:19"]


def test_a_warning_that_only_a_profile_causes_is_told_where_the_profile_causes_it(project: Project) -> None:
    robot = ROBOT.replace("battery: {runtime: 30 s}", "base: {connect: {cmd_vel: nobody}}")
    driving = "components:\n  base: {type: diff_drive_sim}\n  go_to: {type: go_to}"
    project.check(robot.replace("components:", driving, 1))
    (finding,) = project.findings
    assert (finding.code, str(finding.span)) == ("RBX3011", "robots/one/robot.yaml:12:24")
    assert str(finding.related[0].span) == "robots/one/robot.yaml:6:3"


def test_profiles_that_were_not_chosen_say_nothing_of_overlays_and_sets(project: Project) -> None:
    robot = ROBOT.replace("battery: {runtime: 30 s}", "battery: !remove").replace("values:", "about:")
    overlay = OVERLAY + "components:\n  battery: {warn: 40 %}\n"
    project.check(robot, files={"o.yaml": overlay}, overlays=["o.yaml"], sets=["battery.error=10 %"])
    assert [finding.code for finding in project.findings if finding.code == "RBX1302"] == []


def steps(project: Project, *path: str) -> list[str]:
    return [f"{step.layer} {step.span}" for step in project.manifest.history.of(path)]


def test_every_value_knows_the_layers_that_it_won_over(project: Project) -> None:
    robot = (
        "places: {dock: {x: 0 m, y: 0 m}}\n"
        "include:\n  spare: ../../parts/battery.yaml\n"
        "components:\n  spare_battery: {warn: 40 %, runtime: 9 s}\n"
        "profiles:\n  tired:\n    components:\n      spare_battery: {runtime: 8 s}\n"
    )
    overlay = OVERLAY + "components:\n  spare_battery: !replace\n    type: battery_sim\n    runtime: 7 s\n"
    project.check(
        robot,
        {"battery": BATTERY},
        files={"o.yaml": overlay},
        profiles=["tired"],
        overlays=["o.yaml"],
        sets=["spare_battery.runtime=6 s"],
    )
    assert steps(project, "components", "spare_battery", "runtime") == [
        "part 'spare' parts/battery.yaml:8:41",
        "the robot robots/one/robot.yaml:8:40",
        "profile 'tired' robots/one/robot.yaml:12:32",
        "overlay 'o.yaml' o.yaml:8:14",
        "'--set' --set:1:23",
    ]
    warn = project.manifest.history.of(("components", "spare_battery", "warn"))
    assert [(step.layer, step.node is None) for step in warn] == [("the robot", False), ("overlay 'o.yaml'", True)]
    assert project.manifest.history.layer(("components", "spare_charger", "dock")) == "part 'spare'"
    assert steps(project, "places", "dock", "x") == ["the robot robots/one/robot.yaml:4:20"]
    assert steps(project, "nothing", "there") == []


def test_what_is_put_together_is_the_same_robot_when_it_is_read_again(project: Project) -> None:
    robot = (
        'about: "costs $$5: #1"\n'
        "args: {share: {type: ratio, default: 7 %}, name: {type: text, default: '30 %'}}\n"
        'places: {dock: {x: 0.1 m, y: 0 m, heading: 33 deg, colour: "${env.COLOUR}"}}\n'
        "include:\n  spare: {part: ../../parts/battery.yaml, with: {runtime: 0.7 min}}\n"
        'components:\n  spare_battery: {warn: "${args.share * 6}"}\n'
        "missions:\n  tour:\n    file: ../../tour.yaml\n"
        '    with: {share: "${args.share / 3}", text: "${args.name}", n: 3}\n'
    )
    tour = (
        "rbx: 1\nkind: Mission\nname: tour\n"
        "inputs: {share: {type: ratio}, text: {type: text}, n: {type: count}}\ndo:\n  log: $text $share $n\n"
    )
    project.check(robot, {"battery": BATTERY}, files={"tour.yaml": tour}, environment={"COLOUR": "a $dollar"})
    assert project.checked
    assert project.findings == [], project.text
    plan, text = project.checked.plan, dump_robot(project.manifest)
    again = project.check(text.split("name: one\n", 1)[1])
    assert again.plan.instances == plan.instances, text
    assert dump_robot(project.manifest) == text


@given(st.floats(-1e6, 1e6), st.sampled_from([LENGTH, TIME, SPEED, ANGLE, RATIO]))
def test_a_quantity_in_a_dump_is_the_value_to_the_last_bit(value: float, dimension: Dimension) -> None:
    text = exact(value, dimension)
    root = MappingNode({"x": Entry(ScalarNode("x", NOWHERE), ScalarNode(text, NOWHERE))})
    report = Report()
    filled = fill(root, Names(), report).get("x")
    assert isinstance(filled, ScalarNode)
    read = filled.filled if filled.filled is not None else filled.text
    assert to_si(read, dimension) == value
    assert not report.findings


def test_a_dump_tells_where_each_value_came_from(project: Project) -> None:
    project.check(ROBOT)
    history = project.manifest.history
    text = dump_robot(project.manifest, lambda path, node: f"{node.span.line}" if path[-1] == "runtime" else "")
    assert "    runtime: 45 s  # 5\n" in text
    assert history.layer(("components", "battery", "runtime")) == "the robot"


def test_the_library_is_shown_by_its_name_from_elsewhere(project: Project, tmp_path: Path) -> None:
    project.check("include:\n  wheels: rbx:parts/base.yaml\n")
    assert "rbx:parts/base.yaml" in project.manifest.files
