"""See, command and follow many robots of systems at once, chosen by their labels.

A label is one of `labels` of a robot, its name, or the name that its instances have in common; of several, a robot
must have all. Without a SYSTEM, the only one of the project is meant.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import kind
from rbxcompose.base.levels import LOG_LEVELS
from rbxcompose.commands import hosts
from rbxcompose.commands.console import FINDINGS, NotDoneError, emit, refuse, table
from rbxcompose.commands.lookup import NO_ANSWER, NO_SUPERVISOR, NOT_UP
from rbxcompose.commands.options import (
    Subcommand,
    add_actions,
    add_system_options,
    argument,
    count_from_zero,
    run_action,
)
from rbxcompose.missions.execution.requests import MISSION

GROUP = "system"
NO_LABEL = kind("RBX6130")
_COLUMNS = ("robot", "host", "state", "mission", "battery")
ShareFacts = tuple[
    str, str, dict[str, Any]
]  # robot, host, and what `top` reports about the share, or its `state` alone
_UP = "up"
_DOWN = {"state": "down"}
_STATES = {NOT_UP.code: "down", NO_SUPERVISOR: "supervisor dead", NO_ANSWER.code: "no answer"}  # by what `top` says


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    paths = argument("paths", metavar="SYSTEM", nargs="*", help="files of systems")
    label = argument("--label", action="append", default=[], dest="labels", metavar="L", help="only robots with it")
    chosen = (paths, label, add_system_options)
    json_ = argument("--json", action="store_true", help="answer in JSON")
    mission = argument("mission", metavar="MISSION", help="which one")
    sets = argument("--set", action="append", default=[], dest="sets", metavar="K=V", help="give it an input")
    level = argument("--level", choices=LOG_LEVELS, default="info", help="the lowest level to show")
    follow = argument("-f", "--follow", action="store_true", help="follow new records, until interrupted")
    words = "start with the last N records of each"
    lines = argument("-n", "--lines", type=count_from_zero, metavar="N", help=words)
    actions = (
        Subcommand("ls", "list robots: hosts, state, mission, batteries", _list, (*chosen, json_)),
        Subcommand("run", "start a mission on each", _run, (mission, sets, *chosen, json_)),
        Subcommand("logs", "show the logs of all, each line with its robot", _follow, (level, follow, lines, *chosen)),
    )
    add_actions(parser, actions)


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    from rbxcompose.commands.targets import UNNAMED, systems_here  # the compiler, which completion does not need

    paths = arguments.paths or systems_here()
    if not arguments.paths and len(paths) != 1:
        message = f"no system is named, and this folder has {', '.join(paths) if paths else 'none'}"
        return refuse(UNNAMED.at(None, message, help="give the path of one"))
    return run_action(arguments, Fleet.of(paths, arguments))


@dataclass(frozen=True, slots=True)
class Fleet:
    """The shares of the chosen robots; to run a mission, among them those that run missions."""

    shares: hosts.Shares
    executives: hosts.Shares

    @classmethod
    def of(cls, paths: Sequence[str], arguments: argparse.Namespace) -> Fleet:
        """Return the robots of systems that have all labels of the command.

        Raises:
            NotDoneError: if there is none, or two have the same name.
        """
        shares: hosts.Shares = {}
        executives: hosts.Shares = {}
        known: set[str] = set()
        for path in paths:
            needs_all = arguments.action == "run"
            system, every = hosts.compiled(path, arguments, needs_all=needs_all)
            for name in dict.fromkeys(robot for _, robot in every):
                labels = system.labels.get(name, frozenset({name}))
                known |= labels
                if not labels >= {*arguments.labels}:
                    continue
                own = {key: share for key, share in every.items() if key[1] == name}
                if own.keys() & shares.keys():
                    message = f"two of these systems have a robot '{name}' on a host of the same name"
                    raise NotDoneError(hosts.WHICH.at(None, message, help="name the systems in two commands"))
                shares = {**shares, **own}
                there = hosts.answering(system.robots[name], MISSION) if needs_all else ()
                executives = {**executives, **{(host, name): every[host, name] for host in there}}
        if not shares:
            wrong = next((label for label in arguments.labels if label not in known), "")
            message = f"no robot has the label{'s' * (len(arguments.labels) > 1)} {' and '.join(arguments.labels)}"
            raise NotDoneError(NO_LABEL.misspelt(None, message, wrong, sorted(known), "labels"))
        return cls(shares, executives)


def _list(fleet: Fleet, arguments: argparse.Namespace) -> int:
    """List the robots; return the exit code, which is that of findings if a share cannot be reached or is down."""
    commands = {" ".join(key): share.rbxcompose(["top", key[1], "--json"]) for key, share in fleet.shares.items()}
    asked = hosts.on_all(commands)
    known = [(*key, _facts(asked[" ".join(key)]), share.is_former) for key, share in fleet.shares.items()]
    found = sorted((robot, host, facts) for host, robot, facts, is_former in known if facts != _DOWN or not is_former)
    rows = [_row(robot, list(shares)) for robot, shares in groupby(found, key=lambda row: row[0])]
    shown = table([_COLUMNS, *([row[column] for column in _COLUMNS] for row in rows)])
    emit(json.dumps({"robots": rows}) if arguments.json else shown)
    return FINDINGS if any(row["state"] != _UP for row in rows) else 0


def _run(fleet: Fleet, arguments: argparse.Namespace) -> int:
    """Start a mission on each robot that has missions."""
    if not fleet.executives:
        return refuse(NO_LABEL.at(None, "none of these robots runs missions"))
    words = [arguments.mission, *(word for set_ in arguments.sets for word in ("--set", set_))]
    words += ["--json", "--robot"] if arguments.json else ["--robot"]
    return hosts.ask_all(fleet.executives, lambda robot: ["mission", "run", *words, robot], in_json=arguments.json)


def _follow(fleet: Fleet, arguments: argparse.Namespace) -> int:
    """Show the logs of all."""
    options = ["--level", arguments.level, *(["-f"] if arguments.follow else [])]
    options += ["-n", str(arguments.lines)] if arguments.lines is not None else []
    return hosts.follow_all(fleet.shares, lambda robot: ["logs", robot, *options])


def _facts(one: hosts.Running) -> dict[str, Any]:
    """Return what is known of a share."""
    answer = one.answer
    if isinstance(answer, dict) and "components" in answer:
        return answer
    if one.wait() == hosts.SSH_FAILED:
        return {"state": "unreachable"}
    for mark, state in _STATES.items():
        if any(mark in line for line in one.lines):
            return {"state": state}
    problem = answer.get("error", "") if isinstance(answer, dict) else one.lines[-1] if one.lines else ""
    return {"state": problem or "no answer"}


def _row(robot: str, shares: Sequence[ShareFacts]) -> dict[str, str]:
    answers = [facts for _, _, facts in shares]
    states = [_state(facts) for facts in answers]
    several = len(shares) > 1
    wrong = [f"{host} {state}" if several else state for (_, host, _), state in zip(shares, states, strict=True)]
    return {
        "robot": robot,
        "host": ", ".join(host for _, host, _ in shares),
        "state": _UP if set(states) == {_UP} else ", ".join(text for text in wrong if not text.endswith(_UP)),
        "mission": "; ".join(filter(None, map(_mission, answers))),
        "battery": ", ".join(text for facts in answers for text in facts.get("batteries", {}).values()),
    }


def _mission(facts: Mapping[str, Any]) -> str:
    """Return the missions that run; without any, what the executive reported last."""
    running = "; ".join(f"{one['state']} {one['mission']}" for one in facts.get("missions", ()))
    return running or str(facts.get("mission", ""))


def _state(facts: Mapping[str, Any]) -> str:
    if "components" not in facts:
        return str(facts["state"])
    off = [component["name"] for component in facts["components"] if component["state"] != "active"]
    return f"{', '.join(off)} not active" if off else _UP
