"""What is fuzzed: each target takes any bytes and may raise nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from rbxcompose.base.findings import Report
from rbxcompose.bus.names import AttachmentError, decode_attachment
from rbxcompose.bus.tokens import parse_token
from rbxcompose.commands.formats import renderer
from rbxcompose.compiler.plan.dump import PlanTextError, dump, load
from rbxcompose.manifest.reader import read_text
from rbxcompose.msgs.cdr import HEADER, CdrError, decode
from rbxcompose.msgs.diagnostic_msgs import DiagnosticArray
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav_msgs import Odometry
from tests.console.clients import Room
from tests.properties.random_expressions import Trap, attempt

FILE = "robot.yaml"


def loader(data: bytes) -> None:
    """Read a manifest's text, and write down what is wrong with it."""
    root, findings = read_text(data, FILE)
    assert root is not None or findings
    assert all(finding.span for finding in findings)
    report = Report(list(findings))
    for form in ("text", "json"):
        renderer(form)(report, {FILE: data.decode("utf-8", "replace")}, False)


def expressions(data: bytes) -> None:
    """Read, check and compute an expression."""
    attempt(data.decode("utf-8", "replace"))
    assert not Trap.touched, Trap.touched


def plan(data: bytes) -> None:
    """Read a plan; one that can be read is written down alike."""
    with contextlib.suppress(PlanTextError):
        read = load(data.decode("utf-8", "replace"))
        assert load(dump(read)) == read


def wire(data: bytes) -> None:
    """Read what another process may send: a message, an attachment, a token."""
    for message in (Twist, DiagnosticArray, Odometry):
        with contextlib.suppress(CdrError):
            decode(message, HEADER + data)
    with contextlib.suppress(AttachmentError):
        assert decode_attachment(data).encode() == data
    parse_token(data.decode("utf-8", "replace"))


def rosbridge(data: bytes) -> None:
    """Take what a browser may send: each line is a frame."""
    room = Room()
    client = room.client()
    for frame in data.split(b"\n"):
        client.sends(frame)
        client.gets()
    client.leaves()


TARGETS: dict[str, Callable[[bytes], None]] = {
    "loader": loader,
    "expressions": expressions,
    "plan": plan,
    "rosbridge": rosbridge,
    "wire": wire,
}
