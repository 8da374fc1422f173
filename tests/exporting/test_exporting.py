"""What keeps a system alive, written for other programs, and checked by those that are installed."""

from __future__ import annotations

import shutil
import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from rbxcompose.cli.main import main
from rbxcompose.exporting import compose, kubernetes, systemd
from rbxcompose.exporting.exported_share import ExportedShare, shares
from rbxcompose.runtime.service_manager import ALIVE, READY, ServiceManager
from rbxcompose.systems.bundle import files_of
from rbxcompose.systems.reader import compile_system
from rbxcompose.testing.golden import Golden

PATH = "systems/patrol_two_hosts.yaml"
WITH_DEVICE = ExportedShare("lab", "arm", "bench", ("up", "{file}", "--host", "bench"), ("/dev/ttyUSB0",), 1.0)


@pytest.fixture
def found(repository: Path) -> list[ExportedShare]:
    return list(shares(compile_system(PATH, environment={})))


def tool(name: str) -> str:
    if (path := shutil.which(name)) is None:
        pytest.skip(f"{name} is not installed")
    return path


def test_a_unit_runs_one_share_in_a_sandbox_and_opens_only_its_devices(
    found: list[ExportedShare], golden: Golden
) -> None:
    words = {"program": "/opt/robot env/bin/rbxcompose", "file": "/srv/100%/system.yaml", "user": "pi"}
    golden.check("robot.service", systemd.unit(found[0], **words))
    assert "DeviceAllow=/dev/ttyUSB0 rw" in systemd.unit(WITH_DEVICE, **words)


def test_systemd_accepts_the_units(found: list[ExportedShare], tmp_path: Path) -> None:
    analyze = tool("systemd-analyze")
    for share in (*found, WITH_DEVICE):
        path = tmp_path / systemd.unit_name(share)
        path.write_text(systemd.unit(share, program="/bin/true", file="/srv/system.yaml", user="root"))
        done = subprocess.run([analyze, "verify", path], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def test_a_compose_file_has_a_service_for_each_share_in_the_profile_of_its_host(
    found: list[ExportedShare], golden: Golden
) -> None:
    golden.check("compose.yaml", compose.compose_file(found, system="patrol_two_hosts", file=PATH))
    services = yaml.safe_load(compose.compose_file([WITH_DEVICE], system="lab", file=PATH))["services"]
    assert services["arm-bench"]["devices"] == ["/dev/ttyUSB0:/dev/ttyUSB0"]


def k8s(found: list[ExportedShare]) -> dict[str, str]:
    file, files = files_of(compile_system(PATH, environment={}))
    return kubernetes.manifests(found, system="patrol_two_hosts", file=file, files=files, image="robot:1")


def test_what_a_pod_of_kubernetes_mounts_is_there_and_the_files_are_those_of_the_system(
    found: list[ExportedShare],
) -> None:
    made = {name: yaml.safe_load(text) for name, text in k8s([*found, WITH_DEVICE]).items()}
    data = made["files.yaml"]["data"]
    for share in (*found, WITH_DEVICE):
        pod: dict[str, Any] = made[f"{share.name}.yaml"]["spec"]["template"]["spec"]
        volumes = {one["name"] for one in pod["volumes"]}
        assert {one["name"] for one in pod["containers"][0]["volumeMounts"]} == volumes
        items = {one["path"]: one["key"] for one in pod["volumes"][0]["configMap"]["items"]}
        assert PATH in items
        assert set(items.values()) == set(data)
        assert pod["nodeSelector"] == {"rbxcompose/host": share.host}
    assert set(made["kustomization.yaml"]["resources"]) == made.keys() - {"kustomization.yaml"}


def test_kustomize_accepts_the_manifests(found: list[ExportedShare], tmp_path: Path) -> None:
    kubectl = tool("kubectl")
    for name, text in k8s(found).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    done = subprocess.run([kubectl, "kustomize", tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    kinds = [one["kind"] for one in yaml.safe_load_all(done.stdout)]
    assert sorted(kinds) == ["ConfigMap", "Deployment", "Deployment"]


def test_files_go_to_a_new_folder_only(repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", "compose", PATH, "--out", str(tmp_path / "new")]
    assert main(words) == 0
    assert (tmp_path / "new/project" / PATH).is_file()
    assert main(words) == 1
    assert "RBX6115" in capsys.readouterr().err
    assert main(["export", "k8s", "robots/turtlebot/robot.yaml", "--out", str(tmp_path / "other")]) == 1
    assert main(["export", "k8s", PATH, "--host", "dest", "--out", str(tmp_path / "other")]) == 1
    assert "did you mean 'desk'" in capsys.readouterr().err


def test_a_service_manager_hears_that_all_is_up_and_that_the_supervisor_lives(tmp_path: Path) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(path)
        manager = ServiceManager({"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "10000000"})
        manager.tell(READY)
        manager.tell(ALIVE)
        assert [listener.recv(100), listener.recv(100)] == [READY, ALIVE]
        ServiceManager({"NOTIFY_SOCKET": path}).tell(ALIVE)
        ServiceManager({}).tell(READY)
        listener.setblocking(False)
        with pytest.raises(BlockingIOError):
            listener.recv(100)
