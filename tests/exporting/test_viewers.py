"""What is written for viewers: of a shipped robot as it is, and of all of them only topics that they have."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from rbxcompose.commands.main import main
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.exporting.viewers import driven, foxglove_layout, rviz_config
from tests.shipped import ROOT, compiled
from tests.soak import rare

ROBOTS = sorted(f"robots/{path.parent.name}" for path in ROOT.glob("robots/*/robot.yaml"))
HOUSE = "robots/house"
SEVERAL = ("robots/turtlebot", HOUSE, "robots/pi_robot")  # with little, much, and an arm


def plan_of(path: str) -> Plan:
    plan = compiled(path, environment={}).plan
    assert plan is not None
    return plan


def topics_of(plan: Plan) -> set[str]:
    return {wire.topic for instance in plan.instances for wire in instance.wires}


def texts(value: Any) -> Iterator[str]:
    """Every text in a document, keys included."""
    match value:
        case str():
            yield value
        case dict():
            for key, one in value.items():
                yield from (*texts(key), *texts(one))
        case list():
            for one in value:
                yield from texts(one)


def named_topics(document: Any) -> set[str]:
    """The topics that a document names, of which paths of Foxglove name a field."""
    return {text.partition(".")[0] for text in texts(document) if text.startswith("/")}


def leaves(tree: Any) -> Iterator[str]:
    if isinstance(tree, str):
        yield tree
    else:
        yield from (*leaves(tree["first"]), *leaves(tree["second"]))


def test_rviz_shows_what_a_shipped_robot_has(repository: Path, golden: Golden) -> None:
    text = rviz_config(plan_of(HOUSE))
    golden.check("house.rviz", text)
    displays = yaml.safe_load(text)["Visualization Manager"]["Displays"]
    kinds = {display["Class"].partition("/")[2] for display in displays}
    assert {"RobotModel", "TF", "Odometry", "LaserScan", "Map", "Path"} <= kinds
    assert "rviz_default_plugins/MarkerArray" in rviz_config(plan_of("robots/pi_robot"))


def test_foxglove_shows_what_a_shipped_robot_has(repository: Path, golden: Golden) -> None:
    text = foxglove_layout(plan_of(HOUSE))
    golden.check("house.foxglove.json", text)
    layout = json.loads(text)
    kinds = {name.partition("!")[0] for name in layout["configById"]}
    assert {"3D", "Plot", "DiagnosticSummary", "Teleop"} <= kinds


@pytest.mark.parametrize("robot", [*SEVERAL, *rare(*(robot for robot in ROBOTS if robot not in SEVERAL))])
def test_of_each_shipped_robot_only_its_topics_are_shown(repository: Path, robot: str) -> None:
    plan = plan_of(robot)
    known = topics_of(plan)
    assert named_topics(yaml.safe_load(rviz_config(plan))) <= known
    layout = json.loads(foxglove_layout(plan))
    assert named_topics(layout) <= known
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"]), "each panel is in the layout once"


def test_a_person_drives_by_the_free_input_of_the_mux_and_no_faster_than_the_base(repository: Path) -> None:
    drive = driven(plan_of("robots/turtlebot"))
    assert drive is not None
    assert (drive.name, drive.speed) == ("/cmd_vel/teleop", 0.5)
    panel = json.loads(foxglove_layout(plan_of("robots/turtlebot")))["configById"]["Teleop!drive"]
    assert panel["topic"] == "/cmd_vel/teleop"
    assert panel["upButton"] == {"field": "linear-x", "value": 0.3}
    assert panel["autoSendStopOnRelease"]


def test_a_robot_without_a_base_has_no_panel_for_driving(repository: Path) -> None:
    assert driven(plan_of("robots/head_only")) is None


def test_keys_of_panels_are_those_that_foxglove_knows(repository: Path) -> None:
    layouts = pytest.importorskip("foxglove.layouts", reason="needs foxglove-sdk")
    known = {
        "Plot": layouts.PlotConfig,
        "DiagnosticSummary": layouts.DiagnosticsSummaryConfig,
        "Teleop": layouts.TeleopConfig,
        "Image": layouts.ImageConfig,
        "3D": layouts.ThreeDeeConfig,
    }
    for robot in (HOUSE, "robots/pi_robot"):
        for name, config in json.loads(foxglove_layout(plan_of(robot)))["configById"].items():
            valid = known[name.partition("!")[0]]()._to_dict().keys() | {"foxglovePanelTitle"}
            assert config.keys() <= valid, name


@pytest.mark.parametrize(("program", "file"), [("rviz", "turtlebot.rviz"), ("foxglove", "turtlebot.foxglove.json")])
def test_the_command_writes_a_file_for_each_robot(repository: Path, tmp_path: Path, program: str, file: str) -> None:
    assert main(["export", program, "robots/turtlebot", "--out", str(tmp_path / "one")]) == 0
    assert (tmp_path / "one" / file).is_file()
    assert main(["export", program, "systems/patrol_two_hosts.yaml", "--out", str(tmp_path / "more")]) == 0
    assert (tmp_path / "more" / file).read_text() == (tmp_path / "one" / file).read_text()
    assert main(["export", program, "robots/turtlebot", "--out", str(tmp_path / "one")]) == 1, "it is not empty"
