"""`apply SYSTEM`: all hosts are asked what would change; if none refuses, they change one after another."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from typing import Any

from rbxcompose.base.findings import Finding, kind
from rbxcompose.commands.console import FINDINGS, NotDoneError, emit, misused, refuse
from rbxcompose.commands.hosts import Running, Shares, is_reachable, on_all, reached, shares_of
from rbxcompose.compiler.systems.bundle import bundle_of
from rbxcompose.compiler.systems.model import System
from rbxcompose.runtime.supervision.changes import Fate
from rbxcompose.tools.inspection.plan_text import changes_text
from rbxcompose.tools.robot_changes import Proposal, carry_out, unsure
from rbxcompose.tools.up_system import chosen_robots, compiled_for, layers_of, planned

REFUSED_THERE = kind("RBX6128")
Key = tuple[str, str]  # host and robot


def apply_system(path: str, arguments: argparse.Namespace) -> int:
    """Change the robots of a system, or what one host runs of them; return the exit code."""
    if arguments.undo is not None:
        return misused("apply", "--undo is for a robot that runs on this machine, by its name")
    system = compiled_for(path, arguments, "apply")
    if isinstance(system, int):
        return system
    if arguments.host is not None:
        return _apply_here(system, arguments)
    if not is_reachable(system):
        return FINDINGS
    shares = shares_of(system, arguments.ssh_config)
    shares = {key: share for key, share in shares.items() if arguments.robot in (None, key[1])}
    change = _SystemChange(path, system, shares, arguments)
    return change.run()


def _apply_here(system: System, arguments: argparse.Namespace) -> int:
    """Change what this machine runs as a host of the system."""
    chosen = chosen_robots(system, arguments)
    if isinstance(chosen, Finding):
        return refuse(chosen)
    try:
        for robot in chosen:
            plan, layers = planned(system, robot, arguments.host), layers_of(system, robot, real=arguments.real)
            proposal = Proposal.of(plan, robot.robot, layers)
            emit(json.dumps(proposal.data) if arguments.json else proposal.text())
            if exit_code := carry_out(proposal, arguments):
                return exit_code
    except NotDoneError as error:
        return refuse(error.finding)
    return 0


class _SystemChange:
    """A change of several hosts: all of them, or none."""

    def __init__(self, path: str, system: System, shares: Shares, arguments: argparse.Namespace) -> None:
        self._path, self._system, self._shares, self._arguments = path, system, shares, arguments

    def run(self) -> int:
        """Ask all hosts, then a person, then change one host after another."""
        bundle, arguments = bundle_of(self._system), self._arguments
        folders = reached(self._shares, bundle, needs_all=not arguments.partial)
        if folders is None:
            return FINDINGS
        self._folders, self._file = folders, bundle.system
        usable = {key: share for key, share in self._shares.items() if share.is_here or share.name in self._folders}
        asked = on_all({" ".join(key): self._command(key, "--dry-run") for key in usable})
        found = {key: _answer(asked[" ".join(key)]) for key in usable}
        lacks = any(key not in usable and not share.model.optional for key, share in self._shares.items())
        problems = [_refusal(key, entry) for key, entry in found.items() if isinstance(entry, str)]
        if arguments.json:
            emit(
                json.dumps(
                    {"hosts": [{"host": key[0], "robot": key[1], "answer": entry} for key, entry in found.items()]}
                )
            )
        else:
            self._show(found)
        for problem in problems:
            refuse(problem)
        wanted = [key for key, entry in found.items() if not isinstance(entry, str) and _changes(entry)]
        if problems and not arguments.partial:
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
                emit("\n".join(f"{host} | {line}" for line in (lines if _touches(one) else lines[:1])))

    def _carry_out(self, generations: Mapping[Key, int]) -> int:
        """Change these shares, which are in these generations, in this order."""
        done: list[Key] = []
        for key, generation in generations.items():
            label = " ".join(key)
            problem = _answer(on_all({label: self._command(key, "--yes")})[label])
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
        answer = _answer(on_all({label: self._shares[key].rbxcompose(words)})[label])
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


def _answer(running: Running) -> Any:
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
