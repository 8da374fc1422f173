"""A robot of toys in real processes: what must hold whatever is killed, stopped or interrupted, and when."""

from __future__ import annotations

import json
import signal
import socket

import pytest

from rbxcompose.runtime.log import NAME
from rbxcompose.runtime.processes import titled, wait_until_ended
from tests.runtime.real_robot import PATIENCE, Robot, eventually, read_log
from tests.soak import rare


def test_up_ps_down(robot: Robot) -> None:
    assert "is up: 2 components in 2 processes" in robot.up_detached()
    shown = robot.ps()
    assert shown["robot"] == robot.name
    assert shown["router"]["endpoint"].startswith("tcp/127.0.0.1:")
    assert [(component["name"], component["state"], component["restarts"]) for component in shown["components"]] == [
        ("first", "active", 0),
        ("second", "active", 0),
    ]
    done = robot.do("down", "--json")
    assert (done.returncode, json.loads(done.stdout)) == (0, {"robot": robot.name, "told": []})
    assert robot.do("ps").returncode == 1
    assert robot.last_words("first") == ["braking", "deactivated"]


def test_commands_reach_the_running_robot(robot: Robot) -> None:
    robot.up_detached()
    assert robot.do("release").returncode == 1
    assert robot.do("stop", "--robot", robot.name).returncode == 0
    eventually(lambda: robot.has_logged("held"))
    assert robot.do("release").returncode == 0
    eventually(lambda: robot.has_logged("free again"))
    refused = robot.do("mission", "pause")
    assert (refused.returncode, "RBX9004" in refused.stderr) == (1, True)
    assert robot.do("down", robot.name).returncode == 0


def test_a_component_stops_the_robot_and_nobody_releases_it_before_the_reason_is_over(robot: Robot) -> None:
    robot.up_detached(holds_at=0.5, holds_for=3.0)
    eventually(lambda: all("held" in robot.texts(text) for text in ("first", "second")))
    refused = robot.do("release")
    assert refused.returncode != 0
    assert "the robot must stand still: a toy is on the floor" in refused.stdout + refused.stderr
    eventually(lambda: robot.do("release").returncode == 0)
    eventually(lambda: all(robot.last_words(text)[-1] == "free again" for text in ("first", "second")))
    assert [robot.texts(text).count("held") for text in ("first", "second")] == [1, 1]
    assert robot.do("down").returncode == 0


@pytest.mark.soak  # as in `tests/faults/test_folder`
def test_a_second_up_is_a_finding(robot: Robot) -> None:
    robot.up_detached()
    pid = robot.supervisor().pid
    second = robot.up("-d")
    output, _ = second.communicate(timeout=PATIENCE)
    assert second.returncode == 1
    assert f"error[RBX9001]: '{robot.name}' is already up (pid {pid})" in output
    assert robot.supervisor().pid == pid
    robot.do("down")


def test_the_foreground_ends_with_the_mission_and_tells_the_whole_story(robot: Robot) -> None:
    process = robot.up(runs=0.5, outcome="failure", prints="hello from a toy")
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3
    lines = output.splitlines()
    summary = lines.index(f"{robot.name} is down: mission toy: failure")
    assert sum("deactivated" in line for line in lines[:summary]) == 2
    assert any(line.split()[:2] == ["second", "steps"] for line in lines[summary:])
    assert "hello from a toy" in robot.texts("second"), "what a component prints is in the log"


def test_an_interrupt_while_it_runs_ends_it_in_order(robot: Robot) -> None:
    process = robot.up()
    eventually(lambda: robot.has_logged("step 10"))
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "interrupted" in output
    assert robot.last_words("first") == ["braking", "deactivated"]


def test_an_interrupt_during_the_start_ends_it_at_once(robot: Robot) -> None:
    process = robot.up(is_slow=True)
    eventually(lambda: len(robot.processes()) == 5)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 130


@pytest.mark.parametrize("processes", range(1, 6))
@pytest.mark.soak  # during the start and while it runs are two of them
def test_an_interrupt_at_any_moment_leaves_nothing(robot: Robot, processes: int) -> None:
    process = robot.up()
    eventually(lambda: len(robot.processes()) >= processes)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, output


def test_a_second_interrupt_waits_for_nothing(robot: Robot) -> None:
    process = robot.up(brakes=60.0)
    eventually(lambda: robot.has_logged("step 10"))
    process.send_signal(signal.SIGINT)
    eventually(lambda: robot.has_logged("braking"))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert not robot.has_logged("deactivated")


def test_the_end_of_the_terminal_is_the_end_of_the_robot(robot: Robot) -> None:
    process = robot.up()
    eventually(lambda: robot.has_logged("step 10"))
    process.kill()
    assert wait_until_ended(robot.processes(), 2.0) == []
    assert robot.last_words("first") == ["braking", "deactivated"]


def test_a_killed_process_is_started_again(robot: Robot) -> None:
    robot.up_detached()
    process = robot.process_of("first")
    process.send_signal(signal.SIGKILL)
    eventually(lambda: robot.texts("first").count("started") == 2)
    assert robot.has_logged("lost first: process 'robot' was killed by SIGKILL")
    assert [(component["state"], component["restarts"]) for component in robot.ps()["components"]] == [
        ("active", 1),
        ("active", 0),
    ]
    assert robot.process_of("first") != process
    robot.do("down")


def test_a_killed_router_comes_again_where_it_was(robot: Robot) -> None:
    robot.up_detached()
    endpoint = robot.ps()["router"]
    router = next(iter(titled(f"rbxcompose {robot.name}: router")))
    router.send_signal(signal.SIGKILL)
    eventually(lambda: robot.has_logged("process 'router' was killed") and len(robot.processes()) == 5)
    assert robot.ps()["router"] == endpoint
    robot.do("down")


def test_without_its_supervisor_the_robot_comes_to_rest_and_ends(robot: Robot) -> None:
    robot.up_detached()
    processes = robot.processes()
    assert len(processes) == 5
    robot.supervisor().send_signal(signal.SIGKILL)
    assert wait_until_ended(processes, 2.0) == []
    assert robot.last_words("first") == ["braking", "deactivated"]
    assert [component["state"] for component in robot.ps()["components"]] == ["dead", "dead"]
    assert robot.do("down").returncode == 0


def test_without_the_prefork_parent_the_robot_goes_down(robot: Robot) -> None:
    process = robot.up()
    eventually(lambda: robot.has_logged("step 10"))
    next(iter(titled(f"rbxcompose {robot.name}: parent"))).send_signal(signal.SIGKILL)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 4
    assert "the pre-fork parent is gone" in output
    assert robot.last_words("first") == ["braking", "deactivated"]


def test_a_suspended_process_is_shown_as_such_and_told_to_the_others_before_it_is_started_again(robot: Robot) -> None:
    robot.up_detached()
    robot.process_of("first").send_signal(signal.SIGSTOP)
    eventually(lambda: [one["state"] for one in robot.ps()["components"]] == ["suspended", "active"])
    eventually(lambda: robot.has_logged("lost first: process 'robot' was suspended by a signal"))
    eventually(lambda: robot.texts("first").count("started") == 2)
    robot.do("down")


@pytest.mark.soak  # as below, where nobody supervises it
def test_down_ends_a_stopped_process(robot: Robot) -> None:
    robot.up_detached()
    robot.process_of("first").send_signal(signal.SIGSTOP)
    assert robot.do("down").returncode == 0


@pytest.mark.parametrize("who", ["the next up", *rare("down")])
def test_what_a_dead_supervisor_left_is_ended_by(who: str, robot: Robot) -> None:
    robot.up_detached()
    robot.process_of("first").send_signal(signal.SIGSTOP)
    before = robot.processes()
    robot.supervisor().send_signal(signal.SIGKILL)
    if who == "the next up":
        robot.up_detached()
        assert robot.has_logged("the previous run was not shut down, its supervisor died")
    assert robot.do("down").returncode == 0
    assert wait_until_ended(before, 0.0) == []


def test_down_ends_a_robot_whose_supervisor_is_stopped(robot: Robot) -> None:
    robot.up_detached()
    robot.supervisor().send_signal(signal.SIGSTOP)
    assert [component["state"] for component in robot.ps()["components"]] == ["active", "active"]
    assert robot.do("down").returncode == 0
    assert robot.last_words("first") == ["braking", "deactivated"]


def test_a_process_that_hangs_ends_itself_and_says_where(robot: Robot) -> None:
    process = robot.up(hangs_at=0.3)
    eventually(lambda: robot.has_logged("process 'other' hung for 2 s in step of 'second' and ended itself"))
    hang = next(record for record in read_log(robot.folder.path / NAME) if "hung" in record.text)
    assert "in step" in hang.detail
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE)


def test_a_process_that_dies_again_and_again_fails_the_robot(robot: Robot) -> None:
    process = robot.up(dies_at=0.01)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 4
    assert "too often to continue" in output


@pytest.mark.parametrize("option", ["-d", "--stepped"])
def test_a_component_that_cannot_be_configured_ends_the_start_with_its_reason(robot: Robot, option: str) -> None:
    process = robot.up(option, is_broken=True)
    output, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 4
    assert "'second' failed too often: configure raised OSError: no such device" in output


def test_a_robot_beside_another_takes_the_next_port(robot: Robot) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        robot.up("-d", "--port", str(port)).communicate(timeout=PATIENCE)
        endpoint = robot.ps()["router"]["endpoint"]
        assert port < int(endpoint.rpartition(":")[2]) <= port + 20
    robot.do("down")


@pytest.mark.parametrize("options", [[], *rare(["--rate", "200"])], ids=["max", "paced"])
def test_on_a_stepped_clock_two_runs_write_the_same_log(robot: Robot, options: list[str]) -> None:
    logs = []
    for _ in range(2):
        process = robot.up("--stepped", *options, runs=20.0, brakes=0.33)
        process.communicate(timeout=PATIENCE)
        assert process.returncode == 0
        logs.append((robot.folder.path / NAME).read_bytes())
    assert logs[0] == logs[1]
    assert logs[0].count(b"deactivated") == 2
    assert robot.texts("second")[-2:] == ["braking", "deactivated"]


def test_on_a_stepped_clock_the_failure_that_is_one_too_many_ends_the_run_at_its_instant(robot: Robot) -> None:
    process = robot.up("--stepped", "--duration", "1000", fails_at=0.3)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 4
    records = read_log(robot.folder.path / NAME)
    *_, last, told = (record.time for record in records if "no such device" in record.text)
    assert 0.3 < last == told
    assert [record.time for record in records if record.text == "braking"] == [last]


@pytest.mark.soak  # how a run ends is tried by virtual time
def test_on_a_stepped_clock_a_mission_that_waits_in_vain_ends_the_run(robot: Robot) -> None:
    process = robot.up("--stepped", runs=20.0, outcome="waiting")
    told, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3
    assert "mission toy: failure: waits" in told


@pytest.mark.soak  # as in `test_conductor`
def test_on_a_stepped_clock_the_duration_is_exact(robot: Robot) -> None:
    process = robot.up("--stepped", "--duration", "7")
    process.communicate(timeout=PATIENCE)
    braking = [record.time for record in read_log(robot.folder.path / NAME) if record.text == "braking"]
    assert (process.returncode, braking) == (0, [7.0, 7.0])


def test_a_command_to_a_stepped_robot_is_told_to_end_reproducibility(robot: Robot) -> None:
    robot.up("--stepped", "--rate", "1")
    eventually(lambda: robot.has_logged("step 10"))
    assert robot.do("stop").returncode == 0
    eventually(lambda: robot.has_logged("from outside: stop; this run is not reproducible"))
    robot.do("down")


def test_a_supervisor_that_was_stopped_for_a_while_goes_on_with_a_sound_robot(robot: Robot) -> None:
    robot.up_detached()
    supervisor, before = robot.supervisor(), robot.processes()
    supervisor.send_signal(signal.SIGSTOP)
    heard = len(robot.texts("first"))
    eventually(lambda: len(robot.texts("first")) >= heard + 6)  # 3 s of its steps
    supervisor.send_signal(signal.SIGCONT)
    assert [(component["state"], component["restarts"]) for component in robot.ps()["components"]] == [
        ("active", 0),
        ("active", 0),
    ]
    assert robot.processes() == before
    robot.do("down")
