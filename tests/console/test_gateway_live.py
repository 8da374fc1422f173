"""The console of a robot in real processes: its page, real clients, and what stops the robot."""

from __future__ import annotations

import asyncio
import email
import importlib.util
import json
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, closing, suppress
from http.client import HTTPConnection
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import websockets
from PIL import Image as Picture
from playwright.sync_api import expect
from websockets.asyncio.client import ClientConnection, connect

from rbxcompose.commands.guest import Guest
from rbxcompose.domains.console.components.gateway import MOST_CONNECTIONS
from rbxcompose.domains.console.feeds import SHORTEST
from rbxcompose.domains.console.video import MOST_STREAMS
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.sdk.ports import Qos
from tests.cli.live_robot import PATIENCE, Robot
from tests.conftest import ROOT
from tests.console.browser import CHROMIUM, chromium, console
from tests.console.foxglove_client import Foxglove

TELEOP = "/cmd_vel/teleop"


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


PORT, FOXGLOVE = free_port(), free_port()
HOST = f"127.0.0.1:{PORT}"
WORLD = """rbx: 1
kind: World
name: far_away
objects:
  walker: {shape: person, path: [[0 s, 50 m, 0 m], [600 s, 60 m, 0 m]]}
"""
UP: list[float] = []  # before and after the robot came up [s]


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    with suppress(console.CannotBuildError):
        console.build()
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    text = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8").partition("\nmissions:")[0]
    camera = "camera: {type: test_picture, topic: camera/image_raw, width: 64, height: 48}"
    text = text.replace("\ncomponents:\n", f"\nworld: world.yaml\n\ncomponents:\n  {camera}\n")
    base.joinpath("world.yaml").write_text(WORLD, encoding="utf-8")
    made = Robot(base, f"{text}\nconsole: {{port: {PORT}, foxglove: {FOXGLOVE}, drive: {{max_speed: 0.25 m/s}}}}\n")
    UP.append(time.monotonic())
    with socket.create_server(("127.0.0.1", FOXGLOVE)):  # until the robot is up, another program has it
        up = made.do("up", "-d", str(made.file), "--set", "bus.port=7891")
        assert up.returncode == 0, up.stderr
        logs = "" if importlib.util.find_spec("foxglove") else "Foxglove is not served"
        deadline = time.monotonic() + PATIENCE
        while "Foxglove is not served" not in logs and time.monotonic() < deadline:
            logs = made.do("logs", "gateway").stdout
        assert "Foxglove is not served" in logs
    assert f"console: http://{HOST}/" in up.stdout.splitlines()
    UP.append(time.monotonic())
    yield made
    began = time.monotonic()
    assert made.do("down").returncode == 0
    assert time.monotonic() - began < PATIENCE
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", PORT)) != 0  # nobody is left at the port
    assert "Error" not in made.do("logs").stdout
    shutil.rmtree(base)


def get(path: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    asked = urllib.request.Request(f"http://{HOST}{path}", headers=headers)
    try:
        with urllib.request.urlopen(asked, timeout=PATIENCE) as answer:
            return answer.status, answer.read().decode(), {key.lower(): value for key, value in answer.headers.items()}
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode(), {key.lower(): value for key, value in error.headers.items()}


class Browser:
    """A connection, as a page has it."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    async def sends(self, op: str, **fields: Any) -> None:
        await self.socket.send(json.dumps({"op": op, **fields}))

    async def next(self, op: str) -> dict[str, Any]:
        while True:
            frame: dict[str, Any] = json.loads(await asyncio.wait_for(self.socket.recv(), PATIENCE))
            if frame["op"] == op:
                return frame

    async def calls(self, service: str, **args: Any) -> Any:
        await self.sends("call_service", service=service, args=args)
        return (await self.next("service_response"))["values"]


def browse(what: Callable[[Browser], Awaitable[None]], path: str = "/rosbridge", **options: Any) -> None:
    async def run() -> None:
        async with connect(f"ws://{HOST}{path}", **options) as socket:
            await what(Browser(socket))

    asyncio.run(run())


def test_no_link_leads_to_the_page_of_another_robot_at_the_same_port(robot: Robot) -> None:
    second = robot.file.with_name("second.yaml")
    console_of_second = f"bus: {{port: 7892}}\nconsole: {{port: {PORT}}}\n"
    second.write_text(f"rbx: 1\nkind: Robot\nname: second\n{console_of_second}", encoding="utf-8")
    up = robot.do("up", "-d", str(second))
    link = robot.do("console", "--robot", "second")
    noted = robot.told("ps", "--robot", "second")["components"]
    assert robot.do("down", "second").returncode == 0
    taken = f"has no page: port {PORT}: Address already in use by robot 'turtlebot'"
    assert (up.returncode, f"second {taken}" in up.stdout, "http://" in up.stdout) == (0, True, False), up.stdout
    assert (link.returncode, f"'second' {taken}" in link.stderr, link.stdout) == (1, True, ""), link.stderr
    assert [taken in component.get("note", "") for component in noted if component["name"] == "gateway"] == [True]


def test_messages_of_all_topics_are_counted_while_somebody_asks(robot: Robot) -> None:
    async def count(page: Browser) -> None:
        rates: dict[str, float] = {}
        while "/odom" not in rates:
            rates = (await page.calls("/console/rates"))["answer"]
            await asyncio.sleep(SHORTEST)
        assert 5 < rates["/odom"] < 200  # 50 Hz, on a machine that is not busy
        assert rates["/robot_description"] == 0  # what is latched came before

    browse(count)


def test_a_service_that_is_served_again_with_another_type_is_called_with_that(robot: Robot) -> None:
    async def known(page: Browser, wanted: str) -> None:
        while True:
            await page.sends("call_service", service="/rosapi/service_type", args={"service": "/ring"})
            if (await page.next("service_response"))["values"]["type"] == wanted:
                return
            await asyncio.sleep(0.02)  # so many frames may a client send

    async def serve(page: Browser) -> None:
        for type_, args in (("std_srvs/srv/SetBool", {"data": True}), ("std_srvs/srv/Trigger", {})):
            await page.sends("advertise_service", service="/ring", type=type_)
            await known(page, type_)
            await page.sends("call_service", service="/ring", args=args)
            asked = await page.next("call_service")
            values = {"success": True, "message": type_}
            await page.sends("service_response", service="/ring", id=asked["id"], values=values, result=True)
            assert (await page.next("service_response"))["values"] == values
            await page.sends("unadvertise_service", service="/ring")
            await known(page, "")

    browse(serve)


class Commands:
    """What arrives at the mux, and when [s]."""

    def __init__(self, robot: Robot) -> None:
        self.got: list[tuple[float, float]] = []
        self._is_over = threading.Event()
        self._place = robot.place()
        self._thread = threading.Thread(target=self._listen)

    def __enter__(self) -> Commands:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._is_over.set()
        self._thread.join()

    def _listen(self) -> None:
        with Guest(self._place, stays=True) as guest:
            guest.bus().subscribe("listener", TELEOP, Twist, Qos.EVENT, self._arrived)
            guest.run(self._is_over.is_set, 0.0)
            while not self._is_over.is_set():
                guest.run(self._is_over.is_set, 0.05)

    def _arrived(self, message: Twist) -> None:
        self.got.append((time.monotonic(), message.linear.x))

    def until(self, speed: float) -> float:
        """Return when a speed arrived."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            for when, found in self.got:
                if found == speed:
                    return when
            time.sleep(0.01)
        raise AssertionError(self.got)


def test_the_page_is_served_and_nothing_else_may_embed_it(robot: Robot) -> None:
    status, text, headers = get("/")
    assert (status, "<html" in text) == (200, True)
    assert "default-src 'self'" in headers["content-security-policy"]
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    assert get("/../../etc/passwd")[0] == 404


def test_the_page_learns_what_the_robot_has(robot: Robot) -> None:
    config = json.loads(get("/console/config")[1])
    limits = {"max_speed": 0.25, "max_turn_rate": pytest.approx(1.5708, abs=1e-4)}
    assert config["robot"] == "turtlebot"
    assert config["drive"] == {"topic": TELEOP, "type": "geometry_msgs/msg/Twist", **limits}
    battery = {"topic": "/battery_level", "type": "std_msgs/msg/Float32", "field": "data", "unit": "%"}
    assert config["values"] == {"battery": battery}
    assert config["stop"] == "/console/stop"


def test_every_component_describes_itself_and_answers_what_it_takes(robot: Robot) -> None:
    async def ask(browser: Browser) -> None:
        described = (await browser.calls("/console/ask", type="robot.DescribeRobot"))["answer"]
        components = {each["name"]: each for each in described}
        assert {"base", "battery", "go_to", "charger", "cmd_vel", "diagnostics", "gateway"} <= components.keys()
        assert components["battery"]["capabilities"]["Drains"][0]["level"] == "battery_level"
        (goals,) = [port for port in components["go_to"]["ports"] if port["kind"] == "serves_action"]
        assert (goals["skill"], goals["claims"]) == ("go_to", "base")
        assert components["cmd_vel"]["requests"]["mux.SelectMuxInput"] is True
        seen = await browser.calls("/console/ask", type="mux.LookAtMux", component="cmd_vel")
        assert {one["name"] for one in seen["answer"]["inputs"]} == {"teleop", "navigation"}

    browse(ask)


@pytest.mark.parametrize("what", ["ApplyPlan", "RevertPlan", "BringDown"])
def test_no_request_of_a_page_changes_what_runs(robot: Robot, what: str) -> None:
    async def ask(browser: Browser) -> None:
        answer = await browser.calls("/console/ask", type=f"robot.{what}")
        assert answer == {"success": False, "message": f"there is no request 'robot.{what}'", "answer": None}

    browse(ask)


def test_a_window_shows_a_query_and_never_carries_out_a_command(robot: Robot) -> None:
    async def look(browser: Browser) -> None:
        await browser.sends("subscribe", topic="/console/windows/robot/RobotStatus")
        assert (await browser.next("publish"))["msg"]["answer"]["stop"] is None
        await browser.sends("unsubscribe", topic="/console/windows/robot/RobotStatus")
        await browser.sends("subscribe", topic="/console/windows/robot/StopRobot")
        assert (await browser.next("publish"))["msg"] == {"refused": "there is no query 'robot.StopRobot'"}

    browse(look)


@pytest.mark.parametrize("origin", [f"http://{HOST}", f"http://localhost:{PORT}", None], ids=["own", "local", "none"])
def test_its_own_pages_and_programs_of_this_machine_may_talk(robot: Robot, origin: Any) -> None:
    async def talk(browser: Browser) -> None:
        assert "/odom" in (await browser.calls("/rosapi/topics"))["topics"]

    browse(talk, origin=origin)
    browse(talk, "/", origin=origin)


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": f"http://127.0.0.1:{PORT + 1}"},
        {"Origin": f"https://{HOST}"},
        {"Host": "evil.example"},
        {"Host": f"evil.example:{PORT}"},
    ],
)
def test_pages_of_others_are_refused(robot: Robot, headers: dict[str, str]) -> None:
    async def attempt() -> None:
        async with connect(f"ws://{HOST}/rosbridge", additional_headers=headers):
            pass

    assert get("/console/config", **headers)[0] == 403
    if "Host" not in headers:
        with pytest.raises(websockets.InvalidStatus):
            asyncio.run(attempt())


def test_pictures_are_streamed_as_by_web_video_server(robot: Robot) -> None:
    address = f"http://{HOST}/snapshot?topic=/camera/image_raw&width=32&type=png"
    with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
        assert answer.headers["content-type"] == "image/png"
        assert Picture.open(BytesIO(answer.read())).size == (32, 24)
    with urllib.request.urlopen(f"http://{HOST}/stream?topic=/camera/image_raw", timeout=PATIENCE) as stream:
        kind, _, boundary = stream.headers["content-type"].partition(";boundary=")
        assert kind == "multipart/x-mixed-replace"
        for _ in range(3):
            assert stream.readline() == f"--{boundary}\r\n".encode()
            head = email.message_from_bytes(b"".join(iter(stream.readline, b"\r\n")))
            assert Picture.open(BytesIO(stream.read(int(head["content-length"])))).size == (64, 48)
            assert stream.readline() == b"\r\n"
    assert "stream_viewer?topic=/camera/image_raw" in get("/streams")[1]
    assert get("/stream?topic=/odom")[:2] == (
        404,
        "'/odom' has no pictures: its messages are 'nav_msgs/msg/Odometry'\n",
    )
    assert get("/snapshot?topic=/camera/image_raw&width=x")[0] == 404


def test_the_headers_alone_start_no_stream(robot: Robot) -> None:
    with closing(HTTPConnection(HOST, timeout=PATIENCE)) as client:
        for path, status, kind in (
            ("/stream?topic=/camera/image_raw", 200, "multipart/x-mixed-replace;boundary=boundarydonotcross"),
            ("/snapshot?topic=/camera/image_raw&type=png", 200, "image/png"),
            ("/stream?topic=/odom", 404, "text/plain; charset=utf-8"),
        ):
            client.request("HEAD", path)
            answer = client.getresponse()
            assert (answer.status, answer.headers["content-type"], answer.read()) == (status, kind, b"")
        client.request("GET", "/streams")
        assert b"/camera/image_raw" in client.getresponse().read()


def test_a_viewer_that_leaves_is_noticed_though_it_asked_for_more_and_no_picture_comes(robot: Robot) -> None:
    def snapshot() -> int:
        with closing(HTTPConnection(HOST, timeout=PATIENCE)) as client:
            client.request("GET", "/snapshot?topic=/camera/image_raw")
            return client.getresponse().status

    async def looks(browser: Browser) -> None:
        async def publishes() -> None:
            while True:
                await browser.sends("publish", topic="/dot", msg=dot)
                await asyncio.sleep(0.02)

        dot = {"height": 1, "width": 1, "encoding": "mono8", "step": 1, "data": "AA=="}
        await browser.sends("advertise", topic="/dot", type="sensor_msgs/Image")
        publisher = asyncio.create_task(publishes())
        viewers = []
        for width in range(1, MOST_STREAMS + 1):
            reader, writer = await asyncio.open_connection("127.0.0.1", PORT)
            viewers.append(writer)
            ask = f"GET /stream?topic=/dot&width={width} HTTP/1.1\r\nHost: {HOST}\r\n\r\n".encode()
            writer.write(ask)
            await asyncio.wait_for(reader.readuntil(b"image/jpeg"), PATIENCE)
            writer.write(ask)
        publisher.cancel()
        assert await asyncio.to_thread(snapshot) == 404  # there are as many streams as may be
        writer.write(b" " * 100_000)
        with suppress(ConnectionError):
            await asyncio.wait_for(reader.read(), PATIENCE)  # who asks for much more is cut
        for writer in viewers:
            writer.close()
        deadline = time.monotonic() + PATIENCE
        while await asyncio.to_thread(snapshot) != 200:
            assert time.monotonic() < deadline

    browse(looks)


def test_the_page_gets_the_body_and_nothing_beside_it(robot: Robot) -> None:
    status, urdf, headers = get("/console/model.urdf")
    assert (status, headers["content-type"].partition(";")[0]) == (200, "application/xml")
    assert "<robot" in urdf
    assert headers["content-security-policy"].startswith("default-src 'self'")
    assert get("/console/model.urdf", **{"if-none-match": headers["etag"]})[0] == 304
    for path in ("robot.yaml", "../config", "%2e%2e/%2e%2e/etc/passwd"):
        assert get(f"/console/meshes/{path}")[0] == 404


def test_roslibpy_does_all_that_it_can(robot: Robot) -> None:
    command = [sys.executable, "-m", "tests.console.roslibpy_client", str(PORT)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=50)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert "/odom" in told["topics"]
    assert (told["type"], told["odometry"], told["echo"]) == ("nav_msgs/msg/Odometry", "base_footprint", "grüße")
    assert told["parameters"]["values"][0]["double_value"] == 0.5
    assert told["lease"]["success"]
    assert "no service" in told["failure"]


def test_roslib_does_all_that_pages_do(robot: Robot) -> None:
    if not (ROOT / "console/node_modules/roslib").exists():
        pytest.skip("roslib is not installed: the page of the console was not built here")
    client = ROOT / "tests/console/roslib_client.mjs"
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    command = [str(shutil.which("node", path=path)), str(client), str(ROOT / "console"), str(PORT)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=50)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert "/base" in told["nodes"]
    assert "/go_to" in told["actions"]
    assert told["raw"] == ["std_msgs/Header header", "string child_frame_id"]
    assert set(told["decoded"]) == {"linear", "angular"}
    assert (told["speed"], told["missing"], "/base:max_speed" in told["names"]) == (0.5, None, True)
    assert told["cbor"] == told["png"] == ["base_footprint", 36]
    assert told["fed_back"]
    assert "there is no action '/nothing'" in told["refused"]
    assert told["statuses"] == [1, 3]  # active, succeeded
    assert told["canceled"] == 2
    assert told["bell"] == {"success": True, "message": "ding"}
    assert (told["greeted"]["error_code"], told["recoveries"]) == (3, 7)
    assert '"error_code":4' in told["unwanted"]["said"]


async def at_foxglove() -> ClientConnection:
    """Return a connection as soon as it is served."""
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            return await Foxglove.at(FOXGLOVE)
        except OSError:
            if time.monotonic() > deadline:
                raise
            await asyncio.sleep(0.1)


def test_foxglove_sees_topics_calls_services_and_sets_parameters_but_does_not_drive(robot: Robot) -> None:
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")

    async def talk() -> None:
        async with await at_foxglove() as socket_:
            client = Foxglove(socket_)
            await client.knows("/battery_level", "/robot_description", "/set_battery_level", "/battery/get_parameters")
            level = client.offered["/battery_level"]
            assert (level["encoding"], level["schemaName"]) == ("cdr", "std_msgs/msg/Float32")
            assert "float32 data" in level["schema"]
            service = client.offered["/set_battery_level"]
            request = struct.pack("<BIII3s", 2, service["id"], 1, 3, b"cdr") + b"\x00\x01\x00\x00"
            await socket_.send(request + struct.pack("<f", 60.0))
            assert (await client.gets(3))[1:5] == struct.pack("<I", service["id"])
            await client.says("subscribe", subscriptions=[{"id": 5, "channelId": level["id"]}])
            assert 50 < struct.unpack("<f", (await client.gets(1))[-4:])[0] <= 60
            model = {"id": 6, "channelId": client.offered["/robot_description"]["id"]}
            async with await at_foxglove() as other_socket:
                for each in (client, Foxglove(other_socket)):
                    await each.says("subscribe", subscriptions=[model])
                    while (await each.gets(1))[1:5] != struct.pack("<I", 6):
                        pass
            await client.says("setParameters", parameters=[{"name": "/battery.runtime", "value": 130}], id="a")
            (runtime,) = (await client.gets("parameterValues"))["parameters"]
            assert runtime["value"] == 130
            await client.says("getParameters", parameterNames=[], id="b")
            names = [each["name"] for each in (await client.gets("parameterValues"))["parameters"]]
            assert {"/battery.runtime", "/base.max_speed"} <= {*names}
            await client.says("subscribeParameterUpdates", parameterNames=["/battery.runtime"])
            async with connect(f"ws://{HOST}/rosbridge") as page:
                change = {"name": "runtime", "value": {"type": 3, "double_value": 120.0}}
                await Browser(page).calls("/battery/set_parameters", parameters=[change])
            (runtime,) = (await client.gets("parameterValues"))["parameters"]
            assert (runtime["name"], runtime["value"]) == ("/battery.runtime", 120)
            for number, kind in enumerate(("Bool", "Int8")):  # the name is free for another type
                ghost = {"id": number, "topic": "/ghost", "encoding": "cdr", "schemaName": f"std_msgs/msg/{kind}"}
                await client.says("advertise", channels=[ghost])
                await socket_.send(struct.pack("<BI", 1, number) + b"\x00\x01\x00\x00\x01")
                await client.knows("/ghost")
                await client.says("unadvertise", channelIds=[number])
                seen = client.offered.pop("/ghost")
                assert seen["schemaName"] == ghost["schemaName"]
                assert (await client.gets("unadvertise"))["channelIds"] == [seen["id"]]
            wrong = {"encoding": "cdr", "schemaName": "geometry_msgs/msg/Twist"}
            for number, spelling in enumerate((TELEOP, TELEOP.lstrip("/"))):
                await client.says("advertise", channels=[{"id": number, "topic": spelling, **wrong}])
                assert "which knows who drives" in (await client.gets("status"))["message"]
            for number, spelling in enumerate((f"/{TELEOP}", f"{TELEOP}/", "~/x"), 10):
                await client.says("advertise", channels=[{"id": number, "topic": spelling, **wrong}])
                assert "is not a ROS name" in (await client.gets("status"))["message"]
            await client.says("advertise", channels=[{"id": 2, "topic": "/odom", **wrong}])
            assert "it is of the type 'nav_msgs/msg/Odometry'" in (await client.gets("status"))["message"]

    asyncio.run(talk())


def test_a_cut_socket_stops_the_robot_at_once(robot: Robot) -> None:
    with Commands(robot) as commands:

        async def drive(browser: Browser) -> None:
            assert (await browser.calls("/console/drive", take=True, name="Anna"))["success"]
            for _ in range(5):
                await browser.sends("publish", topic=TELEOP, msg={"linear": {"x": 7}})
                await asyncio.sleep(0.1)
            commands.until(0.25)
            browser.socket.transport.abort()

        browse(drive)
        cut = time.monotonic()
        assert commands.until(0.0) - cut < 0.3
    assert [speed for _, speed in commands.got].count(0.0) == 1


@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")
def test_the_page_drives_the_robot_and_shows_its_world_at_its_time(robot: Robot) -> None:
    if not console.is_built():
        pytest.skip("the page cannot be built here")
    complaints: list[str] = []
    with Commands(robot) as commands, chromium() as browser:
        page = browser.new_page()
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(f"http://{HOST}/")
        expect(page.locator(".connection")).to_have_text("Connected", timeout=PATIENCE * 1000)
        page.fill("#name", "Ada")
        page.keyboard.press("Enter")
        page.keyboard.down("Shift")
        page.keyboard.down("ArrowUp")
        expect(page.locator(".lease")).to_contain_text("You are driving", timeout=PATIENCE * 1000)
        deadline = time.monotonic() + PATIENCE
        while not any(speed > 0 for _, speed in commands.got) and time.monotonic() < deadline:
            page.wait_for_timeout(20)
        assert 0 < max(speed for _, speed in commands.got) <= 0.25
        page.keyboard.up("Shift")
        page.wait_for_timeout(500)
        assert commands.got[-1][1] == 0.0
        assert complaints == []
        page.close()
        page = browser.new_page()
        page.goto(f"http://{HOST}/#model")
        scene = page.locator(".scene")
        expect(scene).to_have_attribute("data-world", "1", timeout=PATIENCE * 1000)
        expect(scene).to_have_attribute("data-time", re.compile("."))
        expect(scene).to_have_attribute("data-place", re.compile(r"\[.*,.*,.*\]"))
        seen = time.monotonic() - float(scene.get_attribute("data-time") or 0)
        assert UP[0] < seen < UP[1] + 0.5  # where robot time began


def test_a_goal_that_another_connection_sent_is_canceled(robot: Robot) -> None:
    async def drive(browser: Browser) -> None:
        status = {"topic": "/go_to/_action/status", "type": "action_msgs/msg/GoalStatusArray"}
        away = {"pose": {"header": {"frame_id": "map"}, "pose": {"position": {"x": 40.0}, "orientation": {"w": 1.0}}}}
        goal = {"action": "/go_to", "action_type": "nav2_msgs/action/NavigateToPose", "args": away}
        await browser.sends("send_action_goal", id="far", **goal)
        async with connect(f"ws://{HOST}/rosbridge") as socket:
            other = Browser(socket)
            await other.sends("subscribe", **status)
            running: list[dict[str, Any]] = []  # beside goals of others that have ended
            while not running:
                running = [one for one in (await other.next("publish"))["msg"]["status_list"] if one["status"] == 2]
            info = {"goal_id": running[-1]["goal_info"]["goal_id"]}
            answer = await other.calls("/go_to/_action/cancel_goal", goal_info=info)
            assert answer["return_code"] == 0
        assert (await browser.next("action_result"))["status"] == 5

    browse(drive)


def test_silence_stops_the_robot_and_frees_the_lease(robot: Robot) -> None:
    with Commands(robot) as commands:

        async def drive(browser: Browser) -> None:
            assert (await browser.calls("/console/drive", take=True, name="Anna"))["success"]
            await browser.sends("publish", topic=TELEOP, msg={"linear": {"x": 0.125}})
            sent = time.monotonic()
            assert 0.4 < await asyncio.to_thread(commands.until, 0.0) - sent < 0.9
            assert (await browser.calls("/console/drive", take=True, name="Ben"))["success"]
            await browser.sends("subscribe", topic="/console/windows/drive")
            assert (await browser.next("publish"))["msg"] == {"answer": {"holder": "Ben"}}

        browse(drive)


def test_anyone_stops_and_releases_the_robot(robot: Robot) -> None:
    async def stop(browser: Browser) -> None:
        assert (await browser.calls("/console/stop"))["success"]
        assert robot.told("ps")["stop"]
        assert (await browser.calls("/console/release"))["success"]
        assert not robot.told("ps")["stop"]
        assert not (await browser.calls("/console/release"))["success"]

    browse(stop)


def test_the_editor_of_missions_answers_from_a_process_of_its_own(robot: Robot) -> None:
    async def ask(browser: Browser) -> None:
        answer = await browser.calls("/console/mission/read", mission="patrol")
        assert answer == {"success": False, "message": "the robot has no mission 'patrol'", "answer": None}

    browse(ask)


def test_a_slow_reader_delays_nobody(robot: Robot) -> None:
    async def run() -> None:
        async with connect(f"ws://{HOST}/") as slow, connect(f"ws://{HOST}/") as fast:
            await slow.send(json.dumps({"op": "subscribe", "topic": "/odom"}))
            reader = Browser(fast)
            await reader.sends("subscribe", topic="/odom")
            slow.transport.pause_reading()
            times = []
            for _ in range(60):
                await reader.next("publish")
                times.append(time.monotonic())
            gaps = [later - earlier for earlier, later in pairwise(times)]
            assert max(gaps) < 0.5  # at 50 Hz
            slow.transport.abort()

    asyncio.run(run())


async def floods(browser: Browser) -> None:
    await browser.socket.send(" " * (20 * 1024 * 1024))
    await browser.next("status")


def test_connections_that_ask_nothing_take_no_more_than_their_share(robot: Robot) -> None:
    async def looks(browser: Browser) -> None:
        with ExitStack() as held:
            for _ in range(MOST_CONNECTIONS + 50):
                held.enter_context(socket.create_connection(("127.0.0.1", PORT), PATIENCE)).sendall(
                    b"GET / HTTP/1.1\r\n"
                )
            assert (await browser.calls("/rosapi/get_time"))["time"]
            with socket.create_connection(("127.0.0.1", PORT), PATIENCE) as late, suppress(ConnectionError):
                late.sendall(b"GET /config HTTP/1.1\r\nHost: " + HOST.encode() + b"\r\n")
                assert late.recv(1) == b""  # it is one too many

    browse(looks)
    assert get("/")[0] == 200


def test_bad_frames_close_at_most_their_own_connection(robot: Robot) -> None:
    async def talk(browser: Browser) -> None:
        for frame in ("{", "7", '{"op":' * 10_000, b"\x00\xff", "[" * 100_000, " " * (9 * 1024 * 1024)):
            await browser.socket.send(frame)
            assert (await browser.next("status"))["level"] == "error"
        with pytest.raises(websockets.ConnectionClosed):
            await floods(browser)

    browse(talk)
    assert get("/console/config")[0] == 200


@pytest.mark.soak
def test_a_place_is_moved_in_the_file_of_the_robot_that_runs(robot: Robot) -> None:
    before = robot.file.read_text(encoding="utf-8")

    async def edit(browser: Browser) -> None:
        told = (await browser.calls("/console/robot/look", subject="places", changes=[]))["answer"]
        first = told["entries"][0]
        path = ["places", first["name"]]
        changes = [{"op": "set", "path": path, "values": {"x": 1.25}}]
        given = {"subject": "places", "changes": changes, "hashes": told["hashes"]}
        trial = (await browser.calls("/console/robot/save", dry_run=True, **given))["answer"]
        assert [line[0] for line in trial["diff"]].count("+") == 1
        assert robot.file.read_text(encoding="utf-8") == before
        assert (await browser.calls("/console/robot/save", **given))["success"]
        refused = await browser.calls("/console/robot/save", **given)
        assert "has changed on disk" in refused["message"]
        found = (await browser.calls("/console/robot/compare"))["answer"]
        assert {one["name"]: one["fate"] for one in found["components"]} == {
            "charger": "restarted",
            "gateway": "changed live",
        }
        assert (await browser.calls("/console/robot/apply", generation=found["generation"]))["success"]
        assert (await browser.calls("/console/robot/compare"))["answer"]["is_empty"]
        assert json.loads(get("/console/config")[1])["places"]["dock"]["x"] == 1.25
        await browser.sends("subscribe", topic="/console/windows/config")
        assert (await browser.next("publish"))["msg"]["answer"]["places"]["dock"]["x"] == 1.25
        assert (await browser.calls("/console/robot/revert", generation=found["generation"]))["success"]
        assert not (await browser.calls("/console/robot/apply", generation=99))["success"]
        built = (await browser.calls("/console/robot/look", subject="include", changes=[]))["answer"]
        assert "<robot" in built["model"]
        offered = (await browser.calls("/console/robot/palette"))["answer"]
        assert "rbx:parts/xtion.yaml" in [part["file"] for part in offered]

    try:
        browse(edit)
        after = robot.file.read_text(encoding="utf-8")
        changed = [line for line in after.splitlines() if line not in before.splitlines()]
        assert len(changed) == 1
        assert "1.25 m" in changed[0]
        assert len(after.splitlines()) == len(before.splitlines())
    finally:
        robot.file.write_text(before, encoding="utf-8")
