"""Graphs: everything is in them, they are the same each time, and what reads them can."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pygraphviz
import pytest

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk import Component, Config, Serves, ServesAction, component
from rbxcompose.testing import Golden, check_text
from rbxcompose.tools.inspection.diagram import BoxShape, Diagram, WireContent, diagram_of, dot, mermaid
from rbxcompose.tools.inspection.pages import html
from tests.conftest import ROOT
from tests.shipped import robot_and_plan
from tests.soak import Soak

ROBOTS = ("turtlebot", "twins")
NAMESPACE = {"svg": "http://www.w3.org/2000/svg"}


@cache
def diagram(name: str) -> Diagram:
    return diagram_of(robot_and_plan(name)[0])


@pytest.mark.parametrize("name", ROBOTS)
def test_mermaid_and_dot_stand_as_they_were_read(name: str, golden: Golden) -> None:
    golden.check(f"{name}.mmd", mermaid(diagram(name)))
    golden.check(f"{name}.dot", dot(diagram(name)))


@pytest.mark.parametrize("name", ROBOTS)
def test_graphviz_draws_it(name: str) -> None:
    drawn = pygraphviz.AGraph(string=dot(diagram(name))).draw(format="svg", prog="dot").decode()
    assert all(group in drawn for group in diagram(name).groups)


def test_a_mission_leads_to_its_skills_and_those_to_who_serves_them() -> None:
    wires = {(wire.kind, wire.name): wire for wire in diagram("turtlebot").wires}
    go_to = wires[WireContent.ACTION, "/go_to"]
    assert ([tip.box for tip in go_to.sources], [tip.box for tip in go_to.targets]) == (["mission:patrol"], ["go_to"])
    assert "mission:patrol" in [tip.box for tip in wires[WireContent.TOPIC, "/battery_level"].targets]
    assert diagram("turtlebot").runs == (("mission", "mission:patrol"),)
    assert diagram("turtlebot").start == "mission:patrol"


WORKING = """
rbx: 1
kind: Mission
name: work
do:
  - say: begins
  - light: true
  - drive_to: dock
  - call: set_battery_level
    request: {value: 100}
  - publish: cmd_vel
    message: {linear: {x: 0.1}}
"""
WORKER = """
rbx: 1
kind: Robot
name: worker
bus: {namespace: shop}
places: {dock: {x: 0 m, y: 0 m}}
components:
  battery: {type: battery_sim, runtime: 1 h}
  base: {type: diff_drive_sim}
  lamp: {type: toy_lamp}
missions: {work: work.yaml}
"""


@component("toy_lamp")
class Lamp(Component[Config]):
    """A lamp that drives, for graphs."""

    light = Serves(SetBool, "light")
    drive_to = ServesAction(NavigateToPose, "drive_to")


def test_a_mission_leads_to_services_and_topics_and_to_nobody_for_skills_in_python(
    tmp_path: Path, golden: Golden
) -> None:
    (tmp_path / "work.yaml").write_text(WORKING)
    found = check_text(WORKER, tmp_path).compilation
    assert found.robot
    assert not found.report.has_errors, list(found.report)
    golden.check("skills.mmd", mermaid(diagram_of(found.robot)))


STARTED = """
triggers:
  nightly: {at: "22:00", mission: work, priority: 2}
  again: {ends: work, outcome: failure, mission: work}
  empty: {when: $charge < 15 %, mission: work}
  button: {message: pressed, type: std_msgs/Empty, mission: work}
values: {charge: {topic: battery_level, unit: "%", type: ratio}}
"""


def test_triggers_lead_to_what_they_start_and_need(tmp_path: Path, golden: Golden) -> None:
    (tmp_path / "work.yaml").write_text(WORKING)
    found = check_text(f"{WORKER}{STARTED}", tmp_path).compilation
    assert found.robot
    assert not found.report.has_errors, list(found.report)
    drawn = diagram_of(found.robot)
    golden.check("triggers.mmd", mermaid(drawn))
    golden.check("triggers.dot", dot(drawn))
    assert "<td>at 22:00" in html(drawn)


def test_a_mux_shows_the_priorities_of_its_inputs() -> None:
    wires = {wire.name: wire for wire in diagram("turtlebot").wires}
    assert (wires["/cmd_vel/navigation"].note, wires["/cmd_vel/teleop"].note) == ("priority 10", "priority 100")
    assert [box.name for box in diagram("turtlebot").boxes if box.shape is BoxShape.MUX] == ["cmd_vel"]


def picture(text: str) -> ElementTree.Element:
    [drawn] = re.findall(r'<svg class="graph".*?</svg>', text, re.DOTALL)
    return ElementTree.fromstring(drawn.replace("<svg ", f'<svg xmlns="{NAMESPACE["svg"]}" ', 1))


@pytest.mark.parametrize("name", ROBOTS)
def test_the_page_shows_every_box_and_every_wire(name: str) -> None:
    drawn = picture(html(diagram(name)))
    boxes = [group.get("data-box") for group in drawn.findall(".//svg:g[@data-box]", NAMESPACE)]
    wires = [text.text for text in drawn.findall(".//svg:text[@class='topic']", NAMESPACE)]
    assert sorted(map(str, boxes)) == sorted(box.key for box in diagram(name).boxes)
    assert wires == [wire.name for wire in diagram(name).wires]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_page_needs_no_other_file_and_no_network(name: str) -> None:
    page = html(diagram(name))
    assert not re.search(r"https?:|@import|<link|\ssrc=|\bfetch\(|import\(", page)
    assert set(re.findall(r"url\(([^)]*)\)", page)) == {"#arrow"}
    assert "prefers-color-scheme:dark" in page


def test_the_same_robot_gives_the_same_page() -> None:
    robot = compile_robot(str(ROOT / "robots/twins"), environment={}).robot
    assert robot
    assert html(diagram_of(robot)) == html(diagram("twins"))


def test_what_a_person_wrote_stays_text(tmp_path: Path) -> None:
    text = "rbx: 1\nkind: Robot\nname: one\nabout: '<script>alert(1)</script> & \"more\"'\n"
    robot = check_text(text, tmp_path).compilation.robot
    assert robot
    page = html(diagram_of(robot))
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;more&quot;" in page


CORPUS = sorted((ROOT / "tests/misconfig/wrong").rglob("*.yaml"))


def test_robots_with_mistakes_are_drawn_as_far_as_they_could_be_read(soak: Soak) -> None:
    drawn = 0
    for file in CORPUS[:: soak.examples(24, 1)]:
        robot = compile_robot(str(file), environment={}).robot
        if robot is not None:
            found = diagram_of(robot)
            drawn += all(found.robot in write(found) for write in (dot, html)) and bool(mermaid(found))
    assert drawn > soak.examples(3, 5)
