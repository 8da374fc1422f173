"""Changes to a robot on two hosts for real: over ssh between network namespaces, one host after the other."""

from __future__ import annotations

import pytest

from tests.systems.namespaces import NotPermittedError
from tests.systems.patrol import ADDRESSES, PatrolOnHosts
from tests.systems.sshd import serve, wrapper


@pytest.mark.soak
@pytest.mark.timeout(200)
def test_all_hosts_change_or_none_unless_in_part(patrol: PatrolOnHosts) -> None:
    try:
        config = serve(patrol.hosts, "r")
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    patrol.reach_by_ssh("r", wrapper(patrol.hosts.folder))
    patrol.change_mission("repeat: $rounds", "repeat: 1000")
    robot = patrol.hosts.folder / "robots/robot.yaml"

    def run(*words: str, code: int = 0) -> str:
        output, _ = (process := patrol.rbx("d", *words, "--ssh-config", str(config))).communicate(timeout=80)
        assert process.returncode == code, output
        return output

    def change(before: str, after: str) -> None:
        robot.write_text(robot.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")

    def value(component: str, name: str) -> str:
        return run("param", "get", component, name, "--robot", "system.yaml")

    run("up", "system.yaml", "-d")
    change("warn: 50 %", "warn: 40 %")  # of the battery, on the host `r`
    change("        speed: 0.3 m/s\n", "        speed: 0.2 m/s\n")  # of `go_to`, on the host `d`
    run("apply", "system.yaml", "--dry-run")
    assert ("50 %" in value("battery", "warn"), "0.3 m/s" in value("go_to", "speed")) == (True, True)
    run("apply", "system.yaml", "--yes")
    assert ("40 %" in value("battery", "warn"), "0.2 m/s" in value("go_to", "speed")) == (True, True)
    change("        speed: 0.2 m/s\n", "        speed: 0.25 m/s\n")
    patrol.hosts.cut("r")
    assert "RBX6113" in run("apply", "system.yaml", "--yes", code=1)
    assert "0.2 m/s" in value("go_to", "speed")
    assert "RBX6113" in run("apply", "system.yaml", "--yes", "--partial", code=1)
    assert "0.25 m/s" in value("go_to", "speed")
    patrol.hosts.mend("r")
    patrol.wait_until(lambda: all(map(patrol.is_active, ADDRESSES)))
    run("down", "system.yaml")


@pytest.mark.soak  # `tests/runtime/test_other_hosts` tells when a robot waits for another host
@pytest.mark.timeout(150)
def test_the_robot_starts_without_an_optional_host_which_joins_later(patrol: PatrolOnHosts) -> None:
    patrol.change_system("  d: {}", "  d: {optional: true}")
    patrol.change_system("on: d\n    place: {base: r, battery: r}", "on: r\n    place: {charger: d}")
    patrol.change_mission("repeat: $rounds", "repeat: 1000")
    patrol.up("r")
    patrol.watch()
    patrol.wait_until(lambda: patrol.has_moved_since(0.0))
    assert patrol.state("d") is None
    patrol.up("d")
    patrol.wait_until(lambda: patrol.is_active("d"))
    patrol.wait_until(lambda: "host 'd' is there" in patrol.log("r"))
