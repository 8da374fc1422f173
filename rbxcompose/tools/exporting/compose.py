"""A Dockerfile and a Compose file: one service for each share, in a profile with the name of its host.

Certificates and other secrets are in neither: they come from the host, as Compose's secrets and its environment.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import yaml

from rbxcompose.manifest.fill import VARIABLE
from rbxcompose.tools.exporting import exported_share

PROJECT = "/robot"  # the folder of the manifests in the image
_DOCKERFILE = """FROM python:3.11-slim
RUN pip install --no-cache-dir {requirements} && useradd --create-home robot
COPY project {project}
USER robot
WORKDIR {project}
ENV XDG_RUNTIME_DIR=/run/robot XDG_CONFIG_HOME={configuration} NO_COLOR=1
ENTRYPOINT ["rbxcompose"]
"""


def dockerfile(requirements: Iterable[str]) -> str:
    """Return the Dockerfile; pip installs the requirements, the folder `project` beside it has the system's files."""
    words = " ".join(f'"{requirement}"' for requirement in requirements)  # a shell reads it
    return _DOCKERFILE.format(requirements=words, project=PROJECT, configuration=exported_share.CONFIGURATION)


def compose_file(shares: Iterable[exported_share.ExportedShare], *, system: str, file: str) -> str:
    """Return the Compose file; `file` is that of the system in the project. Routers need the network of the host."""
    given = list(shares)
    made: dict[str, Any] = {
        "name": exported_share.joined_name(system),
        "services": {share.name: _service(share, f"{PROJECT}/{file}") for share in given},
    }
    if secrets := {name: {"file": path} for share in given for name, path, _ in _certificates(share)}:
        made["secrets"] = secrets
    text = yaml.safe_dump(made, sort_keys=False, width=120)
    return f"# On each host: docker compose --profile HOST up -d\n{text}"


def _certificates(share: exported_share.ExportedShare) -> Iterator[tuple[str, str, str]]:
    """Yield name of a secret, file on the host, and file in the container."""
    for name in exported_share.CERTIFICATES if share.has_certificates else ():
        path = f"{share.certificates}/{name}"
        yield (
            f"{share.name}-{name.partition('.')[0]}",
            f"${{HOME}}/.config/{path}",
            f"{exported_share.CONFIGURATION}/{path}",
        )


def _service(share: exported_share.ExportedShare, file: str) -> dict[str, Any]:
    service: dict[str, Any] = {
        "build": ".",
        "profiles": [share.host],
        "command": [file if word == exported_share.FILE else word for word in share.command],
        "network_mode": "host",
        "init": True,
        "read_only": True,
        "tmpfs": ["/run/robot:mode=0700,uid=1000", "/tmp"],  # noqa: S108 - of the container
        "shm_size": "256mb",
        "mem_limit": exported_share.MEMORY.lower(),
        "pids_limit": exported_share.PROCESSES,
        "cap_drop": ["ALL"],
        "security_opt": ["no-new-privileges:true"],
        "restart": "on-failure:5",
        "stop_grace_period": f"{share.rest_time + exported_share.GRACE:g}s",
        "healthcheck": {
            "test": ["CMD", "rbxcompose", "ps", share.robot],
            "interval": "5s",
            "timeout": "5s",
            "retries": 3,
            "start_period": "30s",
        },
    }
    if share.devices:
        service |= {"devices": [f"{device}:{device}" for device in share.devices], "group_add": ["dialout"]}
    if share.has_certificates:
        service["secrets"] = [{"source": name, "target": target} for name, _, target in _certificates(share)]
    if share.secrets:
        service["environment"] = [f"{VARIABLE}{name.upper()}" for name in share.secrets]  # as the host has them
    return service
