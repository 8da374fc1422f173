"""`up SYSTEM` and `apply SYSTEM`: all hosts, or the share of one, `--host NAME`."""

import argparse
import json
import os
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

from rbxcompose.base.findings import Finding, Report, kind
from rbxcompose.commands import hosts
from rbxcompose.commands.console import FINDINGS, NotDoneError, ReportedError, emit, misused, refuse, write_report
from rbxcompose.commands.lookup import ALREADY_UP, NOT_UP
from rbxcompose.commands.targets import system_without_errors
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.compiler.systems.bundle import NOT_EXPORTED, Bundle, bundle_of
from rbxcompose.compiler.systems.certificates import NO_SECURITY, common_name, folder_of, tls_of
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.compiler.systems.neighbours import outlines_of
from rbxcompose.compiler.systems.share import exchange_of, robots_on, share_of
from rbxcompose.runtime.folder import ChosenLayers, RobotFolder, RunOptions, mark_start
from rbxcompose.runtime.supervision.plan_change import Fate
from rbxcompose.runtime.supervision.supervisor import SERVICE_MANAGER
from rbxcompose.sdk.capabilities import SharesWorld
from rbxcompose.tools.commands.security import certificate_findings
from rbxcompose.tools.inspection.plan_text import changes_text
from rbxcompose.tools.live_rules import LiveRules
from rbxcompose.tools.robot_changes import Proposal, carry_out, unsure
from rbxcompose.tools.run_view import machine_findings, run_plan

WHICH_HOST = kind("RBX6110")
OTHER_MACHINE = kind("RBX6111")
WHICH_ROBOT = kind("RBX6112")
REFUSED_THERE = kind("RBX6128")
OTHER_WORLD = kind("RBX6155")
Key = tuple[str, str]  # host and robot
_LOOK = 1.0  # [s] between two examinations of a machine that lacks something


def _bundle(system: System) -> Bundle:
    try:
        return bundle_of(system)
    except ValueError as error:
        raise NotDoneError(NOT_EXPORTED.at(None, f"the files of '{system.name}' cannot travel: {error}")) from error


def up_everywhere(path: str, system: System, arguments: argparse.Namespace) -> int:
    """Bring the files to all hosts, start all shares, and show what they write until the robots are down."""
    hosts.require_reachable(system)
    shares = _shares(system, arguments)
    bundle = _bundle(system)
    folders = hosts.reached(shares, bundle)
    shares = {key: share for key, share in shares.items() if share.is_here or share.name in folders}
    if arguments.detach and (up := _already_up(shares)):
        names = ", ".join(f"'{robot}' on '{host}'" for host, robot in up)
        if len(up) == len(shares):
            return refuse(ALREADY_UP.at(None, f"already up: {names}", help=f"rbxcompose down {path}"))
        emit(f"already up: {names}")
        shares = {key: share for key, share in shares.items() if key not in up}
    options = [*(["-d"] if arguments.detach else []), *(["--real"] if arguments.real else [])]
    options += [word for name in system.profiles for word in ("--profile", name)]
    options += ["--for", f"{arguments.duration} s"] if arguments.duration else []
    commands: dict[str, Sequence[str]] = {}
    for (host, robot), remote in shares.items():
        file = path if remote.is_here else bundle.system
        words = ["up", file, "--host", host, "--robot", robot, *options]
        folder = folders.get(host, "")
        commands[hosts.label_of(shares, host, robot)] = remote.rbxcompose(
            words, folder=folder, has_terminal=not arguments.detach
        )
    optional = [hosts.label_of(shares, *key) for key, share in shares.items() if share.model.optional]
    return hosts.follow_commands(commands, optional, partial(mark_start, is_over=True))


def _already_up(shares: hosts.Shares) -> list[Key]:
    """Return the shares whose supervisors live."""
    asked = hosts.on_all({" ".join(key): share.rbxcompose(["ps", key[1], "--json"]) for key, share in shares.items()})
    answers = {key: asked[" ".join(key)].answer for key in shares}
    return [key for key, answer in answers.items() if answer and (answer.get("supervisor") or {}).get("pid")]


def _shares(system: System, arguments: argparse.Namespace) -> hosts.Shares:
    """Return where the shares of the chosen robots run.

    Raises:
        NotDoneError: if the system has no such robot.
    """
    if (name := arguments.robot) is not None and name not in system.robots:
        message = f"the system has no robot '{name}'"
        raise NotDoneError(hosts.WHICH.misspelt(None, message, name, system.robots, "robots"))
    shares = hosts.shares_of(system, arguments.ssh_config)
    return {key: share for key, share in shares.items() if name in (None, key[1])}


def run_share(path: str, arguments: argparse.Namespace, options: RunOptions) -> int:
    """Compile a system and run what one host of it runs; return the exit code."""
    if options.is_stepped or arguments.watch:
        return misused("up", "a system runs in real time, without --rate and --watch")
    system = compiled_for(path, arguments, "up")
    there = {one for one, host in system.hosts.items() if host.ssh or arguments.host in (None, one)}
    shares = hosts.shares_of(system, arguments.ssh_config)
    hosts.remember(path, {key: share for key, share in shares.items() if key[0] in there})
    if arguments.host is None and any(host.ssh for host in system.hosts.values()):
        return up_everywhere(path, system, arguments)
    if arguments.host is None and len(system.hosts) == 1:
        (arguments.host,) = system.hosts
    chosen = chosen_robots(system, arguments)
    if len(chosen) > 1 and not arguments.detach:
        names = ", ".join(one.name for one in chosen)
        message = f"'{arguments.host}' runs several robots: {names}"
        return refuse(WHICH_ROBOT.at(None, message, help="add -d, or --robot NAME"))
    down = [robot.name for robot in chosen if not RobotFolder.of(robot.name).is_held]
    if len(down) < len(chosen) > 1:
        up = ", ".join(f"'{robot.name}'" for robot in chosen if robot.name not in down)
        help_text = (
            f"add --robot {' or --robot '.join(down)}, to start what is down" if down else f"rbxcompose down {path}"
        )
        return refuse(ALREADY_UP.at(None, f"already up: {up}", help=help_text))
    if (finding := _other_world_beside(path, system, chosen, arguments)) is not None:
        return refuse(finding)
    for robot in chosen:
        plan = planned(system, robot, arguments.host)
        if not _is_ready(partial(_machine_findings, plan, system, robot, arguments.host, path), system.sources):
            return FINDINGS
        own = replace(options, layers=layers_of(system, robot, real=arguments.real))
        rules, others_follow = LiveRules(robot.robot, (system, robot)), robot is not chosen[-1]
        if (exit_code := run_plan(plan, own, rules, others_follow=others_follow)) or not options.is_detached:
            return exit_code
    return 0


def compiled_for(path: str, arguments: argparse.Namespace, verb: str) -> System:
    """Return a system without errors, with the layers of a `verb`.

    Raises:
        ReportedError: if it has errors, or an option is not for systems.
    """
    for word, given in (("-f", arguments.overlays), ("--set or --no-mission", arguments.sets)):
        if given:
            raise ReportedError(misused(verb, f"{word} is for a robot; a system says itself what its robots are"))
    return system_without_errors(path, arguments.profile, real=arguments.real)


def layers_of(system: System, robot: PlacedRobot, *, real: bool) -> ChosenLayers:
    """Return the layers that a robot of a system is compiled with, for its supervisor to remember."""
    layers = ChosenLayers(profiles=(robot.model.profile,) if robot.model.profile else (), real=real)
    if system.path is None:
        return layers
    return replace(layers, system=str(system.path.resolve()), system_profiles=system.profiles, member=robot.name)


def chosen_robots(system: System, arguments: argparse.Namespace) -> list[PlacedRobot]:
    """Return the robots to run on this host.

    Raises:
        NotDoneError: if it is not clear which host this is, or it runs nothing of the robot.
    """
    host = arguments.host
    if host is None:
        message = "no host is named, and none of the system has 'ssh', by which all could be started from here"
        raise NotDoneError(WHICH_HOST.at(None, message, help=f"--host {' or --host '.join(system.hosts)}"))
    if host not in system.hosts:
        message = f"the system has no host '{host}'"
        raise NotDoneError(WHICH_HOST.misspelt(None, message, host, system.hosts, "hosts"))
    there = [robot for robot in robots_on(system, host) if arguments.robot in (None, robot.name)]
    if not there:
        what = f"'{arguments.robot}'" if arguments.robot else "any robot"
        raise NotDoneError(WHICH_HOST.at(None, f"'{host}' does not run anything of {what}"))
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


def _other_world_beside(
    path: str, system: System, chosen: Sequence[PlacedRobot], arguments: argparse.Namespace
) -> Finding | None:
    """Return the finding if the world of a robot that is up on this host has other robots than the system's.

    A robot that has only begun does not answer yet, and is not examined.
    """
    together = outlines_of(system.robots)
    if any(robot.name in together for robot in chosen):
        for robot in robots_on(system, arguments.host):
            if robot.name in together and robot not in chosen and RobotFolder.of(robot.name).is_held:
                with suppress(NotDoneError):
                    answer = _proposal(system, robot, arguments).data
                    if (finding := _other_world(path, system, robot.name, answer)) is not None:
                        return finding
    return None


def _other_world(path: str, system: System, robot: str, answer: Any) -> Finding | None:
    """Return the finding if robots enter or leave the world of a robot by a change, as its answer says."""
    components = answer.get("components", ()) if isinstance(answer, dict) else ()
    for name, reason in ((component["name"], reason) for component in components for reason in component["reasons"]):
        field, _, other = reason["key"].partition(".")
        if other and None in (reason["before"], reason["after"]):
            declared_there = system.robots[robot].robot.declared(SharesWorld)
            if any(one.name == name and shares.others.field == field for one, shares in declared_there):
                how = "new in" if reason["before"] is None else "no longer in"
                message = f"'{other}' is {how} the world of '{robot}', which is up and does not know that"
                return OTHER_WORLD.at(None, message, help=f"'rbxcompose down {path}', then 'up', for all in this world")
    return None


def _proposal(system: System, robot: PlacedRobot, arguments: argparse.Namespace) -> Proposal:
    layers = layers_of(system, robot, real=arguments.real)
    return Proposal.of(planned(system, robot, arguments.host), robot.robot, layers)


def _is_ready(examine: Callable[[], Report], sources: Mapping[str, str]) -> bool:
    """Show what this machine lacks for its share, and return whether it may start.

    A service manager starts it with the machine, whose network, clock and devices may come later: then it waits, and
    `down` does not wait for it.
    """
    write_report(found := examine(), sources)
    if found.has_errors and SERVICE_MANAGER in os.environ:
        sys.stderr.write("it starts as soon as this is mended\n")
        mark_start(is_over=True)
        while (found := examine()).has_errors:
            time.sleep(_LOOK)
        mark_start()
    return not found.has_errors


def _machine_findings(plan: Plan, system: System, robot: PlacedRobot, host: str, path: str) -> Report:
    report = machine_findings(_here(robot, host))
    if tls := (plan.share and plan.share.tls) or (plan.exchange and plan.exchange.tls):
        report.extend(certificate_findings(tls, common_name(system.name, host), path))
    if (problem := _address_problem(plan, host)) is not None:
        report.add(problem)
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


def apply_system(path: str, arguments: argparse.Namespace) -> int:
    """Change the robots of a system, or what one host runs of them; return the exit code."""
    if arguments.undo is not None:
        return misused("apply", "--undo is for a robot that runs on this machine, by its name")
    system = compiled_for(path, arguments, "apply")
    if arguments.host is not None:
        return _apply_here(system, arguments)
    hosts.require_reachable(system)
    exit_code = _SystemChange(path, system, _shares(system, arguments), arguments).run()
    _warn_of_former(path, system, arguments)
    return exit_code


def _warn_of_former(path: str, system: System, arguments: argparse.Namespace) -> None:
    """Report what was brought up from here, may still run, and is no longer of the system."""
    former = hosts.former(path, hosts.shares_of(system, arguments.ssh_config), arguments.ssh_config)
    asked = hosts.on_all({" ".join(key): share.rbxcompose(["ps", key[1]]) for key, share in former.items()})
    for host, robot in former:
        if not any(NOT_UP.code in line for line in asked[f"{host} {robot}"].lines):
            text = f"'{host}' may still run '{robot}', which the system no longer has there"
            sys.stderr.write(f"{text}: 'rbxcompose down {robot}' on that host ends it\n")


def _apply_here(system: System, arguments: argparse.Namespace) -> int:
    """Change what this machine runs as a host of the system."""
    for robot in chosen_robots(system, arguments):
        proposal = _proposal(system, robot, arguments)
        emit(json.dumps(proposal.data) if arguments.json else proposal.text())
        if exit_code := carry_out(proposal, arguments):
            return exit_code
    return 0


class _SystemChange:
    """A change of several hosts: all of them, or none."""

    def __init__(self, path: str, system: System, shares: hosts.Shares, arguments: argparse.Namespace) -> None:
        self._path, self._system, self._shares, self._arguments = path, system, shares, arguments

    def run(self) -> int:
        """Ask all hosts, then a person, then change one host after another."""
        bundle, arguments = _bundle(self._system), self._arguments
        self._folders = hosts.reached(self._shares, bundle, needs_all=not arguments.partial)
        self._file = bundle.system
        usable = {key: share for key, share in self._shares.items() if share.is_here or share.name in self._folders}
        asked = hosts.on_all({" ".join(key): self._command(key, "--dry-run") for key in usable})
        found = {key: _answer(asked[" ".join(key)]) for key in usable}
        lacks = any(key not in usable and not share.model.optional for key, share in self._shares.items())
        refused = {key: entry for key, entry in found.items() if isinstance(entry, str)}
        worlds = [_other_world(self._path, self._system, key[1], asked[" ".join(key)].answer) for key in refused]
        if problems := [finding for finding in worlds if finding]:
            together = outlines_of(self._system.robots)
            refused = {key: entry for key, entry in refused.items() if key[1] not in together}
        problems = [*problems[:1], *(_refusal(key, entry) for key, entry in refused.items())]
        is_refused = bool(problems) and not arguments.partial
        if arguments.json:
            answers = [{"host": host, "robot": robot, "answer": entry} for (host, robot), entry in found.items()]
            emit(json.dumps({"hosts": answers}))
        elif arguments.dry_run or not is_refused:
            self._show(found)
        for problem in problems:
            refuse(problem)
        wanted = [key for key, entry in found.items() if not isinstance(entry, str) and _changes(entry)]
        if is_refused:
            return FINDINGS
        if arguments.dry_run or not wanted:
            return FINDINGS if problems or lacks else 0
        if (exit_code := unsure(self._system.name, arguments)) is not None:
            return exit_code
        order = sorted(wanted, key=lambda key: not _removes(found[key]))
        return self._carry_out({key: found[key]["generation"] for key in order}) or (
            FINDINGS if problems or lacks else 0
        )

    def _show(self, found: Mapping[Key, Any]) -> None:
        for (host, _), one in found.items():
            if not isinstance(one, str):
                lines = changes_text(one).splitlines()
                kept = 0 if _touches(one) else len(one["components"])  # lines of components that stay as they are
                emit("\n".join(f"{host} | {line}" for line in (lines[0], *lines[kept + 1 :])))

    def _carry_out(self, generations: Mapping[Key, int]) -> int:
        """Change these shares, which are in these generations, in this order."""
        hosts.remember(self._path, self._shares)
        done: list[Key] = []
        for key, generation in generations.items():
            label = " ".join(key)
            problem = _answer(hosts.on_all({label: self._command(key, "--yes")})[label])
            if isinstance(problem, str):
                refuse(_refusal(key, problem))
                if not self._arguments.partial:
                    self._undo(key, generation, may_be_unchanged=True)
                    for one in reversed(done):
                        self._undo(one, generations[one])
                    return FINDINGS
                continue
            done.append(key)
            self._tell(f"{label}: changed")
        return 0 if len(done) == len(generations) else FINDINGS

    def _undo(self, key: Key, generation: int, *, may_be_unchanged: bool = False) -> None:
        """Take the change of a share in this generation back, and report it."""
        words = ["apply", key[1], "--undo", str(generation), "--yes", "--json"]
        label = " ".join(key)
        answer = _answer(hosts.on_all({label: self._shares[key].rbxcompose(words)})[label])
        if not isinstance(answer, str):
            self._tell(f"{label}: as before")
        elif not may_be_unchanged:
            refuse(_refusal(key, answer))

    def _tell(self, text: str) -> None:
        if not self._arguments.json:
            emit(text)

    def _command(self, key: Key, how: str) -> list[str]:
        (host, robot), remote = key, self._shares[key]
        file = self._path if remote.is_here else self._file
        words = ["apply", file, "--host", host, "--robot", robot, how, "--json"]
        words += ["--real"] if self._arguments.real else []
        words += [word for name in self._system.profiles for word in ("--profile", name)]
        return remote.rbxcompose(words, folder=self._folders.get(host, ""))


def _refusal(key: Key, why: str) -> Finding:
    return REFUSED_THERE.at(None, f"'{key[0]}' does not change '{key[1]}': {why}")


def _answer(running: hosts.Running) -> Any:
    """Return the answer of a host as data, or a text: why it did not do it."""
    exit_code, answer = running.wait(), running.answer
    if exit_code == 0 and isinstance(answer, dict):
        return answer
    if isinstance(answer, dict) and (answer.get("error") or answer.get("why_not")):
        return str(answer.get("error") or answer["why_not"])
    errors = [line for line in running.lines if line.startswith("error")] or running.lines
    return errors[-1] if errors else f"exit code {exit_code}"


def _changes(answer: Mapping[str, Any]) -> bool:
    return bool(answer["shares_change"]) or _touches(answer)


def _touches(answer: Mapping[str, Any]) -> bool:
    return any(component["fate"] != Fate.KEPT for component in answer["components"])


def _removes(answer: Mapping[str, Any]) -> bool:
    return any(component["fate"] == Fate.REMOVED for component in answer["components"])
