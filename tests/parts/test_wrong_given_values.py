"""A wrong value is told in the file of who gave it, with the place where the part uses it."""

from __future__ import annotations

import pytest

from rbxcompose.base.findings import Finding
from tests.parts.project import Project

POWER = """\
rbx: 1
kind: Part
name: power
args:
  warn: {type: ratio, default: 50 %}
  error: {type: ratio, default: 20 %}
  restart: {type: choice, choices: [always, never, seldom], default: never}
  dock: {type: place, default: dock}
components:
  battery:
    type: battery_sim
    runtime: 45 s
    warn: ${args.warn}
    error: ${args.error}
    restart: ${args.restart}
  charger:
    type: charger
    dock: ${args.dock}
"""
OUTER = """\
rbx: 1
kind: Part
name: outer
args:
  warning: {type: ratio, default: 50 %}
  restart: {type: choice, choices: [always, never, seldom], default: never}
include:
  inner:
    part: power.yaml
    with:
      warn: ${args.warning}
      restart: ${args.restart}
"""
PARTS = {"power": POWER, "outer": OUTER}
HEAD = "places: {dock: {x: 0 m, y: 0 m}}\n"
ROBOT_FILE, USE = "robots/one/robot.yaml", "parts/power.yaml"


def told(finding: Finding) -> tuple[str, str]:
    """Return the place of a finding and the line of its text that stands there in a part or robot."""
    assert finding.span
    return finding.code, f"{finding.span.file}:{finding.span.line}"


def uses(finding: Finding) -> list[str]:
    return [f"{one.message}: {one.span.file}:{one.span.line}" for one in finding.related if " here" in one.message]


@pytest.mark.parametrize(
    ("given", "code", "line"),
    [("warn: 150 %", "RBX1005", 13), ("restart: seldom", "RBX1004", 15), ("dock: garage", "RBX1004", 18)],
)
def test_a_value_of_with_is_told_there(project: Project, given: str, code: str, line: int) -> None:
    robot = f"{HEAD}include:\n  power:\n    part: ../../parts/power.yaml\n    with:\n      {given}\n"
    project.check(robot, PARTS)
    [finding] = project.findings
    assert told(finding) == (code, f"{ROBOT_FILE}:9")
    assert uses(finding) == [f"used here: {USE}:{line}"]


def test_the_file_that_gives_it_is_where_it_is_told_through_two_levels(project: Project) -> None:
    robot = f"{HEAD}include:\n  all:\n    part: ../../parts/outer.yaml\n    with: {{warning: 150 %}}\n"
    project.check(robot, PARTS)
    [finding] = project.findings
    assert told(finding) == ("RBX1005", f"{ROBOT_FILE}:8")
    assert uses(finding) == ["passed on here: parts/outer.yaml:11", f"used here: {USE}:13"]


def test_a_part_that_gives_a_wrong_value_is_told_with_what_includes_it(project: Project) -> None:
    wrong = OUTER.replace("warn: ${args.warning}", "warn: 150 %")
    project.check(f"{HEAD}include: {{all: ../../parts/outer.yaml}}\n", {**PARTS, "outer": wrong})
    [finding] = project.findings
    assert told(finding) == ("RBX1005", "parts/outer.yaml:11")
    assert uses(finding)[0] == f"used here: {USE}:13"
    assert "included here as 'all': robots/one/robot.yaml:5" in uses(finding)


def test_a_choice_is_handed_on_as_the_word_that_it_is(project: Project) -> None:
    robot = f"{HEAD}include:\n  all:\n    part: ../../parts/outer.yaml\n    with: {{restart: always}}\n"
    project.check(robot, PARTS)
    assert project.findings == []
    assert project.manifest.components["all_inner_battery"].options.restart.when == "always"


def test_only_the_instance_that_is_given_a_wrong_value_is_told(project: Project) -> None:
    connect = "connect: {battery_level: b/level, set_battery_level: b/set, recharge: b/recharge}"
    robot = f"""
        places: {{dock: {{x: 0 m, y: 0 m}}}}
        include:
          right: {{part: ../../parts/power.yaml, with: {{warn: 40 %}}}}
          wrong: {{part: ../../parts/power.yaml, with: {{warn: 140 %}}, {connect}}}
        """
    project.check(robot, PARTS)
    [finding] = [candidate for candidate in project.findings if candidate.code == "RBX1005"]
    assert told(finding) == ("RBX1005", f"{ROBOT_FILE}:8")


def test_a_check_of_the_whole_robot_points_there_as_well(project: Project) -> None:
    robot = f"{HEAD}include:\n  power:\n    part: ../../parts/power.yaml\n    with: {{warn: 10 %}}\n"
    project.check(robot, PARTS)
    [finding] = project.findings
    assert f"{ROBOT_FILE}:8" in {
        f"{span.file}:{span.line}" for span in (finding.span, *(one.span for one in finding.related)) if span
    }


OWN = """\
args:
  warn: {type: ratio, default: 50 %}
components:
  battery: {type: battery_sim, runtime: 45 s, warn: "${args.warn}"}
profiles:
  wrong: {args: {warn: 150 %}}
"""
OVERLAY = "rbx: 1\nkind: Overlay\nname: over\nargs:\n  warn: 150 %\n"


def test_a_value_that_set_gives_is_told_there(project: Project) -> None:
    project.check(OWN.partition("profiles")[0], sets=["args.warn=150 %"])
    [finding] = project.findings
    assert told(finding) == ("RBX1005", "--set:1")
    assert uses(finding) == [f"used here: {ROBOT_FILE}:7"]


@pytest.mark.parametrize("profiles", [[], ["wrong"]])
def test_a_value_that_a_profile_gives_is_told_there_also_where_it_is_only_tried(
    project: Project, profiles: list[str]
) -> None:
    project.check(OWN, profiles=profiles)
    [finding] = project.findings
    assert told(finding) == ("RBX1005", f"{ROBOT_FILE}:9")
    assert uses(finding) == [f"used here: {ROBOT_FILE}:7"]


def test_a_value_that_an_overlay_gives_is_told_there(project: Project) -> None:
    project.check(OWN.partition("profiles")[0], files={"over.yaml": OVERLAY}, overlays=["over.yaml"])
    [finding] = project.findings
    assert told(finding) == ("RBX1005", "over.yaml:5")


def test_set_reaches_what_a_part_is_given(project: Project) -> None:
    robot = f"{HEAD}include:\n  power:\n    part: ../../parts/power.yaml\n    with: {{warn: 50 %}}\n"
    project.check(robot, PARTS, sets=["include.power.with.warn=150 %"])
    [finding] = project.findings
    assert told(finding) == ("RBX1005", "--set:1")


def test_a_wrong_default_is_told_where_it_is_used(project: Project) -> None:
    project.check(HEAD + "include: {power: ../../parts/power.yaml}\n", {"power": POWER.replace("50 %", "150 %")})
    [finding] = project.findings
    assert told(finding) == ("RBX1005", f"{USE}:13")


def test_a_misspelt_word_is_mended_where_it_was_given(project: Project) -> None:
    robot = f"{HEAD}include:\n  power:\n    part: ../../parts/power.yaml\n    with:\n      dock: dok\n"
    project.check(robot, PARTS)
    [finding] = project.findings
    assert finding.fix
    [edit] = finding.fix.edits
    assert (edit.old, edit.text, f"{edit.span.file}:{edit.span.line}") == ("dok", "dock", f"{ROBOT_FILE}:9")
