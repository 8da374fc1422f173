"""A program that floods a robot with what is asked: `python -m tests.faults.asker ROUTER WHAT SECONDS`.

It asks as fast as it can, with at most `OPEN` questions that wait for an answer, and prints how many it has asked.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from typing import Any

from rbxcompose.bus.attachment import Attachment
from rbxcompose.bus.names import ActionNames, data_key
from rbxcompose.bus.transport import TransportReply
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.rbxcompose_msgs import SetBatteryLevel
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.types import Message, Service
from rbxcompose.msgs.unique_identifier_msgs import UUID

OPEN = 1000
GID = bytes(range(16))
NOWHERE = NavigateToPose.Goal(pose=PoseStamped(header=Header(frame_id="nowhere")))  # the driver refuses it


def requested(name: str, service: type[Service[Any, Any]], request: Message) -> tuple[str, bytes]:
    return data_key(0, name.lstrip("/"), service.TYPE, service.HASH), encode(request)


def question(what: str, number: int) -> tuple[str, bytes]:
    """A key and what is asked there."""
    if what == "goals":
        id_ = UUID(number.to_bytes(16, "little"))
        request = NavigateToPose.SendGoal.Request(goal_id=id_, goal=NOWHERE)
        return requested(ActionNames.of("go_to").send_goal, NavigateToPose.SendGoal, request)
    if what == "requests":
        return requested("set_battery_level", SetBatteryLevel, SetBatteryLevel.Request(value=-1.0))
    return "rbx/**", b""


def main(router: str, what: str, seconds: float) -> None:
    """Ask until the time is over."""
    transport = ZenohTransport(open_peer(router), lambda owner, callback: None)
    waiting: set[int] = set()
    sys.stdout.write("it begins\n")
    sys.stdout.flush()
    began, asked = time.monotonic(), 0

    def ended(number: int, answer: TransportReply) -> None:
        waiting.discard(number)

    while time.monotonic() - began < seconds:
        if len(waiting) > OPEN:
            time.sleep(0.001)
            continue
        asked += 1
        waiting.add(asked)
        key, payload = question(what, asked)
        transport.ask(key, payload, Attachment(asked, 0, GID).encode(), partial(ended, asked))
    sys.stdout.write(f"{asked}\n")
    sys.stdout.flush()
    transport.close()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
