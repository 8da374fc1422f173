"""Run a plan and show the run: follow the log as `logs -f` does; the supervisor reports the rest."""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress

from rbxcompose.base.findings import Report
from rbxcompose.base.levels import Level
from rbxcompose.commands.console import emit, good, has_colour, refuse
from rbxcompose.commands.lookup import ALREADY_UP, UNSAFE, warn_of_lost_log
from rbxcompose.commands.targets import missing_extras
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.plan.model import Plan, extent
from rbxcompose.domains.console.commands.console import show_link, why_no_page
from rbxcompose.domains.devices.serial_ports import serial_ports
from rbxcompose.domains.devices.udev import look_at, port_findings
from rbxcompose.domains.programs.runnable import ask_for_real, program_findings
from rbxcompose.runtime.folder import RobotFolder, RunOptions, mark_start
from rbxcompose.runtime.log import NAME, Follower, Record, StoryWriter, summary
from rbxcompose.runtime.supervision import launch
from rbxcompose.runtime.supervision.conductor import INTERRUPTED, ROBOT_FAILED
from rbxcompose.sdk.capabilities import OpensPort, RunsContainer, RunsProgram, RunsRosNode, ServesPage
from rbxcompose.sdk.registry import declared
from rbxcompose.tools.live_rules import LiveRules
from rbxcompose.tools.robot_changes import LiveReload

_LOOK = 0.05  # [s] between checks of the log


def run_plan(
    plan: Plan,
    options: RunOptions,
    rules: LiveRules | None = None,
    reload: LiveReload | None = None,
    findings: str = "[]",
    *,
    others_follow: bool = False,
) -> int:
    """Run a robot to its end, or if detached until it is up, and return the exit code.

    Its live settings keep `rules`. Meanwhile, `reload` follows its files. `findings` of `check` [JSON] are kept for its
    page. If `others_follow`, this process is about to start other robots after it.
    """
    if not options.layers.real and (devices := ", ".join(_devices(plan))):
        sys.stderr.write(f"note: without --real, too, these use real devices: {devices}\n")
    plan = plan.in_one_process() if options.is_stepped else plan
    started = launch.start_supervisor(plan, options, rules)
    return _Watch(plan, options, started, reload, findings, others_follow=others_follow).run()


class _Watch:
    """Watches one run from its first report to its last."""

    def __init__(
        self,
        plan: Plan,
        options: RunOptions,
        started: launch.Started,
        reload: LiveReload | None,
        findings: str,
        *,
        others_follow: bool,
    ) -> None:
        self._plan, self._options, self._started, self._reload = plan, options, started, reload
        self._findings, self._others_follow = findings, others_follow
        self._is_up = False
        self._story = StoryWriter([instance.name for instance in plan.instances], colour=has_colour(sys.stdout))
        self._log: Follower | None = None  # None until the log of this run has begun

    def run(self) -> int:
        """Watch until the robot is down, or up if detached, and return the exit code."""
        try:
            while True:
                records = self._records()
                report = self._started.wait_for_report(0.0 if records else _LOOK)
                # Before the records that follow.
                exit_code = self._tell(report) if isinstance(report, launch.Up) else None
                self._tell_story([*records, *self._records()])
                if self._reload is not None and self._is_up and exit_code is None:
                    self._reload.look()
                if report is not None and not isinstance(report, launch.Up):
                    exit_code = self._tell(report)
                if exit_code is not None:
                    return exit_code
        except EOFError:
            self._tell_story(self._records())
            sys.stderr.write("rbxcompose up: the supervisor was killed; its processes stop by themselves\n")
            self._started.wait()
            return ROBOT_FAILED
        finally:
            if self._log is not None:
                self._log.close()

    def _records(self) -> list[Record]:
        """Return the records since the last call."""
        return self._log.read() if self._log is not None else []

    def _tell_story(self, records: Iterable[Record]) -> None:
        for record in records:
            if record.level is not Level.OK or not self._options.is_detached:
                emit(self._story.line(record))

    def _tell(self, report: launch.LaunchReport) -> int | None:
        """Print a report and return the exit code if it is the last."""
        name = self._plan.robot
        match report:
            case launch.Begun():
                if not self._others_follow:
                    mark_start(is_over=True)
                folder = RobotFolder.of(name)
                with suppress(OSError):  # the disk is full, which is reported once the robot is up
                    folder.write_findings(self._findings)
                self._log = Follower(folder.path / NAME)
                return None
            case launch.Up(components, processes, seconds, blocked):
                self._is_up = True
                took = "" if self._options.is_stepped else f", {seconds:.2f} s"  # all stepped runs write the same
                lacks = f" without {', '.join(blocked)}" if blocked else ""
                emit(f"{name} is up{lacks}: {extent(components, processes)}{took}")
                warn_of_lost_log(RobotFolder.of(name))
                if not self._options.is_stepped:
                    for instance in self._plan.instances:
                        for page in declared(instance.type, instance.config, ServesPage):
                            if why := why_no_page(RobotFolder.of(name), instance.name):
                                emit(f"{name} {why}")
                            else:
                                show_link(name, page.port.value, is_lan=page.listen.value == "lan")
                if self._options.is_detached:
                    self._started.let_go()
                    return ROBOT_FAILED if blocked else 0
                return None
            case launch.AlreadyUp(pid):
                self._started.wait()
                shown = f" (pid {pid})" if pid else ""
                return refuse(ALREADY_UP.at(None, f"'{name}' is already up{shown}", help=f"rbxcompose down {name}"))
            case launch.Unsafe(reason):
                self._started.wait()
                return refuse(UNSAFE.at(None, reason))
            case launch.RunEnded(exit_code, reason, time, facts):
                first, *rest = summary(name, reason, time, facts).split("\n")
                emit("\n".join([good(first) if exit_code == 0 else first, *rest]))
                self._started.wait()
                return exit_code or (INTERRUPTED if self._options.is_detached and not self._is_up else 0)


def machine_findings(robot: Robot) -> Report:
    """Return what is wrong with this machine for a robot."""
    report = Report([*missing_extras(robot), *port_findings(robot, serial_ports(), look_at)])
    report.extend(program_findings(robot, os.environ, ask_for_real))
    return report


def _devices(plan: Plan) -> Iterator[str]:
    """Yield the components that open serial ports, each with its port."""
    for instance in plan.instances:
        for opens in declared(instance.type, instance.config, OpensPort):
            yield f"'{instance.name}' ({opens.name})"


def real_time_only(robot: Robot) -> str:
    """Return which components keep real time and why, so that robot time cannot be stepped; empty if none does."""
    for kinds, does, do in (
        ((RunsProgram, RunsContainer, RunsRosNode), "runs a program, which keeps", "run programs, which keep"),
        ((OpensPort,), "uses a real device, which keeps", "use real devices, which keep"),
    ):
        if names := [f"'{component.name}'" for what in kinds for component, _ in robot.declared(what)]:
            return f"{', '.join(names)} {does if len(names) == 1 else do} real time"
    return ""
