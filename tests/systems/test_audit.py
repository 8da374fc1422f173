"""What others can reach, and whether they will accept a certificate, is told before they try."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from rbxcompose.commands.main import main
from rbxcompose.compiler.plan.model import LinkTls
from rbxcompose.compiler.systems.certificates import common_name, make_authority, make_certificate, tls_of
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.compiler.systems.share import NETWORK, ReachableKey, listeners, reachable_keys
from rbxcompose.runtime.folder import ComponentState, RobotFolder, RobotState
from rbxcompose.runtime.processes import Process, boot_id
from rbxcompose.runtime.supervision.request_handler import described
from rbxcompose.tools.commands.security import certificate_findings
from tests.systems.test_shares import SYSTEM

needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")


def test_with_certificates_a_key_is_for_the_hosts_that_declare_it_and_else_for_everybody() -> None:
    def keys(security: str) -> dict[tuple[str, str], ReachableKey]:
        return {(key.host, key.name): key for key in reachable_keys(replace(SYSTEM, security=security))}

    open_, closed = keys("tls"), keys("mtls")
    assert closed["robot", "/cmd_vel"].written_by == ("host 'desk'",)
    assert ("desk", "/cmd_vel") not in closed
    assert closed["robot", "/set_battery_level"].written_by == ("host 'desk'",)
    assert closed["desk", "/battery_level"].written_by == ("host 'robot'",)
    assert open_.keys() == closed.keys()
    assert {key.written_by for key in open_.values()} == {(NETWORK,)}
    assert not any(key.is_open for key in closed.values())
    assert not any(listener.is_open for listener in listeners(replace(SYSTEM, security="mtls")))


FLEET = """
rbx: 1
kind: System
name: fleet
hosts: {here: {}}
robots: {cart: {robot: robot.yaml, instances: 2}}
"""
CART = "rbx: 1\nkind: Robot\nname: cart\nconsole: {port: 8190, listen: lan, foxglove: true}\n"


def test_consoles_are_listed_and_of_a_robot_that_is_up_the_ports_that_it_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "robot.yaml").write_text(CART, encoding="utf-8")
    path = tmp_path / "system.yaml"
    path.write_text(FLEET, encoding="utf-8")

    def audited() -> list[str]:
        assert main(["security", "audit", str(path)]) == 0
        return [line for line in capsys.readouterr().out.splitlines() if line.startswith("here  cart_2  ")]

    router, control, page, foxglove = audited()
    assert router.endswith("  tcp/127.0.0.1:7448  programs of here, no proof asked")
    assert "  http://*:8191  machines of the network, for the console and rosbridge, the token of a role" in page
    assert foxglove.endswith("  ws://127.0.0.1:8765  programs of here, for Foxglove, no proof asked")
    folder, plan = RobotFolder.of("cart_2"), compile_system(str(path), environment={}).robots["cart_2"].plan
    (gateway,) = [one for one in plan.instances if one.type == "gateway"]
    local = replace(gateway, config=gateway.config.model_copy(update={"listen": "local", "foxglove": 0}))
    up = [ComponentState("gateway", "gateway", "active", "gateway", None, 0)]
    folder.make()
    supervisor = Process.of(os.getpid())
    folder.write_state(RobotState("cart_2", "robot.yaml", supervisor, {}, up, "tcp/127.0.0.1:7449", boot_id()))
    monkeypatch.setattr(Process, "is_titled", lambda self, prefix: True)
    monkeypatch.setattr("rbxcompose.tools.commands.security.ask", lambda folder, request: (described(local),))
    assert audited() == [
        router.replace("7448", "7449"),
        control,
        "here  cart_2  http://127.0.0.1:8191  programs of here, for the console and rosbridge, no proof asked",
    ]


def certified(folder: Path, host: str = "desk", days: int = 100) -> LinkTls:
    """Return a new certificate of a system `lab` that is valid for some days."""
    make_authority(folder, "lab")
    make_certificate(folder, "lab", host, None, days=days)
    return tls_of(folder, host, "mtls")


@needs_openssl
def test_a_certificate_is_examined_as_the_other_hosts_will(tmp_path: Path) -> None:
    fine = certified(tmp_path / "one")
    files = {
        "": fine,
        "RBX6117": replace(fine, key="/nowhere"),
        "RBX6143: 'other.lab'": certified(tmp_path / "one", "other"),
        "RBX6143: expired": certified(tmp_path / "two", days=-1),
        "RBX6143: issuer": replace(fine, authority=certified(tmp_path / "three").authority),
        "RBX6143: belong together": replace(fine, key=certified(tmp_path / "four").key),
        "RBX6144: in 20 days": certified(tmp_path / "five", days=20),
    }
    for expected, tls in files.items():
        code, _, words = expected.partition(": ")
        found = [f"{one.code}: {one.message}" for one in certificate_findings(tls, common_name("lab", "desk"), "x")]
        assert [text[: len(code)] for text in found] == ([code] if code else []), expected
        assert all(words in text for text in found), (expected, found)


@needs_openssl
def test_the_command_lists_all_and_tells_of_a_certificate_that_others_will_refuse(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    for folder in ("robots/turtlebot", "missions"):
        shutil.copytree(repository / folder, tmp_path / folder)
    path = tmp_path / "systems/lab.yaml"
    path.parent.mkdir()
    text = (repository / "systems/patrol_two_hosts.yaml").read_text(encoding="utf-8")
    path.write_text(text.replace("name: patrol_two_hosts", "name: lab\nsecurity: mtls"), encoding="utf-8")
    assert main(["security", "audit", str(path)]) == 0
    assert "written, called or answered by host 'desk' and programs there: /cmd_vel" in capsys.readouterr().out
    assert main(["security", "init", str(path)]) == 0
    assert main(["security", "audit", str(path)]) == 0
    made = tmp_path / "config/rbxcompose/systems/lab"
    shutil.copytree(made / "desk", made / "robot", dirs_exist_ok=True)
    assert main(["security", "audit", str(path)]) == 1
    assert "it is that of 'desk.lab'" in capsys.readouterr().err
