"""The other hosts of a robot: what they have told, and which of them are silent. Pure: time is an argument.

A host judges the others by what their supervisors say through the routers, several times a second. What it does with it
is the same as for processes of its own: components that are out of reach are lost, those that have failed block others.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.compiler.plan.model import Instance, OtherHost, Share
from rbxcompose.runtime.channel import HostReport, Lost, RobotEnd, SharedStop
from rbxcompose.runtime.folder import ClockOffset
from rbxcompose.runtime.supervision.members import BLOCKED, DONE, ConductorEffects

SILENT = 2.0  # [s] without a report after which the components of a host count as lost; links lose more than processes


@dataclass
class _Known:
    """What is known of a host that has reported."""

    report: HostReport
    last_report: float  # [s]
    is_lost: bool = False


class OtherHosts:
    """Judges the other hosts; without a share there are none."""

    def __init__(self, share: Share | None, effects: ConductorEffects, send: Callable[[Lost], None]) -> None:
        """Take `send`, which tells all own processes."""
        self._share, self._effects, self._send = share, effects, send
        self._own = HostReport(share.host, share.version, effects.run_id) if share else None
        self._others = {other.name: other for other in share.others} if share else {}
        self._known: dict[str, _Known] = {}
        self._wrong_clocks: set[str] = set()  # hosts whose clocks are too far from ours
        self._reported_waiting = ""

    def adopt(self, share: Share | None) -> None:
        """Take what a new plan knows of the other hosts."""
        if share is not None and self._own is not None:
            self._share, self._own = share, replace(self._own, version=share.version)
            self._others = {other.name: other for other in share.others}
            self._known = {name: known for name, known in self._known.items() if name in self._others}

    def report(
        self, states: Mapping[str, tuple[str, int]], stop: SharedStop, end: RobotEnd | None, *, is_going_down: bool
    ) -> None:
        """Tell the other hosts how this one is."""
        if self._own is not None:
            told = {name: state for name, (state, _) in states.items()}
            now = replace(self._own, states=told, stop=stop, end=end, is_going_down=is_going_down)
            self._effects.to_hosts(now)

    def receive(self, report: HostReport, now: float) -> RobotEnd | None:
        """Take a report; return the end of the robot if it tells one."""
        host = self._others.get(report.host)
        if host is None:
            return None
        known = self._known.get(report.host)
        is_new = known is None or known.report.run != report.run
        if is_new and report.is_going_down:
            return None  # the rest of an earlier run, which this one has nothing to do with
        self._known[report.host] = _Known(report, now, is_lost=report.is_going_down)
        if is_new:
            self._greet(host, report, is_back=known is not None)
        elif known is not None and known.is_lost and not report.is_going_down:
            self._effects.log(Level.WARN, f"host '{host.name}' answers again")
        elif known is not None and not known.is_lost and report.is_going_down and report.end is None:
            self._lose(host, "goes down")
        self._look_at_clock(report)
        return report.end

    @property
    def clocks(self) -> dict[str, ClockOffset]:
        """Return how far the clocks of the hosts that answer are from ours."""
        reports = (known.report for known in self._known.values() if not known.is_lost)
        return {report.host: report.clock for report in reports if report.clock is not None}

    def _look_at_clock(self, report: HostReport) -> None:
        """Log when the clock of a host is found too far from ours, and when it no longer is."""
        if report.clock is None or report.clock.is_too_far is (report.host in self._wrong_clocks):
            return
        self._effects.states_changed()
        told = f"the clock of host '{report.host}' is {report.clock.words}"
        if report.clock.is_too_far:
            self._wrong_clocks.add(report.host)
            self._effects.log(Level.WARN, f"{told}: stamps of both do not fit; let both follow one time server")
        else:
            self._wrong_clocks.remove(report.host)
            self._effects.log(Level.OK, told)

    def _greet(self, host: OtherHost, report: HostReport, *, is_back: bool) -> None:
        tried = ", and what access control denies to it does not arrive" if self._share and self._share.access else ""
        self._effects.log(Level.OK, f"host '{host.name}' {'was started again' if is_back else 'is there'}{tried}")
        if self._own is not None and report.version != self._own.version:
            text = f"host '{host.name}' runs other files of this robot, or another version of rbxcompose"
            self._effects.log(Level.WARN, f"{text}: give all hosts the same and start them again")

    def look(self, now: float, *, is_excused: bool) -> None:
        """Look for hosts that have fallen silent; they are excused if this process did not run itself."""
        for name, known in self._known.items():
            if is_excused:
                known.last_report = now
            elif not known.is_lost and now - known.last_report > SILENT:
                known.is_lost = True
                self._lose(self._others[name], "does not answer")

    def _lose(self, host: OtherHost, how: str) -> None:
        text = f"host '{host.name}' {how}"
        self._effects.log(Level.WARN, text)
        self._send(Lost([instance.name for instance in host.instances], text))

    # Starting together

    def reached(self, instances: Iterable[Instance]) -> Iterator[Instance]:
        """Yield instances until the first one that starts after a component which another host has yet to activate."""
        elsewhere = {one.name for host in self._others.values() if not host.is_optional for one in host.instances}
        for instance in instances:
            if any(name in elsewhere and self._state(name) not in DONE for name in instance.starts_after):
                return
            yield instance

    def is_complete(self) -> bool:
        """Return whether everything is active on all hosts that the robot needs; if not, log once what is awaited."""
        missing = [other for other in self._others.values() if not other.is_optional and not self._is_active(other)]
        waiting = " and ".join(f"host '{other.name}'" for other in missing)
        if waiting and waiting != self._reported_waiting:
            self._effects.log(Level.OK, f"everything is active here; waiting for {waiting}")
        self._reported_waiting = waiting
        return not missing

    def _is_active(self, host: OtherHost) -> bool:
        return all(self._state(instance.name) in DONE for instance in host.instances) and host.name in self._known

    def _state(self, name: str) -> str:
        """Return the state of a component of another host; unconfigured if this is unknown."""
        reports = (known.report for known in self._known.values() if not known.is_lost)
        return next((report.states[name] for report in reports if name in report.states), "unconfigured")

    @property
    def failed(self) -> set[str]:
        """Return the components of other hosts that have failed, or do not start because others have."""
        reports = (known.report.states for known in self._known.values())
        return {name for states in reports for name, state in states.items() if state in ("failed", BLOCKED)}
