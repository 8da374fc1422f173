"""A program that floods a robot with what is asked: `python -m tests.faults.asker ROUTER WHAT SECONDS`.

It asks as fast as it can, with at most `OPEN` questions that wait for an answer, and prints how many it has asked.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from functools import partial
from typing import Any

from rbxcompose.bus.names import ActionNames, Attachment, data_key, dds_type
from rbxcompose.bus.tokens import EntityKind, NodeToken
from rbxcompose.bus.transport import LONGEST_WAIT, Closable, TransportReply
from rbxcompose.bus.wire import WIRE_PROFILES, ros_qos
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.geometry_msgs import PoseStamped, Twist
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.rbxcompose_msgs import SetBatteryLevel
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.types import Message, Service
from rbxcompose.msgs.unique_identifier_msgs import UUID
from rbxcompose.sdk.ports import Qos

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
    """Begin, go on until the time is over, and say how much it was."""
    transport = ZenohTransport(open_peer(router), lambda owner, callback: None)
    sys.stdout.write("it begins\n")
    sys.stdout.flush()
    count = (announce if what == "tokens" else partial(ask, what=what))(transport, time.monotonic() + seconds)
    sys.stdout.write(f"{count}\n")
    sys.stdout.flush()
    transport.close()


def announce(transport: ZenohTransport, until: float) -> int:
    """Appear as ever new publishers and subscribers of the commands, and disappear again."""
    there: deque[Closable] = deque()
    qos = WIRE_PROFILES["jazzy"].qos_text(ros_qos(Qos.COMMAND))
    count = 0
    while time.monotonic() < until:
        count += 1
        node = NodeToken(0, transport.session, count, f"nobody_{count}", "")
        kind = (EntityKind.PUBLISHER, EntityKind.SUBSCRIPTION)[count % 2]
        there.append(transport.announce(node.endpoint_key(kind, 1, "/cmd_vel", dds_type(Twist.TYPE), Twist.HASH, qos)))
        if len(there) > OPEN:
            there.popleft().close()
    return count


def ask(transport: ZenohTransport, until: float, what: str) -> int:
    """Ask as fast as it can."""
    waiting: set[int] = set()
    asked = 0

    def ended(number: int, answer: TransportReply) -> None:
        waiting.discard(number)

    while time.monotonic() < until:
        if len(waiting) > OPEN:
            time.sleep(0.001)
            continue
        asked += 1
        waiting.add(asked)
        key, payload = question(what, asked)
        transport.ask(
            key, payload, Attachment(asked, 0, GID).encode(), partial(ended, asked), of_all=True, within=LONGEST_WAIT
        )
    return asked


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
