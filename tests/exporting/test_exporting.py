"""What keeps a system alive, written for other programs, and checked by those that are installed."""

from __future__ import annotations

import dataclasses
import re
import shutil
import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from rbxcompose import __version__
from rbxcompose.commands.main import main
from rbxcompose.compiler.systems.bundle import BundledFile, files_of
from rbxcompose.compiler.systems.certificates import folder_of
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.runtime.supervision.supervisor import ALIVE, READY, ServiceManager
from rbxcompose.testing.golden import Golden
from rbxcompose.tools.exporting import shares
from rbxcompose.tools.exporting.shares import CERTIFICATES, CONFIGURATION, FILE, ExportedShare
from tests.soak import Soak
from tests.third_party.places import put, see

PATH = "systems/patrol_two_hosts.yaml"
WITH_DEVICE = ExportedShare("lab", "arm", "bench", ("up", "{file}", "--host", "bench"), ("/dev/ttyUSB0",), 1.0)
WITH_USB = dataclasses.replace(WITH_DEVICE, robot="cart", devices=(), has_usb=True)
CART = """rbx: 1
kind: Robot
name: cart
devices: {receiver: {vendor: 1546, product: 01a7}}
components: {gps: {type: gps, port: dev:receiver}, lidar: {type: lidar, port: /dev/ttyS0, frame: base_link}}
"""
CARTS = "rbx: 1\nkind: System\nname: carts\nhosts: {here: {}}\nrobots: {cart: {robot: cart.yaml}}\n"
SECRET = ExportedShare("lab", "arm", "bench", ("up", "{file}"), (), 1.0, has_certificates=True, secrets=("api_key",))
OVERLAY = """
apiVersion: kustomize.config.k8s.io/v1beta1
kind: Kustomization
resources: [../base]
namePrefix: second-
images: [{name: "robot", newTag: "2"}]
patches:
  - target: {kind: Deployment}
    patch: |-
      - {op: add, path: /spec/template/spec/nodeSelector/fleet, value: second}
"""


@pytest.fixture
def found(repository: Path) -> list[ExportedShare]:
    return list(shares.shares(compile_system(PATH, environment={})))


def tool(name: str) -> str:
    if (path := shutil.which(name)) is None:
        pytest.skip(f"{name} is not installed")
    return path


def test_a_unit_runs_one_share_in_a_sandbox_and_opens_only_its_devices(
    found: list[ExportedShare], golden: Golden
) -> None:
    words = {"program": "/opt/robot env/bin/rbxcompose", "file": "/srv/100%/system.yaml", "user": "pi"}
    golden.check("robot.service", shares.unit(found[0], **words))
    assert "DeviceAllow=/dev/ttyUSB0 rw" in shares.unit(WITH_DEVICE, **words)


def test_a_unit_runs_the_program_that_its_host_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cart.yaml").write_text(CART, encoding="utf-8")
    Path("s.yaml").write_text(CARTS.replace("here: {}", "here: {command: /opt/venv/bin/rbxcompose}"), encoding="utf-8")
    for number, (options, program) in enumerate(
        (([], "/opt/venv/bin/rbxcompose"), (["--command", "/opt/own"], "/opt/own"))
    ):
        assert main(["export", "systemd", "s.yaml", "-o", f"units{number}", *options]) == 0
        text = Path(f"units{number}/rbxcompose-cart-here.service").read_text(encoding="utf-8")
        assert f"ExecStart={program} up " in text


def test_systemd_accepts_the_units(found: list[ExportedShare], tmp_path: Path) -> None:
    analyze = tool("systemd-analyze")
    for share in (*found, WITH_DEVICE, WITH_USB):
        path = tmp_path / shares.unit_name(share)
        path.write_text(shares.unit(share, program="/bin/true", file="/srv/system.yaml", user="root"))
        done = subprocess.run([analyze, "verify", path], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def test_a_compose_file_has_a_service_for_each_share_in_the_profile_of_its_host(
    found: list[ExportedShare], golden: Golden
) -> None:
    golden.check("compose.yaml", shares.compose_file(found, system="patrol_two_hosts", file=PATH))
    services = yaml.safe_load(shares.compose_file([WITH_DEVICE], system="lab", file=PATH))["services"]
    assert services["arm-bench"]["devices"] == ["/dev/ttyUSB0:/dev/ttyUSB0"]


def test_a_device_that_is_looked_up_may_be_any_serial_port_on_usb(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cart.yaml").write_text(CART, encoding="utf-8")
    Path("s.yaml").write_text(CARTS, encoding="utf-8")
    (share,) = shares.shares(compile_system("s.yaml", environment={}))
    lines = shares.unit(share, program="/bin/true", file="/srv/s.yaml", user="pi").splitlines()
    assert [line for line in lines if line.startswith(("DeviceAllow", "Supplementary"))] == [
        "DeviceAllow=/dev/ttyS0 rw",
        "DeviceAllow=char-ttyACM rw",
        "DeviceAllow=char-ttyUSB rw",
        "SupplementaryGroups=dialout",
    ]
    service = yaml.safe_load(shares.compose_file([share], system="carts", file="s.yaml"))["services"]["cart-here"]
    assert "/dev:/dev" in service["volumes"]
    assert service["device_cgroup_rules"] == ["c 166:* rw", "c 188:* rw"]
    assert service["devices"] == ["/dev/ttyS0:/dev/ttyS0"]
    assert service["group_add"] == ["dialout"]


def composer(text: str) -> tuple[list[str], str]:
    """Return the words for Compose, and what it reads of the file: version 1 knows all keys of version 2 but `name`."""
    newest = ["docker", "compose"]
    if shutil.which("docker") and subprocess.run([*newest, "version"], capture_output=True).returncode == 0:
        return newest, text
    command = tool("docker-compose")
    version = subprocess.run([command, "version", "--short"], capture_output=True, text=True, check=True).stdout
    return [command], text.replace("\nname: lab\n", "\n") if version.startswith("1.") else text


def test_compose_accepts_the_file_and_would_refuse_a_key_that_it_does_not_know(
    found: list[ExportedShare], tmp_path: Path, soak: Soak
) -> None:
    given = [*found, WITH_USB, dataclasses.replace(SECRET, devices=WITH_DEVICE.devices)]
    command, text = composer(shares.compose_file(given, system="lab", file=PATH))
    profiles = [word for share in given for word in ("--profile", share.host)]
    path = tmp_path / "compose.yaml"

    def read(text: str) -> subprocess.CompletedProcess[str]:
        path.write_text(text, encoding="utf-8")
        return subprocess.run([*command, "-f", path, *profiles, "config"], capture_output=True, text=True, check=False)

    done = read(text)
    assert done.returncode == 0, done.stderr
    services = yaml.safe_load(done.stdout)["services"]
    commands = {share.name: [f"/robot/{PATH}" if word == FILE else word for word in share.command] for share in given}
    assert {name: service["command"] for name, service in services.items()} == commands
    if soak.is_on:  # which is about Compose alone
        assert "mem_limits" in read(text.replace("mem_limit", "mem_limits")).stderr


def k8s(found: list[ExportedShare]) -> dict[str, str]:
    file, files = files_of(compile_system(PATH, environment={}))
    return shares.kubernetes_manifests(found, system="patrol_two_hosts", file=file, files=files, image="robot:1")


def test_what_a_pod_of_kubernetes_mounts_is_there_and_the_files_are_those_of_the_system(
    found: list[ExportedShare],
) -> None:
    made = {name: yaml.safe_load(text) for name, text in k8s([*found, WITH_DEVICE, WITH_USB]).items()}
    data = made["files.yaml"]["data"]
    for share in (*found, WITH_DEVICE, WITH_USB):
        pod: dict[str, Any] = made[f"{share.name}.yaml"]["spec"]["template"]["spec"]
        volumes = {volume["name"] for volume in pod["volumes"]}
        assert {mount["name"] for mount in pod["containers"][0]["volumeMounts"]} == volumes
        items = {item["path"]: item["key"] for item in pod["volumes"][0]["configMap"]["items"]}
        assert PATH in items
        assert set(items.values()) == set(data)
        assert pod["nodeSelector"] == {"rbxcompose/host": share.host}
    assert set(made["kustomization.yaml"]["resources"]) == made.keys() - {"kustomization.yaml"}


NAMES = st.from_regex(r"[a-c][a-c_]{0,3}", fullmatch=True) | st.sampled_from([f"{letter * 59}_" for letter in "ab"])


@given(first=st.tuples(NAMES, NAMES), other=st.tuples(NAMES, NAMES))
@example(first=("a_b", "c"), other=("a", "b_c"))
def test_each_share_has_a_name_of_its_own_that_every_program_takes(
    first: tuple[str, str], other: tuple[str, str]
) -> None:
    names = [ExportedShare("lab", *each, ("up",), (), 1.0).name for each in (first, other)]
    assert (names[0] == names[1]) == (first == other)
    assert all(re.fullmatch(r"[a-z]([-a-z0-9]{0,61}[a-z0-9])?", name) for name in names)


def test_names_that_kubernetes_does_not_take_are_written_in_another_way() -> None:
    paths = ["a map.yaml", "a_map.yaml", "é.yaml", "ü.yaml", "a/b.yaml", "a..b.yaml", "a/.b", "a./b", "x" * 300]
    share = ExportedShare("lab_", "r" * 70, "bench_", ("up",), (), 1.0, secrets=("key_",))
    files = {path: BundledFile(path.encode()) for path in paths}
    made = shares.kubernetes_manifests([share], system="lab_", file="a", files=files, image="i")
    whole = {name: yaml.safe_load(text) for name, text in made.items()}
    data, deployment = whole["files.yaml"]["data"], whole[f"{share.name}.yaml"]
    pod = deployment["spec"]["template"]["spec"]
    assert {item["path"]: data[item["key"]] for item in pod["volumes"][0]["configMap"]["items"]} == {
        path: path for path in paths
    }
    assert all(re.fullmatch(r"[-._a-zA-Z0-9]{1,253}", key) for key in data)
    labels = [*deployment["metadata"]["labels"].values(), *pod["nodeSelector"].values()]
    labels += whole[shares.KUSTOMIZATION]["labels"][0]["pairs"].values()
    assert all(re.fullmatch(r"[a-zA-Z0-9]([-\w.]{0,61}[a-zA-Z0-9])?", label) for label in labels)
    secret = pod["containers"][0]["env"][-1]["valueFrom"]["secretKeyRef"]["name"]
    objects = [secret, *(one["metadata"]["name"] for one in whole.values() if "metadata" in one)]
    assert all(re.fullmatch(r"[a-z0-9]([-a-z0-9.]*[a-z0-9])?", name) for name in objects)
    assert (
        f"kubectl label node NODE rbxcompose/host={pod['nodeSelector']['rbxcompose/host']}"
        in made[f"{share.name}.yaml"]
    )


def test_kustomize_accepts_the_manifests(found: list[ExportedShare], tmp_path: Path) -> None:
    kubectl = tool("kubectl")
    for name, text in k8s(found).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    done = subprocess.run([kubectl, "kustomize", tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    kinds = [entry["kind"] for entry in yaml.safe_load_all(done.stdout)]
    assert sorted(kinds) == ["ConfigMap", "Deployment", "Deployment"]


def test_each_robot_of_a_fleet_is_an_overlay(found: list[ExportedShare], tmp_path: Path) -> None:
    kubectl = tool("kubectl")
    for folder in ("base", "second"):
        (tmp_path / folder).mkdir()
    for name, text in k8s([*found, SECRET]).items():
        (tmp_path / "base" / name).write_text(text, encoding="utf-8")
    (tmp_path / "second/kustomization.yaml").write_text(OVERLAY, encoding="utf-8")
    done = subprocess.run([kubectl, "kustomize", tmp_path / "second"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    made = {entry["metadata"]["name"]: entry for entry in yaml.safe_load_all(done.stdout)}
    pod = made["second-turtlebot-robot"]["spec"]["template"]["spec"]
    assert pod["nodeSelector"] == {"rbxcompose/host": "robot", "fleet": "second"}
    assert pod["volumes"][0]["configMap"]["name"] in made
    assert pod["containers"][0]["image"] == "robot:2"


def test_the_schemas_of_kubernetes_accept_the_manifests(found: list[ExportedShare]) -> None:
    validator = pytest.importorskip("kubernetes_validate", reason="needs kubernetes-validate")
    for text in k8s([*found, WITH_DEVICE, WITH_USB, SECRET]).values():
        if (one := yaml.safe_load(text))["kind"] != "Kustomization":
            validator.validate(one, validator.latest_version(), strict=True)


@pytest.mark.usefixtures("repository")
def test_secrets_are_named_and_never_written_down() -> None:
    text = k8s([SECRET])["arm-bench.yaml"]
    container = (pod := yaml.safe_load(text)["spec"]["template"]["spec"])["containers"][0]
    assert "# kubectl create secret generic arm-bench.api-key --from-file=value=secrets/api_key" in text
    assert container["env"][-1]["valueFrom"] == {"secretKeyRef": {"name": "arm-bench.api-key", "key": "value"}}
    certificates = {volume["name"]: volume for volume in pod["volumes"]}["certificates"]
    assert certificates["secret"]["secretName"] == "arm-bench-certificates"
    composed = yaml.safe_load(shares.compose_file([SECRET], system="lab", file=PATH))
    service = composed["services"]["arm-bench"]
    assert service["environment"] == ["RBX_SECRET_API_KEY"]
    assert {secret["source"] for secret in service["secrets"]} == composed["secrets"].keys()
    folder = folder_of("lab", {"XDG_CONFIG_HOME": CONFIGURATION}) / "bench"
    assert [secret["target"] for secret in service["secrets"]] == [str(folder / name) for name in CERTIFICATES]


def test_files_go_to_a_new_folder_only(repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", "compose", PATH, "--out", str(tmp_path / "new")]
    assert main(words) == 0
    assert (tmp_path / "new/project" / PATH).is_file()
    assert main(words) == 1
    assert "RBX6115" in capsys.readouterr().err
    assert main(["export", "k8s", "robots/turtlebot/robot.yaml", "--out", str(tmp_path / "other")]) == 1
    assert main(["export", "k8s", PATH, "--host", "dest", "--out", str(tmp_path / "other")]) == 1
    assert "did you mean 'desk'" in capsys.readouterr().err


def test_the_image_has_the_extras_and_the_packages_that_the_robots_need(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd = (
        "from rbxcompose.sdk import Component, Config, component\n@component('odd')\nclass Odd(Component[Config]): pass"
    )
    put(tmp_path / "site", "odd-package", {"component.odd": "odd_module"}, {"odd_module.py": odd})
    see(tmp_path / "site", monkeypatch)
    cpu = "components:\n  cpu: {type: cpu_monitor}\n"
    for name, components in {"one": f"{cpu}  odd: {{type: odd}}", "two": cpu}.items():
        (tmp_path / f"{name}.yaml").write_text(f"rbx: 1\nkind: Robot\nname: {name}\n{components}\n")
    robots = "robots: {one: {robot: one.yaml}, two: {robot: two.yaml}}"
    (tmp_path / "all.yaml").write_text(f"rbx: 1\nkind: System\nname: all\nhosts: {{here: {{}}}}\n{robots}\n")
    assert main(["export", "compose", str(tmp_path / "all.yaml"), "--out", str(tmp_path / "image")]) == 0
    wanted = f'pip install --no-cache-dir "rbxcompose[monitors]=={__version__}" "odd-package==1.0" &&'
    assert wanted in (tmp_path / "image/Dockerfile").read_text()


def test_a_service_manager_hears_that_all_is_up_and_that_the_supervisor_lives(tmp_path: Path) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(path)
        manager = ServiceManager({"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "10000000"})
        manager.notify(READY)
        manager.notify(ALIVE)
        assert [listener.recv(100), listener.recv(100)] == [READY, ALIVE]
        ServiceManager({"NOTIFY_SOCKET": path}).notify(ALIVE)
        ServiceManager({}).notify(READY)
        listener.setblocking(False)
        with pytest.raises(BlockingIOError):
            listener.recv(100)
