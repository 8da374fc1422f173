"""Changes of settings of a robot in real processes, whoever is killed in the middle of them."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

from tests.forked import RBXCOMPOSE, Forked
from tests.runtime.real_robot import PATIENCE, ROOT, Robot, eventually

BOTH = "{others: [{node: first, parameters: [%s]}, {node: second, parameters: [%s]}], by: somebody}"
SIZE = "{name: size, value: {type: 2, integer_value: 5}}"


def half_way(robot: Robot, file: Path) -> subprocess.Popen[str]:
    """Return a client whose change of both toys is prepared by the first, and by the second when the file is gone."""
    file.touch()
    robot.up_detached(waits_for=str(file))
    words = [*RBXCOMPOSE, "service", "call", "first/change_parameters", BOTH % (SIZE, SIZE)]
    client = Forked(words, env=robot.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
    robot.started.append(client)
    eventually(lambda: robot.has_logged("first asked to be 5") and robot.has_logged(f"{file} asked to be 5"))
    assert client.poll() is None
    return client


def sizes(robot: Robot) -> list[str]:
    return [robot.do("param", "get", name, "size").stdout.strip() for name in ("first", "second")]


def test_a_client_that_is_killed_in_the_middle_of_a_change_leaves_it_whole(robot: Robot, tmp_path: Path) -> None:
    client = half_way(robot, tmp_path / "wait")
    client.kill()
    client.wait()
    assert not robot.has_logged("set: size")
    (tmp_path / "wait").unlink()
    eventually(lambda: sum("set: size = 5" in text for text in robot.texts()) == 2)
    assert sizes(robot) == ["5", "5"]
    assert robot.do("down").returncode == 0


def test_a_component_that_dies_in_the_middle_of_a_change_leaves_nothing_of_it(robot: Robot, tmp_path: Path) -> None:
    client = half_way(robot, tmp_path / "wait")
    robot.process_of("second").send_signal(signal.SIGKILL)
    (tmp_path / "wait").unlink()
    told, _ = client.communicate(timeout=PATIENCE)
    assert "process 'other' has ended meanwhile" in told
    eventually(lambda: "\n".join(sizes(robot)) == "0\n0")
    assert not robot.has_logged("set: size")
    assert robot.do("param", "set", "first.size=3", "second.size=4").returncode == 0
    assert sizes(robot) == ["3", "4"]
    robot.process_of("second").send_signal(signal.SIGKILL)
    eventually(lambda: robot.has_logged("set: size = 4, by the restart of its process"))
    assert sizes(robot) == ["3", "4"]
    assert robot.do("down").returncode == 0
