"""The rules again while settings of a compiled robot change: only those that have read what is different now.

What a rule reads of components is recorded while it runs. A rule that has read nothing of a component would read the
same again whatever that is like, so its findings stay. Rules of other packages may look anywhere, and always run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, replace
from typing import Any, TypeVar

from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Rule
from rbxcompose.compiler.check_runner import findings_of, is_foreign, run_checks
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.sdk.capabilities import Capability

K = TypeVar("K", bound=Capability)
Reads = set[tuple[str, type]]
"""Components with the kinds of capabilities that were read of them; `Config` stands for the whole configuration."""


class SettingChecks:
    """The findings about a robot, whose components may have other configurations than those that are written."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._components, self._recorder = robot, dict(robot.components), _Recorder()
        self._watched = {name: _Watched.of(component, self._recorder) for name, component in robot.components.items()}
        self._of_missions: Reads = set()
        self._all: Reads = set()
        self._results: dict[tuple[str, int], _Result] = {}
        self._report: Report | None = None

    def report(self, configs: Mapping[str, Config]) -> Report:
        """Return what the rules find with these configurations; components that are not named keep what they had."""
        before = dict[str, RobotComponent]()
        for name, config in configs.items():
            old = self._components[name]
            if config is not old.config and (new := old.configured(config)) is not old:
                before[name], self._components[name] = old, new
                self._watched[name] = _Watched.of(new, self._recorder)
        is_known, other = self._report is not None, self._other(before)
        if not other.isdisjoint(self._of_missions):
            is_known = False
            self._results = {key: result for key, result in self._results.items() if result.is_of_robot}
        for key, known in list(self._results.items()) if before else ():
            if known.is_foreign or not other.isdisjoint(known.reads):
                self._results[key] = found = self._run(known.rule, self._robot)
                is_known &= found.findings == known.findings
        if self._report is None or not is_known:
            self._report = Report()
            self._of_missions = self._recorder.reads = set()
            run_checks(replace(self._robot, components=self._watched), self._report, self._found)
            self._all |= self._of_missions
        return self._report

    def _found(self, rule: Rule[Any], subject: Robot | Examined) -> list[Finding]:
        key = rule.code, 0 if isinstance(subject, Robot) else id(subject.program)
        if key not in self._results:
            self._results[key] = self._run(rule, subject)
        return self._results[key].findings

    def _run(self, rule: Rule[Any], subject: Robot | Examined) -> _Result:
        """Run a rule: about the robot, on a robot of its own, so that it reads what others have found out before."""
        if not isinstance(subject, Robot):
            return _Result(rule, findings_of(rule, subject), set(), is_of_robot=False)
        outer, self._recorder.reads = self._recorder.reads, set()
        try:
            found = findings_of(rule, replace(self._robot, components=dict(self._watched)))
            self._all |= self._recorder.reads
            return _Result(rule, found, self._recorder.reads, is_foreign(rule.find))
        finally:
            self._recorder.reads = outer

    def _other(self, before: Mapping[str, RobotComponent]) -> Reads:
        """Return what is other now of all that was ever read of the components that were like this before."""
        return {
            (name, kind)
            for name, kind in (self._all if before else ())
            if (old := before.get(name)) is not None
            and (kind is Config or old.declared(kind) != self._components[name].declared(kind))
        }


@dataclass(frozen=True, slots=True)
class _Result:
    """What a rule has found, and what it has read for that; all rules about missions have read the same."""

    rule: Rule[Any]
    findings: list[Finding]
    reads: Reads
    is_foreign: bool = False
    is_of_robot: bool = True


@dataclass(slots=True)
class _Recorder:
    reads: Reads = field(default_factory=set)


def _slot(name: str) -> Any:
    return RobotComponent.__dict__[name]


_CONFIG, _CAPABILITIES = _slot("config"), _slot("capabilities")


class _Watched(RobotComponent):
    """A component that notes what is read of it; a changed copy, which a rule makes of it, is an ordinary one."""

    __slots__ = ("_recorder",)
    _recorder: _Recorder

    def __new__(cls, /, **given: Any) -> RobotComponent:  # type: ignore[misc]
        """Return what `replace` asks for."""
        return RobotComponent(**given)

    @classmethod
    def of(cls, component: RobotComponent, recorder: _Recorder) -> _Watched:
        """Return a component like this one."""
        made = object.__new__(cls)
        object.__setattr__(made, "_recorder", recorder)
        for each in fields(RobotComponent):
            _slot(each.name).__set__(made, getattr(component, each.name))
        return made

    @property
    def config(self) -> Any:
        """Return its configuration."""
        self._recorder.reads.add((self.name, Config))
        return _CONFIG.__get__(self)

    @property
    def capabilities(self) -> Any:
        """Return all that it can do, which may be anything of its configuration."""
        self._recorder.reads.add((self.name, Config))
        return _CAPABILITIES.__get__(self)

    def declared(self, kind: type[K]) -> list[K]:
        """Return the capabilities of a kind."""
        self._recorder.reads.add((self.name, kind))
        return [capability for capability in _CAPABILITIES.__get__(self) if isinstance(capability, kind)]
