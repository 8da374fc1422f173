"""Manifests of Kubernetes: one pod for each share, on the node with the label `rbxcompose/host: NAME`, and the files.

A Kustomize base, so that each robot of a fleet is an overlay with a name, an image and nodes of its own. Certificates
and other secrets are objects of the kind Secret, which the manifests name and do not contain.
"""

import base64
import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml

from rbxcompose.compiler.systems.bundle import BundledFile
from rbxcompose.manifest.fill import VARIABLE
from rbxcompose.tools.exporting.compose import PROJECT
from rbxcompose.tools.exporting.exported_share import (
    CERTIFICATES,
    CONFIGURATION,
    FILE,
    GRACE,
    LONGEST,
    MEMORY,
    ExportedShare,
    joined_name,
)

MOST_BYTES = 1_000_000  # of a ConfigMap, which etcd limits
KUSTOMIZATION = "kustomization.yaml"
ROBOT, HOST = "rbxcompose/robot", "rbxcompose/host"  # labels
USER, DIALOUT = 1000, 20  # numbers of the image's user, and of the group that opens serial ports


def manifests(
    shares: Sequence[ExportedShare], *, system: str, file: str, files: Mapping[str, BundledFile], image: str
) -> dict[str, str]:
    """Return the manifests by file name; `files` are those of the system by their paths, `file` is its own.

    Raises:
        ValueError: if the files are too large for a ConfigMap.
    """
    if sum(len(one.data) for one in files.values()) > MOST_BYTES:
        raise ValueError(f"its files have more than {MOST_BYTES:,} bytes, the limit of a ConfigMap")
    name = joined_name(system)
    found: dict[str, Any] = {"files.yaml": _config_map(name, files)}
    found |= {f"{share.name}.yaml": _deployment(share, name, file, files, image) for share in shares}
    found[KUSTOMIZATION] = {
        "apiVersion": "kustomize.config.k8s.io/v1beta1",
        "kind": "Kustomization",
        "resources": sorted(found),
        "labels": [{"pairs": {"app.kubernetes.io/part-of": name}}],
    }
    texts = {path: yaml.safe_dump(entry, sort_keys=False, width=120) for path, entry in found.items()}
    for share in shares:
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
        {"name": "shm", "emptyDir": {"medium": "Memory", "sizeLimit": "256Mi"}},
    ]
    if share.has_certificates:
        secret = {"secretName": f"{share.name}-certificates", "defaultMode": 0o440}
        volumes.append({"name": "certificates", "secret": secret})
    volumes += [{"name": f"device-{n}", "hostPath": {"path": path}} for n, path in enumerate(share.devices)]
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
            "supplementalGroups": [DIALOUT] if share.devices else [],
            "seccompProfile": {"type": "RuntimeDefault"},
        },
        "containers": [_container(share, file, image)],
        "volumes": volumes,
    }


def _container(share: ExportedShare, file: str, image: str) -> dict[str, Any]:
    probe = {"exec": {"command": ["rbxcompose", "ps", share.robot]}, "timeoutSeconds": 5}
    mounts = [("files", PROJECT), ("run", "/run/robot"), ("tmp", "/tmp"), ("shm", "/dev/shm")]  # noqa: S108 - of the pod
    if share.has_certificates:
        mounts.append(("certificates", f"{CONFIGURATION}/{share.certificates}"))
    mounts += [(f"device-{n}", path) for n, path in enumerate(share.devices)]
    return {
        "name": "share",
        "image": image,
        "args": [f"{PROJECT}/{file}" if word == FILE else word for word in share.command],
        "env": [
            {"name": "XDG_RUNTIME_DIR", "value": "/run/robot"},
            {"name": "XDG_CONFIG_HOME", "value": CONFIGURATION},
            *(_variable(share, name) for name in share.secrets),
        ],
        "startupProbe": {**probe, "periodSeconds": 2, "failureThreshold": 60},
        "livenessProbe": {**probe, "periodSeconds": 10, "failureThreshold": 3},
        "resources": {"requests": {"cpu": "100m", "memory": "128Mi"}, "limits": {"memory": f"{MEMORY}i"}},
        "securityContext": {
            "privileged": bool(share.devices),  # devices of the host are open to nobody else
            "allowPrivilegeEscalation": bool(share.devices),
            "readOnlyRootFilesystem": True,
            **({} if share.devices else {"capabilities": {"drop": ["ALL"]}}),
        },
        "volumeMounts": [{"name": name, "mountPath": path} for name, path in mounts],
    }
