"""An ssh server on a host of a test: keys, configuration and known hosts in a folder of the test.

`RBXCOMPOSE_TEST_SSHD` may name the server; its libraries then are beside it, as in an unpacked package.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from tests.conftest import ROOT
from tests.systems.namespaces import Hosts, NotPermittedError

PORT = 2222
_PREPARED = """
mount -t tmpfs tmpfs /run && mkdir /run/sshd && mount --bind "$1" /etc/passwd || exit 1
shift; exec "$@"
"""
_SERVER = """
Port {port}
HostKey {folder}/host_key
AuthorizedKeysFile {folder}/user_key.pub
PidFile none
StrictModes no
UsePAM no
PermitRootLogin prohibit-password
SetEnv XDG_RUNTIME_DIR={home} TMPDIR={home}/temporary XDG_CACHE_HOME={home}/cache XDG_CONFIG_HOME={home}/config
"""
_CLIENT = """
Host {host}
  HostName {address}
  Port {port}
  User root
  IdentityFile {folder}/user_key
  IdentitiesOnly yes
  UserKnownHostsFile {folder}/known_hosts
  StrictHostKeyChecking yes
"""


def program() -> str:
    """Return the ssh server of this machine.

    Raises:
        NotPermittedError: if there is none.
    """
    found = os.environ.get("RBXCOMPOSE_TEST_SSHD") or shutil.which("sshd", path=f"{os.environ['PATH']}:/usr/sbin")
    if found is None or shutil.which("ssh-keygen") is None:
        raise NotPermittedError("there is no ssh server: apt install openssh-server")
    return found


def serve(hosts: Hosts, host: str) -> Path:
    """Start an ssh server on a host and return the configuration with which ssh reaches it by the host's name."""
    server, folder = program(), hosts.folder / f"ssh_{host}"
    folder.mkdir(mode=0o700)
    for key in ("host_key", "user_key"):
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", folder / key], check=True)
    address, public = hosts.addresses[host], (folder / "host_key.pub").read_text(encoding="utf-8")
    (folder / "known_hosts").write_text(f"[{address}]:{PORT} {public}", encoding="utf-8")
    values = {"folder": folder, "host": host, "address": address, "port": PORT, "home": hosts.folder / host}
    (folder / "sshd_config").write_text(_SERVER.format(**values), encoding="utf-8")
    (folder / "ssh_config").write_text(_CLIENT.format(**values), encoding="utf-8")
    passwd = Path("/etc/passwd").read_text(encoding="utf-8")
    users = passwd if "\nsshd:" in passwd else f"{passwd}sshd:x:64999:65534::/run/sshd:/usr/sbin/nologin\n"
    (folder / "passwd").write_text(users, encoding="utf-8")
    library = next((str(path.parent) for path in Path(server).parents[2].glob("usr/lib/*/libwrap.so.0")), "")
    words = (server, "-D", "-e", "-f", str(folder / "sshd_config"))
    environment = {"LD_LIBRARY_PATH": library} if library and server.startswith("/usr") is False else {}
    hosts.start(host, "sh", "-c", _PREPARED, "sh", str(folder / "passwd"), *words, environment=environment)
    _wait_for(hosts, host, folder / "ssh_config")
    return folder / "ssh_config"


def _wait_for(hosts: Hosts, host: str, config: Path) -> None:
    other = next(name for name in hosts.addresses if name != host)
    for _ in range(50):
        probe = hosts.start(other, "ssh", "-F", str(config), "-o", "BatchMode=yes", host, "true")
        output, _ = probe.communicate(timeout=20)
        if probe.returncode == 0:
            return
        time.sleep(0.1)
    raise NotPermittedError(f"the ssh server does not answer: {output.strip()}")


def wrapper(folder: Path) -> Path:
    """Write the program `rbxcompose` of a host: that of this repository."""
    path = folder / "rbxcompose"
    path.write_text(f'#!/bin/sh\nPYTHONPATH={ROOT} exec {sys.executable} -m rbxcompose "$@"\n', encoding="utf-8")
    path.chmod(0o755)
    return path
