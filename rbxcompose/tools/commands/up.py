"""Start a robot, or what a host runs of it: check it, bring all components up, run its mission.

In the foreground it goes down when the mission named by `start:` has ended, or at Ctrl-C; with -d it stays up.
Exit codes: 0 fine, 1 findings, 2 wrong usage, 3 the mission failed, 4 the robot failed, 130 interrupted.
"""

import argparse
from pathlib import Path

from rbxcompose.base.units import TIME, UnitError, to_si
from rbxcompose.commands import targets
from rbxcompose.commands.console import FINDINGS, misused, refuse, write_report
from rbxcompose.commands.formats.json_ import render_json
from rbxcompose.commands.options import add_system_options, is_system, speed_up
from rbxcompose.runtime.folder import RunOptions
from rbxcompose.runtime.recording.topics import UNWRITABLE
from rbxcompose.tools.live_rules import LiveRules
from rbxcompose.tools.robot_changes import LiveReload
from rbxcompose.tools.run_view import machine_findings, real_time_only, run_plan

GROUP = "run"
IS_COMMON = True
STARTS_ROBOTS = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    targets.add_path_argument(parser)
    targets.add_layer_options(parser)
    parser.add_argument(
        "--rate", type=_rate, default=RunOptions(), metavar="20x|max|1x", help="robot time per real time, reproducible"
    )
    parser.add_argument("-d", "--detach", action="store_true", help="return once everything is active; it stays up")
    parser.add_argument(
        "--record", type=Path, metavar="FILE", help="with --rate: record everything that happens, for replay"
    )
    words = "start no mission, as --set start=null does"
    parser.add_argument("--no-mission", action="append_const", dest="sets", const="start=null", help=words)
    parser.add_argument("--watch", action="store_true", help="apply changes to its files as you edit them")
    parser.add_argument("--host", metavar="NAME", help="of a system: run what this host runs")
    add_system_options(parser, has_profile=True)
    parser.add_argument("--robot", metavar="NAME", help="of a system: only this robot")
    parser.add_argument("--for", type=_duration, dest="duration", metavar="30s", help="end after this robot time")


def run(arguments: argparse.Namespace) -> int:
    """Compile the robot, start its supervisor, and report what happens."""
    if arguments.real and arguments.rate.is_stepped:
        return misused("up", "--real keeps its own time, so --rate cannot be given with it")
    if arguments.watch and (arguments.detach or arguments.rate.is_stepped):
        other = "-d" if arguments.detach else "--rate"
        return misused("up", f"--watch is for the foreground in real time, without {other}")
    if arguments.record and not arguments.rate.is_stepped:
        return misused("up", "--record needs --rate; a run in real time is recorded by 'rbxcompose record'")
    path = targets.robot_path(arguments.path, may_run=False)
    if is_system(path):
        from rbxcompose.tools.system_runs import run_share  # only needed for systems

        return run_share(path, arguments, _options(arguments))
    if arguments.host or arguments.robot:
        return misused("up", "--host and --robot are for systems")
    compilation = targets.compiled(path, arguments)
    robot, plan = targets.without_errors(compilation)
    if plan.follows_clock and arguments.rate.is_stepped:
        return misused("up", "the robot follows /clock ('bus.clock'), so --rate cannot be given with it")
    if arguments.rate.is_stepped and (reason := real_time_only(robot)):
        return misused("up", f"{reason}, so --rate cannot be given")
    options = _options(arguments)
    if options.record is not None and (problem := _write_problem(options.record)):
        return refuse(UNWRITABLE.at(None, problem))
    if options.is_stepped and options.rate is None and options.duration is None and plan.start is None:
        return misused("up", "without 'start:' nothing ends a run at --rate max: give --for")
    write_report(found := machine_findings(robot), compilation.sources)
    if found.has_errors:
        return FINDINGS
    reload = None
    if arguments.watch:
        reload = LiveReload(lambda: targets.compiled(path, arguments), compilation, options.layers)
    findings = render_json(compilation.report, compilation.sources)
    return run_plan(plan, options, LiveRules(robot), reload, findings)


def _options(arguments: argparse.Namespace) -> RunOptions:
    return RunOptions(
        is_stepped=arguments.rate.is_stepped,
        rate=arguments.rate.rate,
        duration=arguments.duration,
        is_detached=arguments.detach,
        record=arguments.record.absolute() if arguments.record else None,
        layers=targets.chosen_layers(arguments),
    )


def _write_problem(path: Path) -> str:
    from rbxcompose.runtime.recording.files import write_problem  # imports MCAP, which only a recorded run needs

    return write_problem(path)


def _rate(text: str) -> RunOptions:
    """Read `20x`, `max` or `1x`."""
    if text == "max":
        return RunOptions(is_stepped=True)
    rate = speed_up(text, "'20x', '1x' or 'max'")
    return RunOptions() if rate == 1 else RunOptions(is_stepped=True, rate=rate)


def _duration(text: str) -> float:
    """Read `30s` or `2 min` [s]."""
    try:
        seconds = to_si(text, TIME)
    except UnitError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    if seconds <= 0:
        raise argparse.ArgumentTypeError("must be above zero")
    return seconds
