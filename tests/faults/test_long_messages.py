"""Whoever sends long messages or random bytes to a robot holds up none of its processes."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.bus.names import Attachment, data_key
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.definitions import FieldShape, attribute, parse_type
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.types import Message
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.log import NAME as LOG
from rbxcompose.sdk.ports import In, Qos
from rbxcompose.sdk.registry import component_type
from tests.conftest import ROOT
from tests.forked import run_command
from tests.soak import rare

ENTRIES = 50_000
RANDOM = 50_000  # [bytes]
PATIENCE = 30.0  # [s]
LONGEST = 0.5  # [s] between two messages of a component that holds joints, sent at 20 Hz or more


def long(kind: type[Message]) -> Message:
    """Return a message whose lists, also those of the messages in it, have very many entries."""
    fields: dict[str, Any] = {}
    for name, text in kind.FIELDS.items():
        type_ = parse_type(text)
        element = registry.message(type_.base) if type_.is_message else None
        if type_.shape is FieldShape.UNBOUNDED:
            entry = element() if element is not None else "joint" if type_.base == "string" else 0
            fields[attribute(name)] = bytes(ENTRIES) if type_.base in ("uint8", "byte", "char") else (entry,) * ENTRIES
        elif type_.shape is FieldShape.SINGLE and element is not None:
            fields[attribute(name)] = long(element)
    return kind(**fields)


def subscribed(plan: Plan) -> Iterator[tuple[str, type[Message], Qos]]:
    """Yield each topic that a component of a robot subscribes to."""
    found = {}
    for instance in plan.instances:
        for name, port in component_type(instance.type).ports(instance.config).items():
            if isinstance(port, In) and port.interface is not None:
                found[instance.topic(name).strip("/"), port.interface] = port.qos
    yield from ((topic, kind, qos) for (topic, kind), qos in found.items())


@pytest.mark.timeout(180)
@pytest.mark.parametrize(
    "robot", ["pi_robot table", *rare(*(path.parent.name for path in ROOT.glob("robots/*/robot.yaml")))]
)
@pytest.mark.soak
def test_no_process_is_held_up_by_a_message(robot: str, tmp_path: Path) -> None:
    robot, *profiles = robot.split()
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}

    def do(*words: str) -> str:
        ran = run_command(words, environment, 60.0)
        return ran.stdout + ran.stderr

    plan = compile_robot(f"robots/{robot}", profiles=profiles, environment={}).plan
    assert plan is not None
    folder = RobotFolder(tmp_path / "rbxcompose" / plan.robot)
    said = do("up", f"robots/{robot}", "-d", *(f"--profile={name}" for name in profiles))
    try:
        state = folder.read_state()
        assert state is not None, said
        assert state.router is not None
        before = dict(state.processes)
        transport = ZenohTransport(open_peer(state.router), lambda owner, callback: None)
        heard: list[float] = []
        held = data_key(0, "joint_states", JointState.TYPE, JointState.HASH)
        transport.subscribe(held, Qos.STATE, lambda arrival: heard.append(time.monotonic()))
        began = time.monotonic()
        source = Attachment(1, time.time_ns(), bytes(16)).encode()
        for topic, kind, qos in subscribed(plan):
            publisher = transport.publisher(data_key(0, topic, kind.TYPE, kind.HASH), qos)
            until = time.monotonic() + PATIENCE
            while not publisher.has_match and time.monotonic() < until:
                time.sleep(0.01)
            for payload in (encode(long(kind)), random.Random(1).randbytes(RANDOM)):
                publisher.put(payload, source)
                time.sleep(0.1)
        time.sleep(2.5)  # a process that is silent for 2 s is killed
        transport.close()
        log = (folder.path / LOG).read_text(encoding="utf-8")
        state = folder.read_state()
        assert state is not None, log
        assert state.processes == before, log
        assert "silent" not in log, log
        gaps = [after - before for before, after in pairwise(heard) if before > began]
        assert max(gaps, default=0.0) < LONGEST
    finally:
        do("down", plan.robot)
