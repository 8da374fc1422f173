"""A mission of a robot in real processes, debugged through its gateway as the page does it."""

from __future__ import annotations

import asyncio
import json
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect

from tests.cli.live_robot import PATIENCE, Robot
from tests.console.test_gateway_live import free_port
from tests.runtime.real_robot import eventually

PORT = free_port()
MANIFEST = f"""
rbx: 1
kind: Robot
name: debugged
bus: {{port: {free_port()}}}
components: {{battery: {{type: battery_sim, runtime: 1 h}}}}
missions: {{count: count.yaml}}
console: {{port: {PORT}}}
"""
MISSION = """
rbx: 1
kind: Mission
name: count
data:
  round: 0
machine:
  start: counting
  states:
    counting:
      do:
        - set:
            round: $round + 1
        - wait: 1 h
      next: resting
    resting:
      do:
        wait: 1 h
      next: finished
"""
WINDOWS = "/console/windows/"
LOOK_AT = "mission/LookAtAll/mission/count"


@pytest.fixture
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    base.joinpath("count.yaml").write_text(MISSION, encoding="utf-8")
    made = Robot(base, MANIFEST)
    made.environment["XDG_STATE_HOME"] = str(base / "state")
    up = made.do("up", "-d", str(made.file))
    assert up.returncode == 0, up.stderr
    yield made
    assert made.do("down").returncode == 0
    shutil.rmtree(base)


class Debugging:
    """A page that looks at the mission, and asks."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.windows: dict[str, Any] = {}

    async def until(self, holds: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Read what the windows show until something holds for it."""
        while not holds(self.windows):
            await self._read()
        return self.windows

    async def asks(self, request: str, **fields: Any) -> tuple[Any, str]:
        """Return the answer to a request about the mission, and the reason if it is refused."""
        args = {"type": f"mission.{request}", "mission": "count", **fields}
        frame = {"op": "call_service", "service": "/console/ask", "args": args}
        await self.socket.send(json.dumps(frame))
        while (frame := await self._read())["op"] != "service_response":
            pass
        values: Any = frame["values"]
        return values["answer"], values["message"] if not values["success"] else ""

    async def _read(self) -> dict[str, Any]:
        frame: dict[str, Any] = json.loads(await asyncio.wait_for(self.socket.recv(), PATIENCE))
        if frame["op"] == "publish":
            self.windows[frame["topic"].removeprefix(WINDOWS)] = frame["msg"].get("answer")
        return frame


def stops(shown: dict[str, Any]) -> list[tuple[str, str]]:
    seen = shown.get(LOOK_AT) or {}
    return [(one["text"], one["after"]) for one in seen.get("stopped_at", ())]


async def debug(page: Debugging) -> None:
    for window in (LOOK_AT, "mission/ListBreakpoints"):
        await page.socket.send(json.dumps({"op": "subscribe", "topic": f"{WINDOWS}{window}", "throttle_rate": 100}))
    picture, _ = await page.asks("ShowPicture")
    waiting = picture["main"]["children"][0]["children"][0]["children"][1]["number"]
    assert (await page.asks("SetBreakpoint", where=str(waiting)))[1] == ""
    await page.until(lambda shown: shown.get("mission/ListBreakpoints"))
    assert page.windows["mission/ListBreakpoints"][0]["spots"] == [[waiting, None]]
    await page.asks("RunMission", inputs={}, start="")
    await page.until(lambda shown: stops(shown) == [("wait 1 h", "")])
    assert (await page.asks("ListData"))[0][0]["text"] == "1"
    assert "must be a whole number" in (await page.asks("SetMissionData", values={"round": "many"}))[1]
    assert (await page.asks("SetMissionData", values={"round": "7"}))[1] == ""
    assert (await page.asks("ListOutcomes"))[0][str(waiting)] == ["success"]
    assert (await page.asks("ForceNode", where=str(waiting), outcome="success"))[1] == ""
    await page.asks("StepMission")
    await page.until(lambda shown: stops(shown) == [("counting", "success")])
    seen = page.windows[LOOK_AT]
    assert (seen["data"], seen["by_hand"], seen["state"]) == ({"round": 7.0}, 2, "paused")
    assert (await page.asks("ResumeMission"))[1] == ""
    assert (await page.asks("JumpMission", state="counting"))[1] == ""
    await page.until(lambda shown: stops(shown) == [("wait 1 h", "")])
    await page.asks("ClearBreakpoints", where=str(waiting))
    await page.until(lambda shown: shown["mission/ListBreakpoints"] == [])
    await page.asks("CancelMission")


def test_a_mission_is_debugged_through_the_gateway(robot: Robot) -> None:
    async def visit() -> None:
        async with connect(f"ws://127.0.0.1:{PORT}/rosbridge") as socket:
            await debug(Debugging(socket))

    asyncio.run(visit())
    log = robot.do("logs", "mission").stdout
    assert "by hand: round = 7; the run cannot be reproduced without this" in log
    eventually(lambda: "asks mission.ForceNode" in robot.do("logs", "gateway").stdout)  # it logs once a second
