"""Make the certificates of a system's hosts, or list what listens where and who may reach it.

`init` makes an authority, once, and new certificates for all hosts, and brings them to those with `ssh`; repeat it
before they expire. `audit` exits with 1 if anything off loopback takes strangers.
Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.project.kinds import is_system
from rbxcompose.cli.systems.options import add_system_options
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, kind
from rbxcompose.regular_files import read_regular
from rbxcompose.systems.certificates import (
    AUTHORITY,
    CERTIFICATE,
    KEY,
    LARGEST,
    NO_SECURITY,
    OpensslError,
    folder_of,
    make_authority,
    make_certificate,
)
from rbxcompose.systems.model import System
from rbxcompose.systems.reader import compile_system
from rbxcompose.systems.share import hosts_of, listens
from rbxcompose.typed_json import to_data

NOT_MADE = kind(
    "RBX6116",
    """Certificates cannot be made or brought to a host

`security init` needs OpenSSL, a folder that it may write to, and `ssh` to the hosts that have it. A host without `ssh`
keeps its files on this machine, or gets a copy of its folder by hand.

Bad: `rbxcompose security init robots/turtlebot/robot.yaml`
Good: `rbxcompose security init systems/two_hosts.yaml`
""",
)
_RECEIVE = """set -e; umask 077
d="${XDG_CONFIG_HOME:-$HOME/.config}/rbxcompose/systems/NAME/HOST"
mkdir -p "$d"; tar -xf - -C "$d"
"""


@dataclass(frozen=True, slots=True)
class ListeningEndpoint:
    """An endpoint that takes connections on a host: who may reach it, and how they prove who they are."""

    host: str
    robot: str
    endpoint: str
    reached_by: str
    proof: str
    is_open: bool  # to strangers


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="init|audit", required=True)
    for name, about in (
        ("init", "make certificates for all hosts"),
        ("audit", "list what listens, and who may reach it"),
    ):
        action = actions.add_parser(name, help=about)
        action.add_argument("path", metavar="SYSTEM", help="the file of the system")
        if name == "init":
            add_system_options(action)
        else:
            action.add_argument("--json", action="store_true", help="answer in JSON")


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    if not is_system(arguments.path):
        return refuse(NOT_MADE.at(None, f"'{arguments.path}' is not the file of a system"))
    system = compile_system(arguments.path, environment=os.environ)
    tell_report(system.report, system.sources)
    if system.report.has_errors:
        return FINDINGS
    return _init(system, arguments) if arguments.action == "init" else _audit(system, in_json=arguments.json)


def _init(system: System, arguments: argparse.Namespace) -> int:
    folder = folder_of(system.name, os.environ)
    try:
        make_authority(folder, system.name)
        for name, host in system.hosts.items():
            make_certificate(folder, system.name, name, host.address)
            if host.ssh is not None and (problem := _bring(system, name, folder / name, arguments)):
                return refuse(problem)
            there = f", brought to {host.ssh}" if host.ssh else ""
            tell(f"{name}: {folder / name}{there}")
    except (OpensslError, OSError) as error:
        return refuse(NOT_MADE.at(None, f"the certificates cannot be made: {error}"))
    if system.security == NO_SECURITY:
        tell("the system does not use them yet: it has no 'security: mtls'")
    return 0


def _bring(system: System, host: str, folder: Path, arguments: argparse.Namespace) -> Finding | None:
    from rbxcompose.cli.systems.remote import Remote  # starts programs, which `audit` does not need
    from rbxcompose.systems.bundle import archive_of

    remote = Remote(host, system.hosts[host], arguments.ssh_config)
    script = _RECEIVE.replace("NAME", system.name).replace("HOST", host)
    files = {name: read_regular(folder / name, LARGEST) for name in (AUTHORITY, CERTIFICATE, KEY)}
    done = subprocess.run(remote.ssh(script), input=archive_of(files, mode=0o600), capture_output=True, check=False)
    if done.returncode == 0:
        return None
    reason = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no reason is told"]
    return NOT_MADE.at(None, f"'{host}' cannot be given its certificate: {reason[0]}")


def _audit(system: System, *, in_json: bool) -> int:
    found = list(listeners(system))
    if in_json:
        tell(json.dumps({"listeners": [to_data(one) for one in found]}))
    else:
        for one in found:
            warning = "  OPEN TO STRANGERS" if one.is_open else ""
            tell(f"{one.host}  {one.robot}  {one.endpoint}  {one.reached_by}, {one.proof}{warning}")
    return FINDINGS if any(one.is_open for one in found) else 0


def listeners(system: System) -> Iterator[ListeningEndpoint]:
    """Yield what listens on each host of a system, as far as other machines or users can reach it."""
    proofs = {
        NO_SECURITY: ("no proof asked", True),
        "tls": ("encrypted, but no proof asked of who dials", True),
        "mtls": ("a certificate of this system", False),
    }
    for robot in system.robots.values():
        for host in hosts_of(system, robot):
            bus = robot.plan.bus
            if bus.router is None and bus.access == "machine":
                local = ListeningEndpoint(
                    host, robot.name, f"tcp/127.0.0.1:{bus.port}", "programs of this machine", "", False
                )
                yield replace(local, proof="no proof asked")
            for endpoint in listens(system, robot, host):
                yield ListeningEndpoint(host, robot.name, endpoint, "machines of the network", *proofs[system.security])
