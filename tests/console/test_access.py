"""Who may do what by the console."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.console.access import (
    OF_PARAMETERS,
    Door,
    OperationTarget,
    Role,
    needed,
    own_secret,
    renew_secret,
    role_of,
    secret_path,
    token_of,
)
from rbxcompose.domains.console.commands.console import network_address
from rbxcompose.msgs.types import Service
from rbxcompose.runtime.process_group.parameters import INTERFACES
from tests.loops import for_all

ROLES = [Role.VIEW, Role.OPERATE, Role.CONFIGURE]
SECRET = bytes(32)


@for_all(
    "target, least",
    [
        (OperationTarget("subscribe", "/odom"), Role.VIEW),
        (OperationTarget("subscribe", "/arm/state"), Role.VIEW),
        (OperationTarget("publish", "/cmd_vel"), Role.OPERATE),
        (OperationTarget("publish", "/arm/goal"), Role.CONFIGURE),
        (OperationTarget("publish", "/cmd_vel", others=("/arm/cmd_vel",)), Role.CONFIGURE),
        (OperationTarget("call_service", "/console/stop"), Role.VIEW),
        (OperationTarget("call_service", "/console/release"), Role.OPERATE),
        (OperationTarget("call_service", "/rosapi/topics"), Role.VIEW),
        (OperationTarget("call_service", "/rosapi/topics", type="std_srvs/srv/Trigger"), Role.OPERATE),
        (OperationTarget("call_service", "/rosapi/set_param"), Role.CONFIGURE),
        (OperationTarget("call_service", "/dock", type="std_srvs/srv/Trigger"), Role.OPERATE),
        (OperationTarget("call_service", "/get_parameters", type="std_srvs/srv/Trigger"), Role.OPERATE),
        (OperationTarget("call_service", "/arm/home", type="std_srvs/srv/Trigger"), Role.CONFIGURE),
        (OperationTarget("send_action_goal", "/go_to"), Role.OPERATE),
        (OperationTarget("advertise_service", "/x"), Role.CONFIGURE),
        (OperationTarget("auth"), Role.NOBODY),
        (OperationTarget("who knows"), Role.OPERATE),
    ],
)
def test_each_operation_and_name_has_its_least_role(target: OperationTarget, least: Role) -> None:
    assert needed(target, {"/arm/*": Role.CONFIGURE}) is least


def test_who_may_set_parameters_is_said_of_each_service_that_a_component_has_for_them() -> None:
    served = [each.TYPE for each in INTERFACES if issubclass(each, Service)]
    assert sorted(OF_PARAMETERS) == sorted(served)
    sets = {name for name in served if name.rpartition("/")[2].startswith(("Set", "Change"))}
    assert {name for name, role in OF_PARAMETERS.items() if role is Role.CONFIGURE} == sets


@pytest.mark.parametrize("role", ROLES)
def test_a_token_gives_its_role_at_its_robot_only(role: Role) -> None:
    token = token_of(SECRET, "digger", role)
    assert role_of(SECRET, "digger", token) is role
    assert role_of(SECRET, "patrol", token) is Role.NOBODY
    assert role_of(bytes(31) + b"x", "digger", token) is Role.NOBODY


@given(st.text())
def test_no_other_text_gives_a_role(text: str) -> None:
    assert role_of(SECRET, "digger", text) is Role.NOBODY


def test_a_secret_stays_until_it_is_renewed_and_nobody_else_reads_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    first = own_secret()
    assert own_secret() == first
    assert len(first) == 32
    assert stat.S_IMODE(secret_path().stat().st_mode) == 0o600
    renew_secret()
    assert own_secret() != first
    assert os.listdir(secret_path().parent) == [secret_path().name]


def test_a_secret_that_could_be_guessed_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    own_secret()
    secret_path().write_bytes(b"")
    with pytest.raises(OSError, match="damaged"):
        own_secret()
    renew_secret()
    assert len(own_secret()) == 32


@for_all(
    "host, origin, on_lan, on_machine",
    [
        ("127.0.0.1:8080", "", True, True),
        ("localhost:8080", "http://localhost:8080", True, True),
        ("localhost:8080", "http://127.0.0.1:8080", True, True),
        ("192.168.1.7:8080", "http://192.168.1.7:8080", True, False),
        ("192.168.1.7:8080", "http://192.168.1.8:8080", False, False),
        ("robot.local:8080", "http://robot.local:8080", True, False),
        ("evil.example:8080", "http://evil.example:8080", False, False),
        ("127.0.0.1:8080", "http://evil.example", False, False),
        ("127.0.0.1:8080", "https://127.0.0.1:8080", False, False),
        ("127.0.0.1:8080", "null", False, False),
        ("127.0.0.1:9999", "", False, False),
        ("127.0.0.1:8080", "http://old.page:8181", True, True),
        ("192.168.1.7:8080", "http://192.168.1.7:8190", True, False),
        ("192.168.1.7:8080", "http://192.168.1.7:8191", False, False),
        ("192.168.1.7:8080", "http://192.168.1.9:8190", False, False),
        ("192.168.1.7:8080", "http://192.168.1.9", True, False),
        ("localhost:8080", "http://127.0.0.1:8190", True, True),
        ("127.0.0.1:8080", "http://evil.example:8190", False, False),
        ("", "", False, False),
    ],
)
def test_only_own_pages_and_named_ones_pass(host: str, origin: str, *, on_lan: bool, on_machine: bool) -> None:
    fleet = (":8080", ":8190", "192.168.1.9:80")
    more = {"names": ("robot.local",), "origins": frozenset({"http://old.page:8181"}), "fleet": fleet}
    assert Door(8080, is_lan=True, **more).lets_in(host, origin) is on_lan  # type: ignore[arg-type]
    assert Door(8080, is_lan=False, **more).lets_in(host, origin) is on_machine  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["192.168.1.7", "robot.local", "localhost", "evil.example", "[::1]", "fe80::1%; *"])
def test_a_page_reaches_its_system_by_the_name_by_which_it_was_opened(name: str) -> None:
    door = Door(8080, is_lan=True, names=("robot.local",), fleet=("192.168.1.9:80", ":8190"))
    reached = {f"ws://{name}:8190"} if name in ("192.168.1.7", "robot.local", "localhost") else set()
    assert {*door.sources(f"{name}:8080").split()} - {"ws://192.168.1.9:80"} == {"'self'"} | reached


def test_at_the_port_of_the_web_a_browser_names_no_port() -> None:
    assert Door(80, is_lan=False).lets_in("localhost", "http://localhost")


def test_a_machine_has_an_address() -> None:
    assert network_address().count(".") == 3
