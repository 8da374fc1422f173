"""With the role `operate`, a client runs missions of a robot in real processes, and stops it."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live_robot import Robot
from tests.mcp.test_server import OPERATES, VIEWS, tree
from tests.mcp.tool_client import ToolClient, connected
from tests.patrol_project import ROBOT, write_project


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    write_project(base / "project")
    made = Robot(base, "")
    made.environment["XDG_STATE_HOME"] = str(base / "state")
    up = made.do("up", "-d", str(base / "project" / ROBOT), "--set", "bus.port=7895")
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


@pytest.fixture(scope="module")
def client(robot: Robot) -> Iterator[ToolClient]:
    project = robot.file.parent / "project"
    before = tree(project)
    with connected(project, robot.environment, operates=True) as made:
        yield made
    assert tree(project) == before


def test_a_robot_is_looked_at(robot: Robot, client: ToolClient) -> None:
    assert set(client.tools()) == VIEWS | OPERATES
    state = client.told("state")
    assert (state["robot"], state["stop"], state["missions"][0]["mission"]) == ("turtlebot", None, "patrol")
    assert {one["name"]: one["state"] for one in state["components"]}["base"] == "active"
    assert state["batteries"]["battery"].endswith(" %")
    assert {group["group"] for group in state["diagnostics"]} >= {"motion", "power"}


def test_it_is_stopped_and_released_and_missions_are_run_as_its_log_tells(robot: Robot, client: ToolClient) -> None:
    assert client.told("stop", robot="turtlebot")["answer"].startswith("stopped")
    assert robot.told("ps")["stop"]["by"] == "the command 'stop'"
    assert client.told("release")["answer"].startswith("released")
    assert robot.told("ps")["stop"] is None
    for tool, answer in (
        ("mission_resume", "mission patrol resumed"),
        ("mission_pause", "mission patrol paused"),
        ("mission_cancel", "mission patrol cancelled"),
    ):
        assert client.told(tool, robot="turtlebot")["answer"] == answer
    assert client.told("mission_run", mission="patrol", inputs={"rounds": "1"})["answer"] == "mission patrol starts"
    assert [one["state"] for one in robot.told("mission", "ls")] == ["running"]
    assert "no mission 'patrl'" in client.refusal("mission_run", mission="patrl")
    assert "no robot 'other' is up" in client.refusal("stop", robot="other")
    told = robot.do("logs").stdout
    for words in ("stop", "release", "mission resume", "mission pause", "mission cancel"):
        assert f"mcp, mcp (operate): asks {words}\n" in told
    assert "mcp, mcp (operate): asks mission run patrol --set=rounds=1\n" in told
    audited = (robot.file.parent / "state/rbxcompose/mcp.jsonl").read_text(encoding="utf-8")
    assert audited.count("\n") == len(client.called)
    assert '"tool": "mission_run", "arguments": {"mission": "patrol", "inputs": "{\\"rounds\\": \\"1\\"}"}' in audited


def test_the_story_of_a_mission_is_told(robot: Robot, client: ToolClient) -> None:
    story = client.told("story", mission="patrol", lines=2)
    assert (story["robot"], len(story["records"])) == ("turtlebot", 2)
    assert {record["mission"] for record in story["records"]} == {"patrol"}
    assert story["before"] > 0
