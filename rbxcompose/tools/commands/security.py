"""Make the certificates of a system's hosts, or list what listens where and who may reach it.

`init` makes an authority, once, and new certificates for all hosts, and brings them to those with `ssh`; repeat it
before they expire. Of robots that are up on this machine, `audit` lists the ports that they have, else those of the
plan. It exits with 1 if anything off loopback takes strangers, who need no proof, or if other hosts will refuse a
certificate that is on this machine.
Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

import argparse
import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from itertools import groupby
from pathlib import Path

from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import Finding, Report, Severity, kind
from rbxcompose.base.requests import Refused, to_data
from rbxcompose.commands.console import FINDINGS, emit, refuse, write_report
from rbxcompose.commands.lookup import known_state, robots_up
from rbxcompose.commands.options import Subcommand, add_actions, add_system_options, argument, is_system, run_action
from rbxcompose.commands.targets import system_without_errors
from rbxcompose.compiler.plan.model import LinkTls
from rbxcompose.compiler.systems import certificates
from rbxcompose.compiler.systems.model import System
from rbxcompose.compiler.systems.share import OpenedEndpoints, listeners, reachable_keys
from rbxcompose.runtime.control import NoAnswerError, ask
from rbxcompose.runtime.requests import DescribeRobot
from rbxcompose.sdk.capabilities import ServesPage, Setting

GROUP = "system"
NOT_MADE = kind("RBX6116")
_RECEIVE = """set -e; umask 077
d="${XDG_CONFIG_HOME:-$HOME/.config}/rbxcompose/systems/NAME/HOST"
mkdir -p "$d"; tar -xf - -C "$d"
"""
SOON = 30.0  # [days] before a certificate expires
NO_CERTIFICATE = kind("RBX6117")
REFUSED_CERTIFICATE = kind("RBX6143")
SOON_EXPIRED = kind("RBX6144", Severity.WARNING)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    system = (argument("path", metavar="SYSTEM", help="the file of the system"), add_system_options)
    json_ = argument("--json", action="store_true", help="answer in JSON")
    actions = (
        Subcommand("init", "make certificates for all hosts", _init, system),
        Subcommand("audit", "list what listens, and who may reach it", _audit, (*system, json_)),
    )
    add_actions(parser, actions, usual="audit")


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    if not is_system(arguments.path):
        return refuse(NOT_MADE.at(None, f"'{arguments.path}' is not the file of a system"))
    return run_action(arguments, system_without_errors(arguments.path, arguments.profile))


def _init(system: System, arguments: argparse.Namespace) -> int:
    folder = certificates.folder_of(system.name, os.environ)
    try:
        certificates.make_authority(folder, system.name)
        for name, host in system.hosts.items():
            certificates.make_certificate(folder, system.name, name, host.address)
            if host.ssh is not None and (problem := _bring(system, name, folder / name, arguments)):
                return refuse(problem)
            there = f", brought to {host.ssh}" if host.ssh else ""
            emit(f"{name}: {folder / name}{there}")
    except (certificates.OpensslError, OSError) as error:
        return refuse(NOT_MADE.at(None, f"the certificates cannot be made: {error}"))
    if system.security == certificates.NO_SECURITY:
        emit("the system does not use them yet: it has no 'security: mtls'")
    return 0


def _bring(system: System, host: str, folder: Path, arguments: argparse.Namespace) -> Finding | None:
    from rbxcompose.commands.hosts import Remote  # starts programs, which `audit` does not need
    from rbxcompose.compiler.systems.bundle import BundledFile, archive_of

    remote = Remote(host, system.hosts[host], arguments.ssh_config)
    script = _RECEIVE.replace("NAME", system.name).replace("HOST", host)
    files = {
        name: BundledFile(read_regular(folder / name, certificates.LARGEST), 0o600)
        for name in (certificates.AUTHORITY, certificates.CERTIFICATE, certificates.KEY)
    }
    done = subprocess.run(remote.ssh(script), input=archive_of(files), capture_output=True, check=False)
    if done.returncode == 0:
        return None
    reason = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no reason given"]
    return NOT_MADE.at(None, f"'{host}' cannot be given its certificate: {reason[0]}")


def _audit(system: System, arguments: argparse.Namespace) -> int:
    endpoints, keys = list(listeners(system, dict(_opened(system)))), list(reachable_keys(system))
    report = Report([*_certificates(system, arguments.path)])
    if arguments.json:
        emit(json.dumps({"listeners": to_data(endpoints), "keys": to_data(keys)}))
    else:
        for end in endpoints:
            warning = "  OPEN TO STRANGERS" if end.is_open else ""
            emit(f"{end.host}  {end.robot}  {end.endpoint}  {end.reached_by}, {end.proof}{warning}")
        for (host, robot, whom), same in groupby(keys, key=lambda key: (key.host, key.robot, key.written_by)):
            who = " and ".join((*whom, "programs there"))
            emit(f"{host}  {robot}  written, called or answered by {who}: {', '.join(item.name for item in same)}")
    write_report(report, {})
    return FINDINGS if report.has_errors or any(endpoint.is_open for endpoint in endpoints) else 0


def _opened(system: System) -> Iterator[tuple[tuple[str, str], OpenedEndpoints]]:
    """Yield what robots of the system that are up on this machine have opened, by robot and host."""
    for folder in robots_up():
        robot, state = system.robots.get(folder.path.name), known_state(folder)
        if robot is None or state is None or state.router is None or not state.is_supervised:
            continue
        with suppress(NoAnswerError, Refused):  # it has just begun, or ends
            pages = (page for one in ask(folder, DescribeRobot()) for page in one.capabilities.get("ServesPage", ()))
            found = tuple(ServesPage(**{name: Setting(value) for name, value in page.items()}) for page in pages)
            for host in {robot.hosts[one.name] for one in state.components if one.name in robot.hosts}:
                yield (robot.name, host), OpenedEndpoints(state.router, found)


def _certificates(system: System, path: str) -> Iterator[Finding]:
    """Yield what is wrong with the certificates that are on this machine."""
    folder = certificates.folder_of(system.name, os.environ)
    for host in system.hosts if system.security != certificates.NO_SECURITY else ():
        if (folder / host).is_dir():
            yield from certificate_findings(
                certificates.tls_of(folder, host, system.security), certificates.common_name(system.name, host), path
            )


def certificate_findings(tls: LinkTls, name: str, path: str) -> Iterator[Finding]:
    """Yield what keeps other hosts from accepting the certificate of a host, or soon will; `name` must be in it."""
    again = f"rbxcompose security init {path}"
    if lacking := certificates.missing(tls):
        yield NO_CERTIFICATE.at(None, f"'{lacking[0]}' cannot be read", help=again)
        return
    try:
        if (days := certificates.days_left(tls, name)) < SOON:
            yield SOON_EXPIRED.at(None, f"'{tls.certificate}' expires in {days:.0f} days", help=again)
    except (certificates.CertificateError, OSError) as error:
        yield REFUSED_CERTIFICATE.at(None, f"other hosts will refuse '{tls.certificate}': {error}", help=again)
