"""A robot on two hosts for real: network namespaces, routers linked router to router, a cable that is pulled."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.soak import Soak
from tests.systems.namespaces import NotPermittedError, TwoHosts
from tests.systems.patrol import ACCELERATION, ADDRESSES, CYCLE, DEADLINE, SPEED, PatrolOnTwoHosts
from tests.systems.sshd import serve, wrapper

LATE = 0.15  # [s] that a loaded machine may hold up what is seen from outside
BRAKED = DEADLINE + 2 * CYCLE + SPEED / ACCELERATION  # [s] from the last command to rest
CUT = 4.0  # [s], longer than the others wait for a sign of life


@pytest.fixture
def patrol(tmp_path: Path) -> Iterator[PatrolOnTwoHosts]:
    try:
        hosts = TwoHosts(tmp_path, ADDRESSES)
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    with hosts:
        yield PatrolOnTwoHosts(hosts)


@pytest.mark.timeout(150)
def test_one_command_starts_shows_stops_and_ends_the_robot_on_all_hosts_over_ssh(patrol: PatrolOnTwoHosts) -> None:
    try:
        config = serve(patrol.hosts, "r")
    except NotPermittedError as reason:
        pytest.skip(str(reason))
    patrol.reach_by_ssh("r", wrapper(patrol.hosts.folder))
    options = ("--ssh-config", str(config))

    def run(*words: str) -> str:
        output, _ = (process := patrol.rbx("d", *words, *options)).communicate(timeout=60)
        assert process.returncode == 0, output
        return output

    patrol.change_system("name: two_hosts", "name: two_hosts\nsecurity: mtls")
    run("security", "init", "system.yaml")
    audit = patrol.rbx("d", "security", "audit", "system.yaml")
    assert audit.wait(20) == 0
    told = run("up", "system.yaml", "-d")
    assert "r | " in told
    patrol.watch()
    patrol.wait_until(lambda: patrol.has_moved_since(0.0))
    shown = run("ps", "system.yaml")
    assert "diff_drive_sim" in shown
    assert "go_to" in shown
    assert patrol.stranger("d") == "refused"
    assert "stopped" in run("stop", "--robot", "system.yaml")
    assert all(state is not None and state.stop is not None for state in map(patrol.state, ADDRESSES))
    assert "is there" in run("logs", "system.yaml")
    run("down", "system.yaml")
    assert (patrol.state("r"), patrol.state("d")) == (None, None)


@pytest.mark.timeout(150)
def test_the_base_stops_when_the_cable_is_pulled_and_the_patrol_succeeds_once_it_is_back(
    patrol: PatrolOnTwoHosts,
) -> None:
    base, desk = patrol.up("r"), patrol.up("d")
    patrol.watch()
    patrol.wait_until(lambda: patrol.has_moved_since(0.0))
    cut = patrol.hosts.cut()
    patrol.wait_until(lambda: bool(patrol.motion()) and patrol.motion()[-1][0] > cut + CUT)
    moving = [at for at, moves in patrol.motion() if moves]
    assert moving[-1] < cut + BRAKED + LATE
    assert "host 'r' does not answer" in patrol.log("d")
    assert "host 'd' does not answer" in patrol.log("r")
    back = patrol.hosts.mend()
    patrol.wait_until(lambda: patrol.has_moved_since(back))
    assert desk.wait(60) == 0
    assert base.wait(20) == 0, "the end of the mission is the end of the robot on all hosts"
    assert "mission patrol: success" in patrol.log("r") + base.communicate()[0]
    assert (patrol.state("r"), patrol.state("d")) == (None, None)


@pytest.mark.timeout(240)
def test_any_process_and_any_host_may_die_and_the_others_go_on(patrol: PatrolOnTwoHosts, soak: Soak) -> None:
    if not soak.is_on:
        pytest.skip("with --soak")
    patrol.change_mission("repeat: $rounds", "repeat: 1000")
    patrol.up("r")
    patrol.up("d")
    patrol.watch()
    patrol.wait_until(lambda: patrol.has_moved_since(0.0))
    for host, process in (("d", "router"), ("r", "router"), ("d", "mission"), ("d", "robot")):
        killed = patrol.kill(host, process)
        patrol.wait_until(lambda host=host: patrol.is_active(host))  # type: ignore[misc]
        patrol.wait_until(lambda killed=killed: patrol.has_moved_since(killed + BRAKED))  # type: ignore[misc]
    gone = patrol.kill("d", "supervisor")
    patrol.wait_until(lambda: "host 'd' does not answer" in patrol.log("r"))
    patrol.wait_until(lambda: bool(patrol.motion()) and patrol.motion()[-1][0] > gone + CUT)
    assert not patrol.has_moved_since(gone + BRAKED + LATE + 2.0), "its processes brake before they end"
    again = patrol.up("d")
    patrol.wait_until(lambda: "host 'd' was started again" in patrol.log("r"))
    back = time.monotonic()
    patrol.wait_until(lambda: patrol.has_moved_since(back))
    assert patrol.rbx("r", "down", patrol.name).wait(30) == 0
    assert again.wait(30) == 0
