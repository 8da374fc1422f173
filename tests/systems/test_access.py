"""Access between hosts is computed from the ports, and Zenoh enforces it by certificates."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path

import pytest

from rbxcompose.bus.access_control import AllowedHost, access_control
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.transport import Arrival
from rbxcompose.bus.zenoh_session import RouterLink, open_router, tls_settings
from rbxcompose.compiler.systems.certificates import common_name, make_authority, make_certificate, missing, tls_of
from rbxcompose.compiler.systems.share import access_of
from rbxcompose.sdk.ports import Qos
from tests.systems.test_links import free_port, transport, until
from tests.systems.test_shares import ROBOT, SYSTEM

ALLOWED, DENIED = "0/cmd_vel/type/hash", "0/odom/type/hash"


def test_a_host_may_give_and_take_what_its_components_declare_and_nothing_else() -> None:
    desk = access_of(SYSTEM, ROBOT, "robot", "desk")
    robot = access_of(SYSTEM, ROBOT, "desk", "robot")
    assert (robot.gives, robot.takes) == (desk.takes, desk.gives)
    gives, takes = (tuple(name for name in names if "parameter" not in name) for names in (desk.gives, desk.takes))
    assert (gives, takes) == (("/cmd_vel",), ("/battery_level", "/set_battery_level", "/tf"))
    assert "/battery/set_parameters" in desk.takes
    assert "/go_to/set_parameters" in desk.gives


@pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")
@pytest.mark.parametrize("protocol", ["tls", "quic"])
def test_a_message_that_a_host_may_not_send_does_not_arrive_and_one_that_it_may_does(
    protocol: str, tmp_path: Path
) -> None:
    make_authority(tmp_path, "lab")
    settings = {}
    for host in ("robot", "desk"):
        make_certificate(tmp_path, "lab", host, "127.0.0.1")
        files = tls_of(tmp_path, host, "mtls")
        assert missing(files) == []
        settings[host] = tls_settings(files.authority, files.certificate, files.key, mutual=True)
    link = f"{protocol}/127.0.0.1:{free_port()}"
    here, there = tcp_endpoint(free_port()), tcp_endpoint(free_port())
    allowed = AllowedHost(common_name("lab", "desk"), ("/cmd_vel",), (), ())
    access = access_control("lab", 0, [allowed])
    robot = open_router(here, RouterLink((link,), (), settings["robot"], access))
    desk = open_router(there, RouterLink((), (link,), settings["desk"]))
    base, steering, local = transport(here), transport(there), transport(here)
    got: Counter[str] = Counter()

    def count(name: str) -> None:
        def take(arrival: Arrival) -> None:
            got[f"{name} {bytes(arrival.payload).decode()}"] += 1

        base.subscribe(name, Qos.EVENT, take)

    for key in (ALLOWED, DENIED):
        count(key)
    senders = [(who, key, label) for who, label in ((steering, "desk"), (local, "here")) for key in (ALLOWED, DENIED)]
    publishers = [(who.publisher(key, Qos.EVENT), label.encode()) for who, key, label in senders]

    def is_heard() -> bool:
        for publisher, label in reversed(publishers):  # what is denied is sent before what is allowed
            publisher.put(label, b"")
        return all(got[f"{key} {label}"] > 2 for key, label in ((ALLOWED, "desk"), (ALLOWED, "here"), (DENIED, "here")))

    try:
        until(is_heard)
        assert got[f"{DENIED} desk"] == 0
    finally:
        for each in (base, steering, local, desk, robot):
            each.close()
