"""Runs the share of one host of a system: `up SYSTEM --host NAME`."""

from __future__ import annotations

import argparse
import os
import socket
import sys
from dataclasses import replace

from rbxcompose.cli.output.console import FINDINGS, refuse, tell_report
from rbxcompose.cli.robots.run_view import run_plan
from rbxcompose.cli.robots.this_machine import is_fit
from rbxcompose.cli.systems.everywhere import up_everywhere
from rbxcompose.findings import Finding, kind
from rbxcompose.model.robot import Robot
from rbxcompose.plan.model import Plan
from rbxcompose.runtime.options import RunOptions
from rbxcompose.systems.certificates import NO_SECURITY, folder_of, missing, tls_of
from rbxcompose.systems.model import PlacedRobot, System
from rbxcompose.systems.reader import compile_system
from rbxcompose.systems.share import robots_on, share_of

USAGE = 2
WHICH_HOST = kind(
    "RBX6110",
    """It is not clear which host this is

`up SYSTEM --host NAME` runs what the system places on the host of this name. Without `--host`, `up` starts all hosts by
their `ssh`; a host without it is the machine of the command.

Bad: `rbxcompose up systems/two_hosts.yaml --host rboot`
Good: `rbxcompose up systems/two_hosts.yaml --host robot`
""",
)
OTHER_MACHINE = kind(
    "RBX6111",
    """The host has another address

The routers of the other hosts dial the `address` of a host, so its own router listens there. This machine does not have
that address: it is another one, or its network is not up yet.

Bad: `rbxcompose up systems/two_hosts.yaml --host robot`, on the desk.
Good: `rbxcompose up systems/two_hosts.yaml --host desk`, on the desk.
""",
)
NO_CERTIFICATE = kind(
    "RBX6117",
    """The host has no certificate

With `security: tls` or `mtls`, each host needs a certificate of the system, its key, and the certificate of the
authority. They are in `~/.config/rbxcompose/systems/SYSTEM/HOST` of the user that runs it. `security init` makes them
and brings them to hosts that have `ssh`.

Bad: `rbxcompose up systems/two_hosts.yaml --host robot`, on a robot that never got its files.
Good: `rbxcompose security init systems/two_hosts.yaml` on the desk, then the same.
""",
)
WHICH_ROBOT = kind(
    "RBX6112",
    """The host runs several robots

In the foreground, `up` shows one robot. With `-d` it starts all of the host; `--robot NAME` chooses one.

Bad: `rbxcompose up systems/fleet.yaml --host hall`, which runs two robots.
Good: `rbxcompose up systems/fleet.yaml --host hall -d`
""",
)


def run_share(path: str, arguments: argparse.Namespace, options: RunOptions) -> int:
    """Compile a system and run what one host of it runs; return the exit code."""
    for word, given in (("--profile", arguments.profile), ("-f", arguments.overlays), ("--set", arguments.sets)):
        if given:
            sys.stderr.write(f"rbxcompose up: {word} is for a robot; a system says itself what its robots are\n")
            return USAGE
    if options.is_stepped or arguments.watch:
        sys.stderr.write("rbxcompose up: a system runs in real time, without --rate and --watch\n")
        return USAGE
    system = compile_system(path, environment=os.environ, real=arguments.real)
    tell_report(system.report, system.sources)
    if system.report.has_errors:
        return FINDINGS
    if arguments.host is None and any(one.ssh for one in system.hosts.values()):
        return up_everywhere(path, system, arguments)
    chosen = _chosen(system, arguments)
    if isinstance(chosen, Finding):
        return refuse(chosen)
    for robot in chosen:
        plan = share_of(system, robot, arguments.host)
        if not is_fit(_here(robot, arguments.host), system.sources):
            return FINDINGS
        plan = _secured(plan, system)
        problem = _certificate_problem(plan, path) or _address_problem(plan, arguments.host)
        if problem is not None:
            return refuse(problem)
        if (exit_code := run_plan(plan, options)) or not options.is_detached:
            return exit_code
    return 0


def _chosen(system: System, arguments: argparse.Namespace) -> list[PlacedRobot] | Finding:
    """Return the robots to run on this host."""
    host = arguments.host
    if host is None:
        message = "no host is named, and none of the system has 'ssh', by which all could be started from here"
        return WHICH_HOST.at(None, message, help=f"--host {' or --host '.join(system.hosts)}")
    if host not in system.hosts:
        return WHICH_HOST.misspelt(None, f"the system has no host '{host}'", host, system.hosts, "hosts")
    there = [one for one in robots_on(system, host) if arguments.robot in (None, one.name)]
    if not there:
        what = f"'{arguments.robot}'" if arguments.robot else "any robot"
        return WHICH_HOST.at(None, f"'{host}' does not run anything of {what}")
    if len(there) > 1 and not arguments.detach:
        names = ", ".join(one.name for one in there)
        return WHICH_ROBOT.at(None, f"'{host}' runs several robots: {names}", help="add -d, or --robot NAME")
    return there


def _here(robot: PlacedRobot, host: str) -> Robot:
    """Return the robot with what runs on a host only."""
    here = {name: one for name, one in robot.robot.components.items() if robot.hosts.get(name) == host}
    return replace(robot.robot, components=here)


def _secured(plan: Plan, system: System) -> Plan:
    """Return the plan with the certificates of its host."""
    if plan.share is None or system.security == NO_SECURITY:
        return plan
    tls = tls_of(folder_of(system.name, os.environ), plan.share.host, system.security)
    return replace(plan, share=replace(plan.share, tls=tls))


def _certificate_problem(plan: Plan, path: str) -> Finding | None:
    if plan.share is None or plan.share.tls is None or not (lacking := missing(plan.share.tls)):
        return None
    return NO_CERTIFICATE.at(None, f"'{lacking[0]}' cannot be read", help=f"rbxcompose security init {path}")


def _address_problem(plan: Plan, host: str) -> Finding | None:
    """Return the finding if this machine cannot listen where the other hosts dial it."""
    for endpoint in plan.share.listen if plan.share else ():
        address, _, port = endpoint.partition("/")[2].rpartition(":")
        try:
            found = socket.getaddrinfo(address.strip("[]"), int(port), type=socket.SOCK_STREAM)
            with socket.socket(found[0][0], socket.SOCK_STREAM) as probe:
                probe.bind((found[0][4][0], 0))
        except OSError as error:
            reason = error.strerror or "it is not known"
            message = f"this machine cannot listen at {address}, the address of '{host}': {reason}"
            return OTHER_MACHINE.at(None, message, help="check 'hosts' of the system, and --host")
    return None
