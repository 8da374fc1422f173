"""A process in ROS's Python that answers what nobody can read; a stand-in for it, so no ROS 2 is needed."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.bus.zenoh_session import open_router
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.domains.programs.bridge import link
from rbxcompose.domains.programs.bridge.ends import ProgramEnd
from rbxcompose.domains.programs.bridge.ros_bridge import RosBridge
from rbxcompose.domains.programs.sections.ros2 import RosInstallation
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.component import BusAddress
from tests.console.test_gateway_live import free_port

STAND_IN = """#!{python}
import json, socket, sys, time
sys.path.insert(0, {folder!r})
import link
wire = link.Link(socket.socket(fileno=int(sys.argv[2])))
wire.event(ready="stand-in")
for frame in wire.frames():
    if frame.kind == link.EVENT:
        wire.event(done=[end["channel"] for end in json.loads(frame.payload).get("add", ())])
    elif frame.kind == link.REQUEST:
        wire.send(frame.channel, link.RESPONSE, b"no CDR", frame.number)
"""


@pytest.fixture
def address() -> Iterator[BusAddress]:
    router = f"tcp/127.0.0.1:{free_port()}"
    session = open_router(router)
    yield BusAddress("robot", router, 0, "", "jazzy")
    session.close()  # type: ignore[no-untyped-call]


@pytest.fixture
def bridge(address: BusAddress, tmp_path: Path) -> Iterator[RosBridge]:
    python = tmp_path / "python"
    python.write_text(STAND_IN.format(python=sys.executable, folder=str(Path(link.__file__).parent)))
    python.chmod(0o755)
    made = RosBridge(RosInstallation(str(python), dict(os.environ), 0, True), address)
    yield made
    made.close()


def reply_of(service: str, address: BusAddress) -> Reply[Trigger.Response]:
    replies: list[Reply[Trigger.Response]] = []
    with Guest(BusPlace(address.router), stays=True) as guest:
        client = guest.bus().client("test", service, Trigger)
        guest.run(lambda: client.is_available, 5.0)
        client(Trigger.Request(), replies.append)
        guest.run(lambda: bool(replies), 5.0)
    return replies[0]


def test_a_response_that_cannot_be_read_fails_that_request_and_the_bridge_goes_on(
    bridge: RosBridge, address: BusAddress
) -> None:
    channels = bridge.add("somebody", [ProgramEnd("serves", "/beep", Trigger)])
    for _ in range(2):
        assert "no little-endian CDR header" in str(reply_of("/beep", address))
        assert any("CDR" in text for text in bridge.problems(channels))
    assert bridge.hear() == ""
