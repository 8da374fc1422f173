"""`up SYSTEM`: all hosts, or the share of one: `--host NAME`."""

from __future__ import annotations

import argparse
import os
import socket
import sys
from collections.abc import Sequence
from dataclasses import replace

from rbxcompose.base.findings import Finding, Report, kind
from rbxcompose.commands.console import FINDINGS, misused, refuse, write_report
from rbxcompose.commands.hosts import follow_commands, is_reachable, label_of, reached, shares_of
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.bundle import bundle_of
from rbxcompose.compiler.systems.certificates import NO_SECURITY, common_name, folder_of, tls_of
from rbxcompose.compiler.systems.exchange import exchange_of
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.compiler.systems.reader import compile_system
from rbxcompose.compiler.systems.share import robots_on, share_of
from rbxcompose.runtime.folder import ChosenLayers, RunOptions
from rbxcompose.tools.commands.security import certificate_findings
from rbxcompose.tools.live_rules import LiveRules
from rbxcompose.tools.run_view import is_fit, run_plan


def up_everywhere(path: str, system: System, arguments: argparse.Namespace) -> int:
    """Bring the files to all hosts, start all shares, and show what they write until the robots are down."""
    if not is_reachable(system):
        return FINDINGS
    shares = shares_of(system, arguments.ssh_config)
    bundle = bundle_of(system)
    folders = reached(shares, bundle)
    if folders is None:
        return FINDINGS
    shares = {key: share for key, share in shares.items() if share.is_here or share.name in folders}
    options = [*(["-d"] if arguments.detach else []), *(["--real"] if arguments.real else [])]
    options += [word for name in system.profiles for word in ("--profile", name)]
    options += ["--for", f"{arguments.duration} s"] if arguments.duration else []
    commands: dict[str, Sequence[str]] = {}
    for (host, robot), remote in shares.items():
        file = path if remote.is_here else bundle.system
        words = ["up", file, "--host", host, "--robot", robot, *options]
        folder = folders.get(host, "")
        commands[label_of(shares, host, robot)] = remote.rbxcompose(
            words, folder=folder, has_terminal=not arguments.detach
        )
    return follow_commands(commands, [label_of(shares, *key) for key, share in shares.items() if share.model.optional])


USAGE = 2
WHICH_HOST = kind("RBX6110")
OTHER_MACHINE = kind("RBX6111")
WHICH_ROBOT = kind("RBX6112")


def run_share(path: str, arguments: argparse.Namespace, options: RunOptions) -> int:
    """Compile a system and run what one host of it runs; return the exit code."""
    if options.is_stepped or arguments.watch:
        sys.stderr.write("rbxcompose up: a system runs in real time, without --rate and --watch\n")
        return USAGE
    system = compiled_for(path, arguments, "up")
    if isinstance(system, int):
        return system
    if arguments.host is None and any(host.ssh for host in system.hosts.values()):
        return up_everywhere(path, system, arguments)
    chosen = chosen_robots(system, arguments)
    if isinstance(chosen, Finding):
        return refuse(chosen)
    if len(chosen) > 1 and not arguments.detach:
        names = ", ".join(one.name for one in chosen)
        message = f"'{arguments.host}' runs several robots: {names}"
        return refuse(WHICH_ROBOT.at(None, message, help="add -d, or --robot NAME"))
    for robot in chosen:
        plan = planned(system, robot, arguments.host)
        if not is_fit(_here(robot, arguments.host), system.sources):
            return FINDINGS
        write_report(found := _certificate_findings(plan, system, arguments.host, path), {})
        if found.has_errors:
            return FINDINGS
        if (problem := _address_problem(plan, arguments.host)) is not None:
            return refuse(problem)
        own = replace(options, layers=layers_of(system, robot, real=arguments.real))
        if (exit_code := run_plan(plan, own, LiveRules(robot.robot))) or not options.is_detached:
            return exit_code
    return 0


def compiled_for(path: str, arguments: argparse.Namespace, verb: str) -> System | int:
    """Return a system without errors, with the layers of a `verb`; the exit code after telling what is wrong."""
    for word, given in (("-f", arguments.overlays), ("--set", arguments.sets)):
        if given:
            return misused(verb, f"{word} is for a robot; a system says itself what its robots are")
    system = compile_system(path, environment=os.environ, real=arguments.real, profiles=arguments.profile)
    write_report(system.report, system.sources)
    return FINDINGS if system.report.has_errors else system


def layers_of(system: System, robot: PlacedRobot, *, real: bool) -> ChosenLayers:
    """Return the layers that a robot of a system is compiled with, for its supervisor to remember."""
    layers = ChosenLayers(profiles=(robot.model.profile,) if robot.model.profile else (), real=real)
    if system.path is None or not robot.robot.outside.skills:
        return layers
    return replace(layers, system=str(system.path.resolve()), system_profiles=system.profiles, member=robot.name)


def chosen_robots(system: System, arguments: argparse.Namespace) -> list[PlacedRobot] | Finding:
    """Return the robots to run on this host."""
    host = arguments.host
    if host is None:
        message = "no host is named, and none of the system has 'ssh', by which all could be started from here"
        return WHICH_HOST.at(None, message, help=f"--host {' or --host '.join(system.hosts)}")
    if host not in system.hosts:
        return WHICH_HOST.misspelt(None, f"the system has no host '{host}'", host, system.hosts, "hosts")
    there = [robot for robot in robots_on(system, host) if arguments.robot in (None, robot.name)]
    if not there:
        what = f"'{arguments.robot}'" if arguments.robot else "any robot"
        return WHICH_HOST.at(None, f"'{host}' does not run anything of {what}")
    return there


def _here(robot: PlacedRobot, host: str) -> Robot:
    """Return the robot with what runs on a host only."""
    here = {name: component for name, component in robot.robot.components.items() if robot.hosts.get(name) == host}
    return replace(robot.robot, components=here)


def planned(system: System, robot: PlacedRobot, host: str) -> Plan:
    """Return what a host runs of a robot, with what it carries between robots, and with its certificates."""
    plan, exchange = share_of(system, robot, host), exchange_of(system, robot, host)
    tls = None
    if system.security != NO_SECURITY:
        tls = tls_of(folder_of(system.name, os.environ), host, system.security)
    share = replace(plan.share, tls=tls) if plan.share else None
    return replace(plan, share=share, exchange=replace(exchange, tls=tls) if exchange else None)


def _certificate_findings(plan: Plan, system: System, host: str, path: str) -> Report:
    report = Report()
    if tls := (plan.share and plan.share.tls) or (plan.exchange and plan.exchange.tls):
        report.extend(certificate_findings(tls, common_name(system.name, host), path))
    return report


def _address_problem(plan: Plan, host: str) -> Finding | None:
    """Return the finding if this machine cannot listen where the other hosts dial it."""
    for endpoint in (*(plan.share.listen if plan.share else ()), *(plan.exchange.listen if plan.exchange else ())):
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
