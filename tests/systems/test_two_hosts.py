"""A robot on two hosts for real: network namespaces, routers linked router to router, a cable that is pulled."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.soak import Soak
from tests.systems.host_alone import COUNT, SIZE
from tests.systems.namespaces import NotPermittedError
from tests.systems.patrol import ADDRESSES, ENVIRONMENT, LONGEST, PatrolOnHosts
from tests.systems.sshd import serve, wrapper

STOP_WITHIN = 0.6  # [s] after a cut, as the system declares and `check` has computed
CUT = 4.0  # [s], longer than the others wait for a sign of life


@pytest.mark.timeout(150)
def test_one_command_starts_shows_stops_and_ends_the_robot_on_all_hosts_over_ssh(
    patrol: PatrolOnHosts, soak: Soak
) -> None:
    """Under `--soak`, other verbs are tried as well, of which each has its own tests on emulated hosts."""
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

    patrol.change_mission("repeat: $rounds", "repeat: 1000")
    patrol.change_system("name: two_hosts", "name: two_hosts\nsecurity: mtls")
    run("security", "init", "system.yaml")
    told = run("up", "system.yaml", "-d")
    assert "r | " in told
    patrol.watch()
    patrol.wait_until(lambda: patrol.has_moved_since(0.0))
    shown = run("ps", "system.yaml")
    assert "diff_drive_sim" in shown
    assert "go_to" in shown
    assert "clock of d: " in shown
    assert patrol.stranger("d") == "refused"
    if soak.is_on:
        assert patrol.rbx("d", "security", "audit", "system.yaml").wait(20) == 0
        assert "running" in run("mission", "ls", "--robot", f"system.yaml:{patrol.name}")
        assert "battery_level" in run("diag", "tree", "--robot", "system.yaml")
        robot = patrol.hosts.folder / "robots/robot.yaml"
        robot.write_text(robot.read_text(encoding="utf-8").replace("warn: 50 %", "warn: 40 %"), encoding="utf-8")
        run("apply", "system.yaml", "--yes")
        assert "40 %" in run("param", "get", "battery", "warn", "--robot", "system.yaml")
        assert "diff_drive_sim" in run("top", "system.yaml")
        assert "is there" in run("logs", "system.yaml")
        run("param", "set", "battery", "runtime", "500 s", "--robot", "system.yaml")
        assert "500 s" in run("param", "get", "battery", "runtime", "--robot", "system.yaml"), "it is on the other host"
        assert "stopped" in run("stop", "system.yaml")
        assert "released" in run("release", "--robot", "system.yaml")
        patrol.wait_until(lambda: all(state and state.stop is None for state in map(patrol.state, ADDRESSES)))
    assert "stopped" in run("stop", "system.yaml")
    assert all(state is not None and state.stop is not None for state in map(patrol.state, ADDRESSES))
    run("down", "system.yaml")
    assert (patrol.state("r"), patrol.state("d")) == (None, None)


@pytest.mark.timeout(150)
def test_the_base_stops_when_the_cable_is_pulled_and_the_patrol_succeeds_once_it_is_back(patrol: PatrolOnHosts) -> None:
    base, desk = patrol.up("r"), patrol.up("d")
    patrol.watch()
    patrol.wait_until(lambda: patrol.has_moved_since(0.0))
    cut = patrol.hosts.cut("r")
    patrol.wait_until(lambda: bool(patrol.motion()) and patrol.motion()[-1][0] > cut + CUT)
    moving = [at for at, moves in patrol.motion() if moves]
    assert moving[-1] < cut + STOP_WITHIN
    assert "host 'r' does not answer" in patrol.log("d")
    assert "host 'd' does not answer" in patrol.log("r")
    back = patrol.hosts.mend("r")
    patrol.wait_until(lambda: patrol.has_moved_since(back))
    assert desk.wait(60) == 0
    assert base.wait(20) == 0, "the end of the mission is the end of the robot on all hosts"
    assert "mission patrol: success" in patrol.log("r") + base.communicate()[0]
    assert (patrol.state("r"), patrol.state("d")) == (None, None)


def test_what_nobody_takes_on_another_host_does_not_leave_its_own(patrol: PatrolOnHosts) -> None:
    def alone(host: str, *ends: str) -> subprocess.Popen[str]:
        words = (sys.executable, "-m", "tests.systems.host_alone", *ends)
        return patrol.hosts.start(host, *words, environment=ENVIRONMENT)

    link = f"tcp/{ADDRESSES['r']}:7500"
    alone("d", "-", link)
    output, _ = alone("r", link, "-").communicate(timeout=LONGEST)
    arrived, left = map(int, output.split())
    assert arrived > 0.8 * COUNT
    assert left < 0.01 * arrived * SIZE, "signs of life of the link only"
