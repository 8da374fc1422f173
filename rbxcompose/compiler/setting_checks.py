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
from rbxcompose.base.findings import Finding, Report
from rbxcompose.base.rules import Rule
from rbxcompose.compiler.check_runner import findings_of, is_foreign, run_checks
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.sdk.capabilities import Capability

K = TypeVar("K", bound=Capability)
Reads = dict[str, set[type]]
"""The kinds of capabilities that were read of each component; `Config` stands for its configuration."""


class SettingChecks:
    """The findings about a robot, whose components may have other configurations than those that are written."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._components, self._recorder = robot, dict(robot.components), _Recorder()
        self._watched = {name: _Watched.of(component, self._recorder) for name, component in robot.components.items()}
        self._of_missions: Reads = {}
        self._results: dict[tuple[str, int], _Result] = {}
        self._report: Report | None = None

    def report(self, configs: Mapping[str, Config]) -> Report:
        """Return what the rules find with these configurations; components that are not named keep what they had."""
        before = dict[str, RobotComponent]()
        for name, config in configs.items():
            old = self._components[name]
            if config is not old.config and config != old.config:
                new = replace(old, config=config, capabilities=old.cls.capabilities(config))
                before[name], self._components[name] = old, new
                self._watched[name] = _Watched.of(new, self._recorder)
        is_known = self._report is not None
        if before and self._differ(self._of_missions, before):
            is_known = False
            self._results = {key: result for key, result in self._results.items() if result.is_of_robot}
        for key, known in list(self._results.items()) if before else ():
            if known.is_foreign or self._differ(known.reads, before):
                self._results[key] = found = self._run(known.rule, self._robot)
                is_known &= found.findings == known.findings
        if self._report is None or not is_known:
            self._report = Report()
            self._of_missions = self._recorder.reads = {}
            run_checks(replace(self._robot, components=self._watched), self._report, self._found)
        return self._report

    def _found(self, rule: Rule[Any], subject: Robot | Examined) -> list[Finding]:
        key = rule.code, 0 if isinstance(subject, Robot) else id(subject.program)
        if key not in self._results:
            self._results[key] = self._run(rule, subject)
        return self._results[key].findings

    def _run(self, rule: Rule[Any], subject: Robot | Examined) -> _Result:
        """Run a rule: about the robot, on a robot of its own, so that it reads what others have found out before."""
        if not isinstance(subject, Robot):
            return _Result(rule, findings_of(rule, subject), {}, is_of_robot=False)
        outer, self._recorder.reads = self._recorder.reads, {}
        try:
            found = findings_of(rule, replace(self._robot, components=dict(self._watched)))
            return _Result(rule, found, self._recorder.reads, is_foreign(rule.find))
        finally:
            self._recorder.reads = outer

    def _differ(self, reads: Reads, before: Mapping[str, RobotComponent]) -> bool:
        """Return whether anything is other now that was read of the components that were like this before."""
        return any(
            kind is Config or old.declared(kind) != self._components[name].declared(kind)
            for name, old in before.items()
            for kind in reads.get(name, ())
        )


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
    reads: Reads = field(default_factory=dict)


class _Watched(RobotComponent):
    """A component that notes what is read of it."""

    __slots__ = ("_recorder",)
    _recorder: _Recorder

    @classmethod
    def of(cls, component: RobotComponent, recorder: _Recorder) -> _Watched:
        """Return a component like this one."""
        made = cls.__new__(cls)
        object.__setattr__(made, "_recorder", recorder)
        for each in fields(RobotComponent):
            slot: Any = RobotComponent.__dict__[each.name]
            slot.__set__(made, getattr(component, each.name))
        return made

    def __getattribute__(self, name: str) -> Any:
        if name in ("config", "capabilities"):
            self._note(Config)
        return super().__getattribute__(name)

    def declared(self, kind: type[K]) -> list[K]:
        """Return the capabilities of a kind."""
        self._note(kind)
        capabilities = RobotComponent.__dict__["capabilities"].__get__(self)
        return [capability for capability in capabilities if isinstance(capability, kind)]

    def _note(self, kind: type) -> None:
        self._recorder.reads.setdefault(self.name, set()).add(kind)
