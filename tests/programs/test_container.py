"""A container as a component: the call of its engine, and that nothing of it stays behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.domains.programs.child import Child, Event
from rbxcompose.domains.programs.components.container import Container, ContainerConfig, order_of, removal
from rbxcompose.domains.programs.runnable import NoEngineError, ask_for_real, engine_of, program_findings
from rbxcompose.testing.manifests import check_text
from tests.programs.foreign import robot

JOINING = {
    "ZENOH_CONFIG": "/run/x.json5",
    "ZENOH_SESSION_CONFIG_URI": "/run/x.json5",
    "ROS_DOMAIN_ID": "3",
    "TOKEN": "s",
}
NAME = "rbxcompose-one-detector"
STARTS = f"run --rm --name {NAME} --network host --pull never --stop-signal SIGTERM --init "
MOST = 20.0  # [s]


def words(engine: str = "/bin/docker", **config: Any) -> str:
    made = ContainerConfig(image="example", **config)
    return " ".join(order_of(made, engine, NAME, {}, JOINING).command)


def test_the_order_names_the_container_and_passes_the_environment_by_name() -> None:
    assert words(arguments=["--fast", "1"], environment={"TOKEN": "s"}) == (
        f"/bin/docker {STARTS}"
        "--mount type=bind,source=/run/x.json5,target=/rbxcompose/zenoh.json5,readonly "
        "--env ZENOH_CONFIG=/rbxcompose/zenoh.json5 --env ZENOH_SESSION_CONFIG_URI=/rbxcompose/zenoh.json5 "
        "--env ROS_DOMAIN_ID --env TOKEN example --fast 1"
    )


def test_the_engine_keeps_the_limits() -> None:
    limits = {"memory": 200, "cpus": 0.5, "cores": [0, 2], "open_files": 64}
    assert "--memory 200m --cpus 0.5 --cpuset-cpus 0,2 --ulimit nofile=64" in words(limits=limits)


def test_folders_are_mounted_so_that_only_some_can_be_written() -> None:
    mounted = words(mounts={"/models": "/srv/models", "/log": {"folder": "/srv/log", "writable": True}})
    assert "--mount type=bind,source=/srv/models,target=/models,readonly" in mounted
    assert "--mount type=bind,source=/srv/log,target=/log --env" in mounted


def test_devices_the_network_and_the_signal_are_passed_on() -> None:
    found = words("/bin/podman", devices=["/dev/video0"], network="none", stop={"signal": "SIGINT"})
    assert "--network none --pull never --stop-signal SIGINT --device /dev/video0" in found
    assert "--init" not in found  # of podman, it needs another package


@pytest.mark.parametrize(
    ("config", "found"),
    [
        ({"limits": {"nice": 3}}, "'nice' must be at most 0"),
        ({"mounts": {"models": "."}}, "'mounts': 'models' must be a path that begins with '/' and has no comma"),
        ({"image": "--privileged"}, "'image': must be one word that begins with a letter or a digit"),
        ({"network": "-v"}, "'network': must be one word that begins with a letter or a digit"),
    ],
)
def test_what_an_engine_would_misread_is_a_finding(tmp_path: Path, config: dict[str, Any], found: str) -> None:
    settings = {"type": "container", "image": "example", **config}
    assert found in check_text(robot("one", components={"detector": settings}), tmp_path).text


def test_folders_are_relative_to_the_file(tmp_path: Path) -> None:
    settings = {"type": "container", "image": "example", "mounts": {"/models": "models"}}
    plan = check_text(robot("one", components={"detector": settings}), tmp_path).compilation.plan
    assert plan is not None
    (config,) = (instance.config for instance in plan.instances if instance.type == Container.type_name)
    assert isinstance(config, ContainerConfig)
    assert config.mounts["/models"].folder == str(tmp_path / "models")


STAND_IN = [sys.executable, "-S", str(Path(__file__).with_name("stand_in_engine.py"))]


@pytest.fixture
def engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An executable `docker` that behaves like one, and its daemon; no container may be left at the end."""
    folder = tmp_path / "engine"
    folder.mkdir()
    file = folder / "docker"
    file.write_text(f"""#!/bin/sh\nexec {" ".join(STAND_IN)} "$@"\n""", encoding="utf-8")
    file.chmod(0o755)
    monkeypatch.setenv("STAND_IN", str(folder))
    monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")
    with subprocess.Popen([*STAND_IN, "daemon"], stdout=subprocess.PIPE, text=True) as daemon:
        assert daemon.stdout is not None
        assert daemon.stdout.readline() == "ready\n"
        yield folder
        left = [one.name.removeprefix("container_") for one in containers(folder)]
        for name in left:
            ask_for_real(removal(str(file), name))
        daemon.kill()
    assert left == []


def containers(engine: Path) -> list[Path]:
    return list(engine.glob("container_*"))


def started(engine: Path, script: str, **changes: Any) -> Child:
    config = ContainerConfig(image="example", arguments=("sh", "-c", script))
    environment = {**os.environ, "TOKEN": "secret"}
    order = order_of(config, str(engine / "docker"), NAME, environment, {"TOKEN": "secret"})
    return Child(replace(order, **changes))


def until(child: Child, holds: Callable[[list[Event]], bool]) -> list[Event]:
    events, deadline = list[Event](), time.monotonic() + MOST
    while not holds(events):
        assert time.monotonic() < deadline, events
        child.wait(0.05)
        events += child.events()
    return [*events, *(child.events() if child.is_over else ())]


def test_a_container_is_heard_gets_its_environment_and_ends_with_its_exit_code(engine: Path) -> None:
    child = started(engine, "echo $TOKEN; exit 3")
    events = until(child, lambda events: child.is_over)
    child.close()
    assert ("line", "secret") in events
    assert ("ended", 3 << 8) in events
    assert "secret" not in (engine / "words").read_text()


def test_a_container_is_stopped_by_the_signal(engine: Path) -> None:
    child = started(engine, "trap 'echo in order; exit 0' TERM; echo ready; while :; do sleep 0.02; done")
    until(child, lambda events: ("line", "ready") in events)
    child.ask_to_end()
    events = until(child, lambda events: child.is_over)
    child.close()
    assert {("line", "in order"), ("ended", 0)} <= set(events)


DEAF = "trap '' TERM; echo ready; while :; do sleep 0.02; done"


@pytest.mark.soak  # as one whose component is killed
def test_a_container_that_ignores_the_signal_is_removed_although_its_client_was_killed(engine: Path) -> None:
    child = started(engine, DEAF, patience=0.2)
    until(child, lambda events: ("line", "ready") in events)
    child.ask_to_end()
    events = until(child, lambda events: child.is_over)
    child.close()
    assert {("deaf", None), ("ended", int(signal.SIGKILL))} <= set(events)
    assert containers(engine) == []


def test_a_container_is_removed_when_the_process_of_its_component_is_killed(engine: Path) -> None:
    script = (
        "import os, sys, time\n"
        "from rbxcompose.domains.programs.child import Child\n"
        "from rbxcompose.domains.programs.components.container import ContainerConfig, order_of\n"
        f"config = ContainerConfig(image='example', arguments=('sh', '-c', {DEAF!r}))\n"
        f"child = Child(order_of(config, {str(engine / 'docker')!r}, {NAME!r}, dict(os.environ), {{}}))\n"
        "while True:\n    child.wait(1.0)\n    print(list(child.events()), flush=True)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as host:
        assert host.stdout is not None
        assert any("ready" in line for line in host.stdout)
        host.kill()
    deadline = time.monotonic() + MOST
    while containers(engine):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_what_a_dead_predecessor_has_left_is_removed(engine: Path) -> None:
    child = started(engine, DEAF, cleanup=())
    until(child, lambda events: ("line", "ready") in events)
    child.close()
    assert len(containers(engine)) == 1
    ask_for_real(removal(str(engine / "docker"), NAME))
    assert containers(engine) == []


def findings(folder: Path, **config: Any) -> list[tuple[str, str, str, int]]:
    """Return the code, the words, the help and the line of what this machine has against a container."""
    settings = {"type": "container", "image": "example", **config}
    made = check_text(robot("one", components={"detector": settings}), folder).compilation.robot
    assert made is not None
    found = program_findings(made, os.environ, ask_for_real)
    return [(one.code, one.message, one.help, one.span.line if one.span else 0) for one in found]


def test_a_machine_that_has_all_is_fine(engine: Path, tmp_path: Path) -> None:
    assert findings(tmp_path) == []
    assert engine_of("auto", os.environ["PATH"], ask_for_real) == str(engine / "docker")


def test_an_engine_that_does_not_answer_is_told_with_its_reason(engine: Path, tmp_path: Path) -> None:
    (engine / "socket").unlink()
    ((code, text, _, line),) = findings(tmp_path, engine="docker")
    assert (code, line) == ("RBX9428", 8)
    assert text == (
        "'detector' needs an engine for containers: docker does not work: "
        "Cannot connect to the Docker daemon. Is the docker daemon running?"
    )


def test_an_image_that_is_not_here_is_told_with_what_brings_it(engine: Path, tmp_path: Path) -> None:
    assert findings(tmp_path, image="other") == [
        ("RBX9429", "the image 'other' is not on this machine", "docker pull other", 7)
    ]


def test_a_machine_without_an_engine_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    ((code, text, _, _),) = findings(tmp_path)
    assert (code, text) == ("RBX9428", "'detector' needs an engine for containers: docker or podman is not installed")


def test_a_real_engine_runs_and_stops_a_container() -> None:
    try:
        engine = engine_of("auto", os.environ["PATH"], ask_for_real)
    except NoEngineError as error:
        pytest.skip(str(error))
    if ask_for_real([engine, "image", "inspect", "busybox"]):
        pytest.skip("the image 'busybox' is not here")
    config = ContainerConfig(image="busybox", arguments=("sh", "-c", "echo ready; sleep 100"))
    name = f"rbxcompose-test-{os.getpid()}"
    child = Child(order_of(config, engine, name, os.environ, {}))
    until(child, lambda events: ("line", "ready") in events)
    child.ask_to_end()
    until(child, lambda events: child.is_over)
    child.close()
    assert ask_for_real([engine, "inspect", name])
