"""The shares of a system, for what keeps them alive: units of systemd, a Compose file, manifests of Kubernetes.

Certificates and other secrets are in none of these: they come from the host, or are objects that the files name.
"""

import base64
import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import yaml

from rbxcompose.base.config import Config, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.bundle import BundledFile
from rbxcompose.compiler.systems.certificates import AUTHORITY, CERTIFICATE, KEY, NO_SECURITY
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.share import exchange_of, hosts_of, share_of
from rbxcompose.manifest.fill import VARIABLE
from rbxcompose.sdk.capabilities import OpensPort
from rbxcompose.sdk.registry import component_type

GRACE = 5.0  # [s] to go down beside the time to come to rest
MEMORY, PROCESSES = "1G", 500  # of a share at most; a robot with an arm needs a fifth of it
CERTIFICATES = (AUTHORITY, CERTIFICATE, KEY)
STATE = "/state"  # in a container: where snapshots of missions are, which outlive it
CONFIGURATION = "/run/config"  # in a container: where `CERTIFICATES` are, as in `~/.config`
FILE = "{file}"
LONGEST = 63  # characters of a label in Kubernetes, or of a name there
_DIGITS = 8
_ALL = "/dev"
_USB_DRIVERS = {"ttyACM": 166, "ttyUSB": 188}  # of serial ports on USB, with their numbers in the kernel
WATCHDOG = 10  # [s]
_SANDBOX = """
NoNewPrivileges=yes
CapabilityBoundingSet=
ProtectSystem=strict
ProtectHome=read-only
PrivateTmp=yes
ProtectKernelTunables=yes
ProtectKernelModules=yes
ProtectKernelLogs=yes
ProtectControlGroups=yes
ProtectClock=yes
ProtectHostname=yes
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK
RestrictNamespaces=yes
RestrictSUIDSGID=yes
LockPersonality=yes
SystemCallArchitectures=native
UMask=0077
DevicePolicy=closed
"""
PROJECT = "/robot"  # the folder of the manifests in the image
_DOCKERFILE = """FROM python:3.11-slim
RUN pip install --no-cache-dir {requirements} && useradd --create-home robot && install -d -o robot -m 700 {state}
COPY project {project}
USER robot
WORKDIR {project}
ENV XDG_RUNTIME_DIR=/run/robot XDG_CONFIG_HOME={configuration} XDG_STATE_HOME={state} NO_COLOR=1
ENTRYPOINT ["rbxcompose"]
"""
MOST_BYTES = 1_000_000  # of a ConfigMap, which etcd limits
KUSTOMIZATION = "kustomization.yaml"
ROBOT, HOST = "rbxcompose/robot", "rbxcompose/host"  # labels
USER, DIALOUT = 1000, 20  # numbers of the image's user, and of the group that opens serial ports


def joined_name(*names: str) -> str:
    """Return names joined to one that other programs take: of small letters, digits and '-' within.

    Other names make another one. Since '-' stands between names and for '_', that is so only if no name but the first
    has a '_'; else a number is added that depends on all of them, as to a name that is cut.
    """
    whole = "-".join(names)
    made = whole.replace("_", "-")
    if "_" not in "".join(names[1:]) and not made.endswith("-") and len(made) <= LONGEST:
        return made
    number = int(hashlib.sha256(whole.encode()).hexdigest(), 16) % 10**_DIGITS
    return f"{made[: LONGEST - _DIGITS - 1].rstrip('-')}-{number:0{_DIGITS}}"


@dataclass(frozen=True, slots=True)
class ExportedShare:
    """The share of a host of a robot; `devices` are paths of serial ports, `rest_time` [s] is until it stands still.

    `has_usb` says that it also opens ports that it looks up by the device, so each serial port on USB may be the one.
    """

    system: str
    robot: str
    host: str
    command: tuple[str, ...]  # after the program's name; `{file}` stands for the path of the system's file
    devices: tuple[str, ...]
    rest_time: float
    has_certificates: bool = False
    secrets: tuple[str, ...] = ()  # that its manifest refers to
    has_usb: bool = False

    @property
    def name(self) -> str:
        """Return a name that no other share of the system has."""
        return joined_name(self.robot, self.host)

    @property
    def mounted(self) -> tuple[str, ...]:
        """Return what of `/dev` a container has."""
        return (_ALL,) if self.has_usb else self.devices

    @property
    def certificates(self) -> str:
        """Return the folder of its certificates below that of configurations."""
        return f"rbxcompose/systems/{self.system}/{self.host}"


def shares(system: System, host: str | None = None) -> Iterator[ExportedShare]:
    """Yield the shares of a system, or those of one host, in the order of its file."""
    for robot in system.robots.values():
        for other in hosts_of(system, robot):
            if host in (None, other):
                plan = share_of(system, robot, other)
                real = () if plan.is_simulated else ("--real",)
                profiles = tuple(word for name in system.profiles for word in ("--profile", name))
                words = ("up", FILE, "--host", other, "--robot", robot.name, *profiles, *real)
                ports = _ports(plan)
                is_linked = plan.share is not None or exchange_of(system, robot, other) is not None
                yield ExportedShare(
                    system.name,
                    robot.name,
                    other,
                    words,
                    tuple(port for port in ports if port.startswith("/dev/")),
                    _rest_time(plan),
                    is_linked and system.security != NO_SECURITY,
                    tuple(sorted({name for each in plan.instances for name in _secrets(each.config)})),
                    has_usb=not all(port.startswith("/") for port in ports),
                )


def _ports(plan: Plan) -> list[str]:
    opened = (component_type(instance.type).capabilities(instance.config) for instance in plan.instances)
    return sorted({each.port.value for capabilities in opened for each in capabilities if isinstance(each, OpensPort)})


def _secrets(value: object) -> Iterator[str]:
    """Yield the names of all secrets in a configuration."""
    match value:
        case Secret():
            yield value.name
        case Config():
            yield from (name for _, one in value for name in _secrets(one))
        case Mapping():
            yield from (name for entry in value.values() for name in _secrets(entry))
        case tuple():
            yield from (name for item in value for name in _secrets(item))


def _rest_time(plan: Plan) -> float:
    return max((component_type(instance.type).rest_time(instance.config) for instance in plan.instances), default=0.0)


def unit_name(share: ExportedShare) -> str:
    """Return the file name of a share's unit."""
    return f"rbxcompose-{share.name}.service"


def unit(share: ExportedShare, *, program: str, file: str, user: str) -> str:
    """Return the unit of a share; `program` and `file`, the system's file, are absolute paths on the host."""
    return "\n".join(_lines(share, program, file, user)) + "\n"


def _lines(share: ExportedShare, program: str, file: str, user: str) -> Iterator[str]:
    words = " ".join(_quoted(file if word == FILE else word) for word in share.command)
    yield f"# '{share.robot}' on host '{share.host}', from the system '{share.system}'. Install it:"
    yield f"#   sudo cp {unit_name(share)} /etc/systemd/system/ && sudo systemctl enable --now {unit_name(share)}"
    yield f"# As {user}, with XDG_RUNTIME_DIR=/run/rbxcompose-{share.name}, 'rbxcompose ps' and other verbs find it."
    yield "[Unit]"
    yield f"Description=Robot {share.robot}, share of host {share.host}"
    yield "Wants=network-online.target"
    yield f"After=network-online.target{' time-sync.target' if share.has_certificates else ''}"  # they have dates
    yield "StartLimitIntervalSec=60"
    yield "StartLimitBurst=5"
    yield ""
    yield "[Service]"
    yield "Type=notify"
    yield "NotifyAccess=all"
    yield f"WatchdogSec={WATCHDOG}"
    yield "TimeoutStartSec=infinity"  # it waits for the other hosts
    yield f"User={user}"
    yield f"RuntimeDirectory=rbxcompose-{share.name}"
    yield "RuntimeDirectoryMode=0700"
    yield "RuntimeDirectoryPreserve=yes"  # its log stays
    yield f"StateDirectory=rbxcompose-{share.name}"  # for snapshots of missions
    yield "StateDirectoryMode=0700"
    folders = f"XDG_RUNTIME_DIR=/run/rbxcompose-{share.name} XDG_STATE_HOME=/var/lib/rbxcompose-{share.name}"
    yield f"Environment={folders} NO_COLOR=1"
    yield f"ExecStart={_quoted(program)} {words}"
    yield "Restart=on-failure"
    yield "RestartSec=1"
    yield "RestartPreventExitStatus=1 2 3"  # findings, wrong usage, a failed mission: another try changes none
    yield "SuccessExitStatus=130"
    yield "KillMode=mixed"
    yield f"TimeoutStopSec={share.rest_time + GRACE:g}"
    yield _SANDBOX.strip()
    for device in share.devices:
        yield f"DeviceAllow={device} rw"
    for driver in _USB_DRIVERS if share.has_usb else ():
        yield f"DeviceAllow=char-{driver} rw"
    if share.mounted:
        yield "SupplementaryGroups=dialout"
    yield ""
    yield "[Install]"
    yield "WantedBy=multi-user.target"


def _quoted(word: str) -> str:
    """Return a word as systemd reads it."""
    plain = word.replace("%", "%%").replace("$", "$$")
    return f'"{plain}"' if " " in plain or '"' in plain or "\\" in plain else plain


def dockerfile(requirements: Iterable[str]) -> str:
    """Return the Dockerfile; pip installs the requirements, the folder `project` beside it has the system's files."""
    words = " ".join(f'"{requirement}"' for requirement in requirements)  # a shell reads it
    return _DOCKERFILE.format(requirements=words, project=PROJECT, configuration=CONFIGURATION, state=STATE)


def compose_file(given: Sequence[ExportedShare], *, system: str, file: str) -> str:
    """Return the Compose file; `file` is that of the system in the project. Routers need the network of the host."""
    made: dict[str, Any] = {
        "name": joined_name(system),
        "services": {share.name: _service(share, f"{PROJECT}/{file}") for share in given},
        "volumes": {f"{share.name}-state": {} for share in given},
    }
    if secrets := {name: {"file": path} for share in given for name, path, _ in _certificates(share)}:
        made["secrets"] = secrets
    text = yaml.safe_dump(made, sort_keys=False, width=120)
    return f"# On each host: docker compose --profile HOST up -d\n{text}"


def _certificates(share: ExportedShare) -> Iterator[tuple[str, str, str]]:
    """Yield name of a secret, file on the host, and file in the container."""
    for name in CERTIFICATES if share.has_certificates else ():
        path = f"{share.certificates}/{name}"
        yield (f"{share.name}-{name.partition('.')[0]}", f"${{HOME}}/.config/{path}", f"{CONFIGURATION}/{path}")


def _service(share: ExportedShare, file: str) -> dict[str, Any]:
    service: dict[str, Any] = {
        "build": ".",
        "profiles": [share.host],
        "command": [file if word == FILE else word for word in share.command],
        "network_mode": "host",
        "init": True,
        "read_only": True,
        "tmpfs": ["/run/robot:mode=0700,uid=1000", "/tmp"],  # noqa: S108 - of the container
        "volumes": [f"{share.name}-state:{STATE}"],
        "shm_size": "256mb",
        "mem_limit": MEMORY.lower(),
        "pids_limit": PROCESSES,
        "cap_drop": ["ALL"],
        "security_opt": ["no-new-privileges:true"],
        "restart": "on-failure:5",
        "stop_grace_period": f"{share.rest_time + GRACE:g}s",
        "healthcheck": {
            "test": ["CMD", "rbxcompose", "ps", share.robot],
            "interval": "5s",
            "timeout": "5s",
            "retries": 3,
            "start_period": "30s",
        },
    }
    if share.has_usb:  # what is plugged in later appears in the folder, and the rules say what may be opened there
        service["volumes"].append(f"{_ALL}:{_ALL}")
        service["device_cgroup_rules"] = [f"c {major}:* rw" for major in _USB_DRIVERS.values()]
    if share.mounted:
        service["group_add"] = ["dialout"]
    if share.devices:
        service["devices"] = [f"{device}:{device}" for device in share.devices]
    if share.has_certificates:
        service["secrets"] = [{"source": name, "target": target} for name, _, target in _certificates(share)]
    if share.secrets:
        service["environment"] = [f"{VARIABLE}{name.upper()}" for name in share.secrets]  # as the host has them
    return service


def kubernetes_manifests(
    given: Sequence[ExportedShare], *, system: str, file: str, files: Mapping[str, BundledFile], image: str
) -> dict[str, str]:
    """Return the manifests by file name; `files` are those of the system by their paths, `file` is its own.

    Raises:
        ValueError: if the files are too large for a ConfigMap.
    """
    if sum(len(one.data) for one in files.values()) > MOST_BYTES:
        raise ValueError(f"its files have more than {MOST_BYTES:,} bytes, the limit of a ConfigMap")
    name = joined_name(system)
    found: dict[str, Any] = {"files.yaml": _config_map(name, files)}
    found |= {f"{share.name}.yaml": _deployment(share, name, file, files, image) for share in given}
    found[KUSTOMIZATION] = {
        "apiVersion": "kustomize.config.k8s.io/v1beta1",
        "kind": "Kustomization",
        "resources": sorted(found),
        "labels": [{"pairs": {"app.kubernetes.io/part-of": name}}],
    }
    texts = {path: yaml.safe_dump(entry, sort_keys=False, width=120) for path, entry in found.items()}
    for share in given:
        texts[f"{share.name}.yaml"] = "".join(f"# {line}\n" for line in _needed(share)) + texts[f"{share.name}.yaml"]
    return texts


def _needed(share: ExportedShare) -> Iterator[str]:
    """Yield what to type so that its node and its secrets exist; these are never written to a file of ours."""
    yield f"kubectl label node NODE {HOST}={_label(share.host)}"
    if share.has_certificates:
        files = " ".join(f"--from-file=$HOME/.config/{share.certificates}/{name}" for name in CERTIFICATES)
        yield f"kubectl create secret generic {share.name}-certificates {files}"
    for name in share.secrets:
        yield f"kubectl create secret generic {_secret(share, name)} --from-file=value=secrets/{name}"


def _secret(share: ExportedShare, name: str) -> str:
    return f"{share.name}.{joined_name(name.lower())}"  # no other share has this one: names have no dots


def _variable(share: ExportedShare, name: str) -> dict[str, Any]:
    reference = {"name": _secret(share, name), "key": "value"}
    return {"name": f"{VARIABLE}{name.upper()}", "valueFrom": {"secretKeyRef": reference}}


def _label(name: str) -> str:
    """Return a name as the value of a label, which may have a '_' within."""
    return name if name[-1].isalnum() and len(name) <= LONGEST else joined_name(name)


def _key(path: str) -> str:
    """Return the key of a file in a ConfigMap, which takes neither slashes nor all characters of paths."""
    key = re.sub(r"[^-.\w]", "_", path.replace("/", ".."), flags=re.ASCII)
    if re.fullmatch(r"[-.\w/]{1,200}", path, re.ASCII) and not re.search(r"[./]\.|\./", path):
        return key
    return f"{hashlib.sha256(path.encode()).hexdigest()[:16]}-{key[-200:]}"  # else another path could have the same


def _config_map(name: str, files: Mapping[str, BundledFile]) -> dict[str, Any]:
    parts: dict[str, dict[str, str]] = {"data": {}, "binaryData": {}}
    for path, one in sorted(files.items()):
        try:
            parts["data"][_key(path)] = one.data.decode("utf-8")
        except UnicodeDecodeError:
            parts["binaryData"][_key(path)] = base64.b64encode(one.data).decode()
    filled = {part: entries for part, entries in parts.items() if entries}
    return {"apiVersion": "v1", "kind": "ConfigMap", "metadata": {"name": f"{name}-files"}, **filled}


def _deployment(
    share: ExportedShare, system: str, file: str, files: Mapping[str, BundledFile], image: str
) -> dict[str, Any]:
    labels = {"app.kubernetes.io/name": share.name, ROBOT: _label(share.robot), HOST: _label(share.host)}
    return {
        "apiVersion": "apps/v1",
        "kind": "Deployment",
        "metadata": {"name": share.name, "labels": labels},
        "spec": {
            "replicas": 1,
            "strategy": {"type": "Recreate"},  # a robot runs once
            "selector": {"matchLabels": {"app.kubernetes.io/name": share.name}},
            "template": {"metadata": {"labels": labels}, "spec": _pod(share, system, file, files, image)},
        },
    }


def _pod(share: ExportedShare, system: str, file: str, files: Mapping[str, BundledFile], image: str) -> dict[str, Any]:
    items = [{"key": _key(path), "path": path, "mode": one.mode} for path, one in sorted(files.items())]
    volumes: list[dict[str, Any]] = [
        {"name": "files", "configMap": {"name": f"{system}-files", "items": items}},
        {"name": "run", "emptyDir": {"medium": "Memory"}},
        {"name": "tmp", "emptyDir": {}},
        {"name": "state", "emptyDir": {}},  # kept while the pod is on its node, also when its container restarts
        {"name": "shm", "emptyDir": {"medium": "Memory", "sizeLimit": "256Mi"}},
    ]
    if share.has_certificates:
        secret = {"secretName": f"{share.name}-certificates", "defaultMode": 0o440}
        volumes.append({"name": "certificates", "secret": secret})
    volumes += [{"name": f"device-{n}", "hostPath": {"path": path}} for n, path in enumerate(share.mounted)]
    return {
        "nodeSelector": {HOST: _label(share.host)},
        "hostNetwork": True,  # its router listens at the address of the host
        "dnsPolicy": "ClusterFirstWithHostNet",
        "automountServiceAccountToken": False,
        "terminationGracePeriodSeconds": round(share.rest_time + GRACE),
        "securityContext": {
            "runAsNonRoot": True,
            "runAsUser": USER,
            "fsGroup": USER,  # may read its secrets
            "supplementalGroups": [DIALOUT] if share.mounted else [],
            "seccompProfile": {"type": "RuntimeDefault"},
        },
        "containers": [_container(share, file, image)],
        "volumes": volumes,
    }


def _container(share: ExportedShare, file: str, image: str) -> dict[str, Any]:
    probe = {"exec": {"command": ["rbxcompose", "ps", share.robot]}, "timeoutSeconds": 5}
    mounts = [("files", PROJECT), ("run", "/run/robot"), ("tmp", "/tmp"), ("shm", "/dev/shm")]  # noqa: S108 - of the pod
    mounts.append(("state", STATE))
    if share.has_certificates:
        mounts.append(("certificates", f"{CONFIGURATION}/{share.certificates}"))
    mounts += [(f"device-{n}", path) for n, path in enumerate(share.mounted)]
    return {
        "name": "share",
        "image": image,
        "args": [f"{PROJECT}/{file}" if word == FILE else word for word in share.command],
        "env": [
            {"name": "XDG_RUNTIME_DIR", "value": "/run/robot"},
            {"name": "XDG_CONFIG_HOME", "value": CONFIGURATION},
            {"name": "XDG_STATE_HOME", "value": STATE},
            *(_variable(share, name) for name in share.secrets),
        ],
        "startupProbe": {**probe, "periodSeconds": 2, "failureThreshold": 60},
        "livenessProbe": {**probe, "periodSeconds": 10, "failureThreshold": 3},
        "resources": {"requests": {"cpu": "100m", "memory": "128Mi"}, "limits": {"memory": f"{MEMORY}i"}},
        "securityContext": {
            "privileged": bool(share.mounted),  # devices of the host are open to nobody else
            "allowPrivilegeEscalation": bool(share.mounted),
            "readOnlyRootFilesystem": True,
            **({} if share.mounted else {"capabilities": {"drop": ["ALL"]}}),
        },
        "volumeMounts": [{"name": name, "mountPath": path} for name, path in mounts],
    }
