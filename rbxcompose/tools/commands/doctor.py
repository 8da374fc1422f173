"""Examine this machine and the robots that run on it: what is wrong, and what to do about it.

With a robot, by file or name, it examines only that robot, including its devices and secrets; if none of this name is
up, that is an error, and the machine is examined all the same. Exit codes: 0 no error, 1 errors found, 2 wrong usage.
"""

import argparse
import os
import platform
import sys
import time

from rbxcompose.base.findings import Finding, Report
from rbxcompose.commands.console import FINDINGS, NotDoneError, emit, has_colour, write_report
from rbxcompose.commands.formats.text import render_text
from rbxcompose.commands.guest import Guest, ReceivedMessage
from rbxcompose.commands.lookup import NOT_UP, add_addressed_robot, find_robot, place_of, robots_up
from rbxcompose.commands.messages import to_json
from rbxcompose.commands.options import EACH, add_json_option
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.devices.serial_ports import latency_timers, serial_ports
from rbxcompose.manifest.files import PREFIX
from rbxcompose.runtime.folder import BrokenStateError, RobotFolder, base_folder
from rbxcompose.tools import doctor as machine
from rbxcompose.tools.doctor import BusFacts, ExaminationResult, HostFacts, RunningRobot, examine_all, has_errors

GROUP = "system"
ON_SYSTEM = EACH
_LISTENING = 1.0  # [s] of listening to messages, for their stamps
_NANOSECONDS = 1e9


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_addressed_robot(parser, "only this robot, by name or file; or a system")
    add_json_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Collect the facts, examine them, and report the results."""
    watch = machine.ClockWatch()
    folders, path, lacking = _addressed(arguments.robot or arguments.path)
    file = None if path is None else _described(path)
    if path is not None and file is None:
        return FINDINGS
    running = [_running(folder) for folder in folders]
    facts = HostFacts(
        running=running,
        file=file,
        python=platform.python_version(),
        versions=machine.versions(),
        clocks=watch.clocks(),
        limits=machine.limits(),
        listeners=machine.listeners(),
        processes=machine.processes(),
        base=base_folder(),
        latencies=latency_timers(),
        ports=serial_ports(),
        disks=machine.disks(),
    )
    answers = [*lacking, *examine_all(facts)]
    emit(to_json([result.to_data() for result in answers]) if arguments.json else _text(answers))
    return FINDINGS if has_errors(answers) else 0


def _addressed(wanted: str | None) -> tuple[list[RobotFolder], str | None, list[ExaminationResult]]:
    """Return the running robots, or the given file, whose robot need not run; else what is lacking.

    Raises:
        NotDoneError: if it is not clear which robot is `wanted`.
    """
    if wanted is None:
        return robots_up(), None, []
    try:
        return [find_robot(wanted)], None, []
    except NotDoneError as error:
        if os.path.exists(wanted) or wanted.startswith(PREFIX):
            return [], wanted, []
        if error.finding.code != NOT_UP.code:
            raise
        return [], None, [ExaminationResult("robots", error.finding)]  # the machine may be why it is not up


def _described(path: str) -> Robot | None:
    """Return the robot that a file describes; if it cannot be read as one, report the findings."""
    compilation = compile_robot(path, environment=os.environ)
    if compilation.robot is None:
        write_report(compilation.report, compilation.sources)
    return compilation.robot


def _running(folder: RobotFolder) -> RunningRobot:
    try:
        state = folder.read_state()
    except BrokenStateError as error:
        return RunningRobot(folder, None, str(error))
    if state is None:
        return RunningRobot(folder, None, "it is gone")
    robot = compile_robot(state.file, environment=os.environ).robot if os.path.exists(state.file) else None
    return RunningRobot(folder, state, "", robot, _bus(folder))


def _bus(folder: RobotFolder) -> BusFacts | None:
    """Listen for a moment; return None if the bus cannot be reached, which other examinations report."""
    try:
        with Guest(place_of(folder)) as guest:
            graph = guest.graph()
            nodes = {end.gid: end.node for topic in graph.topics for end in topic.givers}
            ages: dict[str, float] = {}

            def receive(message: ReceivedMessage) -> None:
                age = time.time() - (guest.clock.now() - message.time) - message.stamp / _NANOSECONDS
                node = nodes.get(message.sender)
                if node is not None and message.stamp:
                    ages[node] = min(age, ages.get(node, age))

            for topic in graph.topics:
                if all(end.qos is not None and not end.qos.is_transient_local for end in topic.givers):
                    guest.listen(topic, receive)
            guest.run(lambda: False, _LISTENING)
            return BusFacts(graph, ages)
    except NotDoneError:
        return None


def _text(answers: list[ExaminationResult]) -> str:
    """Return the examinations that passed, then the findings."""
    width = max(len(result.examination) for result in answers)
    lines = [
        f"ok  {result.examination:<{width}}  {result.answer}" for result in answers if isinstance(result.answer, str)
    ]
    report = Report([result.answer for result in answers if isinstance(result.answer, Finding)])
    return "\n".join([*lines, render_text(report, {}, has_colour(sys.stdout))]).rstrip("\n")
