"""Run, hold, watch, debug, draw, try and explore the missions of a robot.

Exit codes: 0 fine, 1 refused or errors found, 2 wrong usage.
"""

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from rbxcompose.base.clock import local_time
from rbxcompose.base.requests import Command, Query, Refused, to_data
from rbxcompose.commands.console import NotDoneError, emit, table
from rbxcompose.commands.lookup import REFUSED, WHICH, add_asking_options, answer_of, find_robot, pass_on
from rbxcompose.commands.options import (
    Declare,
    Subcommand,
    add_actions,
    add_unsaved_option,
    argument,
    deferred,
    out_option,
    run_action,
)
from rbxcompose.missions.execution import requests

GROUP = "missions"
IS_COMMON = True
A = TypeVar("A")

ON_SYSTEM = requests.MISSION
FOR_ALL = ("ls", "triggers", "status", "log", "pause", "cancel")
_PERIOD = 0.2  # [s] between two requests to a robot that is followed
_FORMATS = "text", "tree", "mermaid", "dot", "html"


_Row = tuple[str, str, Callable[[argparse.Namespace], int], tuple[Declare, ...]]
"""A subcommand: its name, what it does, its function and its arguments."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    rows = (*_operating(), *_debugging(), *_watching(), *_of_files())
    add_actions(parser, (Subcommand(name, words, do, own, words) for name, words, do, own in rows), metavar="ACTION")


_NAMED: tuple[Declare, ...] = (
    argument("name", nargs="?", default="", metavar="MISSION", help="which one"),
    add_asking_options,
)
_SETS = argument("--set", action="append", default=[], dest="sets", metavar="K=V", help="give it an input")


def _operating() -> tuple[_Row, ...]:
    """Return the subcommands that start, hold and end missions."""
    started = (
        argument("name", nargs=None, default="", metavar="MISSION", help="which one"),
        add_asking_options,
        _SETS,
        argument("--from", dest="start", default="", metavar="STATE", help="start in this state: 'outer.inner'"),
    )
    resumed = (
        *_NAMED,
        argument("--from-snapshot", action="store_true", help="go on where it was before a crash or a loss of power"),
    )
    return (
        ("ls", "list the robot's missions with their states", _list, (add_asking_options,)),
        ("triggers", "list what starts missions by itself, with the next times", _triggers, (add_asking_options,)),
        ("run", "start a mission beside those that run", _run, started),
        ("cancel", "end a mission for good", _to(requests.CancelMission, "name"), _NAMED),
        ("pause", "hold a mission; its timers stand still", _to(requests.PauseMission, "name"), _NAMED),
        ("resume", "resume a mission where it was held", _resume, resumed),
        ("forget", "drop a run that a crash cut short, seen in 'ls'", _to(requests.ForgetMission, "name"), _NAMED),
    )


def _debugging() -> tuple[_Row, ...]:
    """Return the subcommands that stop a mission at a place, and intervene."""
    where = "FILE:LINE, the name of a node, a state, STATE->STATE, or the node's number"
    which = argument("--mission", dest="name", default="", metavar="MISSION", help="which one, if that is not clear")
    broken = (
        argument("where", nargs="?", default="", metavar="WHERE", help=where),
        which,
        argument("--clear", action="store_true", help="clear it; without WHERE, clear all"),
        add_asking_options,
    )
    forced = (
        argument("where", metavar="WHERE", help=where),
        argument("outcome", metavar="OUTCOME", help="success, failure, or an outcome of its own"),
        which,
        add_asking_options,
    )
    force = _to(requests.ForceNode, "where", "outcome", "name")
    changed = (argument("sets", nargs="+", metavar="NAME=VALUE", help="what to set"), which, add_asking_options)
    jumped = (argument("state", metavar="STATE", help="the state to enter"), which, add_asking_options)
    return (
        ("step", "go on to the next leaf or transition", _to(requests.StepMission, "name"), _NAMED),
        ("break", "stop at a node or a transition; without one, list the breakpoints", _break, broken),
        ("force", "let a node that runs end with an outcome", force, forced),
        ("set", "set data of a mission that runs", _set, changed),
        ("jump", "bring a machine that runs into another state", _to(requests.JumpMission, "state", "name"), jumped),
    )


def _watching() -> tuple[_Row, ...]:
    """Return the subcommands that show where missions are, and where they were."""
    logged = (
        *_NAMED,
        argument("-f", "--follow", action="store_true", help="follow new records, until interrupted"),
        argument("--all", action="store_true", help="also its inputs, so that it can be run again"),
    )
    return (
        ("status", "show where a mission is, with its data", _status, _NAMED),
        ("watch", "show a mission live", _watch, _NAMED),
        ("log", "print what missions did, as JSON, one line each", _log, logged),
    )


def _of_files() -> tuple[_Row, ...]:
    """Return the subcommands that need no robot that runs."""
    the_mission = argument("name", metavar="MISSION", help="which one")
    robot = argument("path", nargs="?", metavar="ROBOT", help="the robot's file; without it, the running robot")
    json_ = argument("--json", action="store_true", help="answer in JSON")
    again = (argument("log", metavar="FILE", help="the output of 'mission log --all'"), robot)
    drawn = (
        the_mission,
        robot,
        argument("--format", choices=_FORMATS, default="text", help="output format"),
        out_option("write it to this file"),
    )
    tried = (the_mission, robot, add_unsaved_option, json_)
    explored = (
        the_mission,
        robot,
        _SETS,
        argument("--states", type=int, default=2000, metavar="N", help="most states to look at"),
        argument("--depth", type=int, default=30, metavar="N", help="most events on a path"),
        json_,
    )
    files = "rbxcompose.tools.mission_files"
    replayed = "run missions again from their log, and report the first difference"
    story = "run a mission on the simulated robot in virtual time, and show its story"
    return (
        ("replay", replayed, deferred(files, "replay_log"), again),
        ("show", "say or draw a mission; a running one with the states of its nodes", deferred(files, "show"), drawn),
        ("skills", "list the skills that missions may use on a robot", deferred(files, "skills"), (robot, json_)),
        ("try", story, deferred(files, "try_"), tried),
        ("explore", "look for dead ends by trying everything that may happen", deferred(files, "explore"), explored),
    )


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    return run_action(arguments)


def ask(robot: str | None, query: Query[A]) -> A:
    """Return the answer of a robot's executive to a request."""
    return answer_of(find_robot(robot), query)


def _to(command: Callable[..., Command], *given: str) -> Callable[[argparse.Namespace], int]:
    """Return what sends a command with these of the arguments."""
    return lambda arguments: pass_on(arguments, command(*(getattr(arguments, name) for name in given)))


def _settings(arguments: argparse.Namespace) -> Mapping[str, str]:
    name = find_robot(arguments.robot).path.name
    try:
        return requests.settings(arguments.sets)
    except Refused as refusal:
        raise NotDoneError(REFUSED.at(None, f"'{name}' refuses: {refusal}")) from refusal


def _run(arguments: argparse.Namespace) -> int:
    return pass_on(arguments, requests.RunMission(arguments.name, _settings(arguments), arguments.start))


def _resume(arguments: argparse.Namespace) -> int:
    do = requests.RestoreMission if arguments.from_snapshot else requests.ResumeMission
    return pass_on(arguments, do(arguments.name))


def _break(arguments: argparse.Namespace) -> int:
    where, name = arguments.where, arguments.name
    if arguments.clear:
        return pass_on(arguments, requests.ClearBreakpoints(where, name))
    if where:
        return pass_on(arguments, requests.SetBreakpoint(where, name))
    found = [one for one in ask(arguments.robot, requests.ListBreakpoints()) if name in ("", one.mission)]
    if arguments.json:
        emit(json.dumps(to_data(found)))
    else:
        rows = [(one.mission, one.where, one.place, one.text) for one in found]
        emit(table([("mission", "breakpoint", "place", "what"), *rows]) if rows else "no breakpoints")
    return 0


def _set(arguments: argparse.Namespace) -> int:
    return pass_on(arguments, requests.SetMissionData(_settings(arguments), arguments.name))


def _list(arguments: argparse.Namespace) -> int:
    missions = ask(arguments.robot, requests.ListMissions())
    emit(json.dumps(to_data(missions)) if arguments.json else _table(missions))
    for left in () if arguments.json else ask(arguments.robot, requests.ListSnapshots()):
        if not left.waits:
            emit(_unended(left))
    return 0


def _unended(left: requests.ListedSnapshot) -> str:
    again = "" if left.changed else f"'mission resume {left.mission} --from-snapshot' goes on with it, "
    when = f"{local_time(left.at):%Y-%m-%d %H:%M}"
    return f"a run of {left.mission} did not end ({when}): {again}'mission forget {left.mission}' drops it"


def _table(missions: Sequence[requests.ListedMission]) -> str:
    names = max((len(mission.name) for mission in missions), default=0)
    shown = [f"{mission.state} at {mission.at}" if mission.at else mission.state for mission in missions]
    states = max(map(len, shown), default=0)
    lines = [
        f"{mission.name:<{names}}  {state:<{states}}  {mission.about}".rstrip()
        for mission, state in zip(missions, shown, strict=True)
    ]
    return "\n".join(lines) or "this robot has no missions"


def _triggers(arguments: argparse.Namespace) -> int:
    found = ask(arguments.robot, requests.ListTriggers())
    if arguments.json:
        emit(json.dumps(to_data(found)))
        return 0
    head = ("trigger", "cause", "mission", "priority", "if one runs", "next", "last start", "what came of it")
    rows = [(*(one.name, one.cause, one.mission, str(one.priority), one.running), *_times_of(one)) for one in found]
    emit(table([head, *rows]) if rows else "this robot has no triggers")
    return 0


def _times_of(one: requests.ListedTrigger) -> tuple[str, str, str]:
    due = f"off: {one.off}" if one.off else "waits for its turn" if one.waits else one.next or "-"
    return due, one.last or "-", one.came or "-"


def _chosen(arguments: argparse.Namespace) -> str:
    """Return the addressed mission: the named one, else the only one that runs, or ran last."""
    if arguments.name:
        return str(arguments.name)
    from rbxcompose.missions.program.outcomes import IDLE, NAMES
    from rbxcompose.missions.view.replica import ACTIVE

    known = [one for one in ask(arguments.robot, requests.ListMissions()) if one.state != NAMES[IDLE]]
    active = [item for item in known if item.state in ACTIVE] or known
    if len(active) != 1:
        names = ", ".join(item.name for item in active)
        words = f"which mission: {names}?" if active else "no mission is running"
        raise NotDoneError(WHICH.at(None, words, help="'rbxcompose mission ls' lists them"))
    return active[0].name


def _status(arguments: argparse.Namespace) -> int:
    name = _chosen(arguments)
    seen = ask(arguments.robot, requests.LookAtMission(name))
    if arguments.json:
        emit(json.dumps(seen))
        return 0
    from rbxcompose.missions.view.picture import picture_from_data
    from rbxcompose.tools.mission_view import lines_of

    picture = picture_from_data(ask(arguments.robot, requests.ShowPicture(name)))
    emit("\n".join(lines_of(picture, seen, 120)))
    return 0


def _watch(arguments: argparse.Namespace) -> int:
    from rbxcompose.tools.mission_view import follow, watch

    name = _chosen(arguments)
    do = follow if arguments.json else watch
    return do(find_robot(arguments.robot), name, _PERIOD)


def _log(arguments: argparse.Namespace) -> int:
    from rbxcompose.missions.engine.logbook import INPUTS

    number = 0
    try:
        while True:
            news = ask(arguments.robot, requests.ReadLog(number))
            number = news.next
            for record in news.records:
                is_wanted = not arguments.name or record["mission"] == arguments.name
                if is_wanted and (arguments.all or record["event"] not in INPUTS):
                    emit(json.dumps(record))
            if not arguments.follow:
                return 0
            time.sleep(_PERIOD)
    except KeyboardInterrupt:
        return 0
