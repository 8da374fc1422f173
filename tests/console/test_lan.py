"""A console that is open to the network: who gets in, and what they may. The network is one that the test makes."""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.systems.namespaces import Hosts, NotPermittedError

ROBOT, LAPTOP = "10.77.0.1", "10.77.0.2"
MANIFEST = """
rbx: 1
kind: Robot
name: digger
components:
  base: {type: diff_drive_sim}
console: {listen: lan, port: 8090}
bus: {port: 7895}
"""
UP = 60  # [s]

VISIT = """
import asyncio, json, sys, time, urllib.error, urllib.request
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
robot, tokens = sys.argv[1], json.loads(sys.argv[2])
place, found = f"{robot}:8090", {}

def get(path, data=None, **headers):
    asked = urllib.request.Request(f"http://{place}{path}", data, headers)
    try:
        with urllib.request.urlopen(asked, timeout=10) as answer:
            return answer.status, dict(answer.headers)
    except urllib.error.HTTPError as error:
        return error.code, {}

found["page"], found["nobody"] = get("/")[0], get("/console/config")[0]
found["rebinding"] = get("/console/config", Host="evil.example:8090")[0]
found["wrong"] = get("/console/login", b"x" * 43)[0]
found["long"] = get("/console/login", b"x" * 5000)[0]
status, headers = get("/console/login", tokens["operate"].encode())
cookie = headers["set-cookie"]
found["cookie"] = [status, "HttpOnly" in cookie, "SameSite=strict" in cookie]
found["known"] = get("/console/config", Cookie=cookie.partition(";")[0])[0]
found["bearer"] = get("/console/config", Authorization="Bearer " + tokens["view"])[0]

found["body"] = [
    get(path, **headers)[0]
    for path in ("/console/model.urdf", "/console/meshes/0/base.stl")
    for headers in ({}, {"Authorization": "Bearer " + tokens["view"]})
]

async def talk(*frames, **options):
    async with connect(f"ws://{place}/rosbridge", **options) as socket:
        for frame in frames:
            await socket.send(json.dumps(frame))
        await socket.send(json.dumps({"op": "call_service", "service": "/rosapi/get_time", "id": "end"}))
        statuses = []
        async for text in socket:
            frame = json.loads(text)
            if frame.get("id") == "end":
                return [*statuses, frame["result"]]
            if frame["op"] == "status":
                statuses.append(frame["msg"])

async def closed(frame="", **options):
    try:
        async with connect(f"ws://{place}/rosbridge", **options) as socket:
            if frame:
                await socket.send(frame)
            await socket.wait_closed()
            return socket.close_code
    except InvalidStatus as refused:
        return refused.response.status_code

drives = {"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.1}}}
found["stranger"] = asyncio.run(talk(drives))
found["viewer"] = asyncio.run(talk({"op": "auth", "mac": tokens["view"]}, drives))
found["operator"] = asyncio.run(talk(drives, additional_headers={"Cookie": cookie.partition(";")[0]}))
found["foreign"] = asyncio.run(closed(origin="http://evil.example"))
began = time.monotonic()
found["long frame"] = asyncio.run(closed(json.dumps({"op": "auth", "mac": "x" * 5000})))
found["waits"] = time.monotonic() - began > 4  # as long as somebody who says nothing
found["shy"] = asyncio.run(closed())
print(json.dumps(found))
"""

STAY = """
import json, sys, urllib.error, urllib.request
from contextlib import suppress
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

robot, token, stays = sys.argv[1:]
asked = urllib.request.Request(f"http://{robot}:8090/console/config", headers={"Authorization": f"Bearer {token}"})
with connect(f"ws://{robot}:8090/rosbridge") as socket:
    socket.send(json.dumps({"op": "auth", "mac": token}))
    socket.send(json.dumps({"op": "call_service", "service": "/rosapi/get_time"}))
    print(json.loads(socket.recv())["result"], flush=True)
    with suppress(ConnectionClosed):
        while stays == "stays":
            socket.recv()
try:
    print(urllib.request.urlopen(asked, timeout=10).status)
except urllib.error.HTTPError as error:
    print(error.code)
"""


@pytest.fixture
def hosts(tmp_path: Path) -> Iterator[Hosts]:
    try:
        hosts = Hosts(tmp_path, {"robot": ROBOT, "laptop": LAPTOP})
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        yield hosts


@pytest.mark.timeout(120)
def test_only_who_has_a_token_gets_in_and_each_does_what_its_role_may(hosts: Hosts, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(MANIFEST, encoding="utf-8")
    (tmp_path / "visit.py").write_text(textwrap.dedent(VISIT), encoding="utf-8")
    own = {"XDG_STATE_HOME": str(tmp_path / "state"), "PYTHONPATH": str(ROOT)}

    def run(host: str, *words: str) -> str:
        done = hosts.start(host, sys.executable, *words, environment=own)
        said, _ = done.communicate(timeout=UP)
        assert done.returncode == 0, said
        return said

    # A machine alone in its network has no way out; it still says where it is.
    hosts.ip("robot", "route", "add", "default", "via", LAPTOP)
    up = run("robot", "-m", "rbxcompose", "up", "-d", str(tmp_path / "robot.yaml"))
    shown = next(line for line in up.splitlines() if line.startswith("console, to operate: "))
    address, _, operate = shown.rpartition("#token=")
    assert address == f"console, to operate: http://{ROBOT}:8090/"
    view = run("robot", "-m", "rbxcompose", "console", "--role", "view").strip().rpartition("=")[2]
    tokens = json.dumps({"operate": operate, "view": view})
    found = json.loads(run("laptop", str(tmp_path / "visit.py"), ROBOT, tokens).splitlines()[-1])
    (tmp_path / "stay.py").write_text(textwrap.dedent(STAY), encoding="utf-8")
    stay = hosts.start("laptop", sys.executable, str(tmp_path / "stay.py"), ROBOT, view, "stays")
    assert stay.stdout
    assert stay.stdout.readline() == "True\n"
    run("robot", "-m", "rbxcompose", "console", "--renew")
    assert stay.communicate(timeout=UP)[0] == "401\n"
    renewed = run("robot", "-m", "rbxcompose", "console", "--role", "view").strip().rpartition("=")[2]
    assert run("laptop", str(tmp_path / "stay.py"), ROBOT, renewed, "") == "True\n200\n"
    log = run("robot", "-m", "rbxcompose", "logs")
    run("robot", "-m", "rbxcompose", "down")
    assert found == {
        "page": 200,
        "nobody": 401,
        "rebinding": 403,
        "wrong": 401,
        "long": 413,
        "cookie": [200, True, True],
        "known": 200,
        "bearer": 200,
        "body": [401, 404, 401, 404],
        "stranger": ["this needs the role 'operate'; yours is 'nobody'", False],
        "viewer": ["this needs the role 'operate'; yours is 'view'", True],
        "operator": [True],
        "foreign": 403,
        "long frame": 1008,
        "waits": False,
        "shy": 1008,
    }
    assert f"{LAPTOP} (operate): publish /cmd_vel" in log
    assert f"{LAPTOP}: is refused: a wrong token" in log
    assert operate not in log
