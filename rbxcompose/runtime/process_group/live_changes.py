"""Changes of the live settings of the components of one process, in two phases: prepared, then carried out or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

from rbxcompose.config import Config
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.rbxcompose_parameters import NodeChange
from rbxcompose.params import core
from rbxcompose.params.change import WantedChange
from rbxcompose.params.history import MARK, ChangeCause, ParameterHistory
from rbxcompose.params.values import to_message
from rbxcompose.requests import Refused
from rbxcompose.runtime.process_group.hosted import Hosted
from rbxcompose.sdk.registry import component_type

Tell = Callable[[Hosted, Config, ChangeCause], None]  # that a component had another configuration before


@dataclass(slots=True)
class PreparedChange:
    """A change of one component that would be accepted, with what it had before."""

    hosted: Hosted
    old: Config
    new: Config
    cause: ChangeCause

    @property
    def is_ruled(self) -> bool:
        """Return whether rules about the whole robot could notice it: they know a component by its capabilities."""
        if self.new == self.old:
            return False
        capabilities = component_type(self.hosted.instance.type).capabilities
        return capabilities(self.old) != capabilities(self.new)


@dataclass(slots=True)
class LiveChanges:
    """Prepares changes, carries them out and takes them back; nothing is told of a change before its end."""

    hosted: Mapping[str, Hosted]
    failed: Callable[[str, Exception], None]
    tell: Tell
    history: Callable[[str], ParameterHistory]
    _prepared: dict[int, Sequence[PreparedChange]] = field(default_factory=dict)  # by number of the change
    _done: dict[int, list[PreparedChange]] = field(default_factory=dict)

    @property
    def live(self) -> dict[str, Config]:
        """Return the configurations that are not those of the plan, by component."""
        return {name: one.config for name, one in self.hosted.items() if one.config != one.instance.config}

    def is_open(self, name: str) -> bool:
        """Return whether no change of a component is prepared."""
        return all(one.hosted.instance.name != name for each in self._prepared.values() for one in each)

    def prepare(self, number: int, wanted: WantedChange) -> Sequence[PreparedChange]:
        """Return the changes of components if all would be accepted, and keep the components for this change.

        Raises:
            Refused: if one would not be, with the reason.
        """
        found = []
        for name in wanted.parts:
            part = wanted.part(name)
            try:
                found.append(self._part(name, part, ChangeCause(wanted.by, wanted.together, part.undoes)))
            except (core.UnsettableError, Refused) as refusal:
                raise Refused(f"'{name}': {refusal}" if wanted.together else str(refusal)) from refusal
        self._prepared[number] = found
        return found

    def _part(self, name: str, wanted: NodeChange, cause: ChangeCause) -> PreparedChange:
        hosted = self.hosted.get(name)
        if hosted is None or hosted.component is None:
            raise Refused(f"'{name}' is not active")
        self._require_known(hosted, wanted.expected)
        if hosted.is_busy:
            raise Refused(f"'{name}' is busy")
        new = core.changed(hosted.config, wanted.parameters, hosted.instance.bounds)
        return PreparedChange(hosted, hosted.config, new, cause)

    def _require_known(self, hosted: Hosted, expected: Sequence[rcl.Parameter]) -> None:
        now = core.settings(hosted.config)
        for one in expected:
            if (there := now.get(one.name)) is None or to_message(there.value) != one.value:
                history = self.history(hosted.instance.name).changes
                last = next((each for each in reversed(history) if each.name == one.name), None)
                who = f" by {last.by} ({last.component}{MARK}{last.number})" if last else ""
                raise Refused(f"'{one.name}' was changed meanwhile{who}")

    def commit(self, number: int) -> str:
        """Carry out a prepared change; return why a component refuses: then all others have their old values."""
        done = self._done[number] = []
        for one in self._prepared.get(number, ()):
            is_there = one.hosted.component is not None
            if reason := self._follow(one.hosted, one.new) if is_there else "it has failed meanwhile":
                return "; ".join(filter(None, (reason, self.undo(number))))
            done.append(one)
        return ""

    def undo(self, number: int) -> str:
        """Give components their old values back; return why one does not take them."""
        done = self._done.pop(number, [])
        reasons = [self._follow(one.hosted, one.old) for one in reversed(done)]
        return "; ".join(filter(None, reasons))

    def end(self, number: int) -> None:
        """Tell what was carried out, and let go of the components."""
        self._prepared.pop(number, None)
        for one in self._done.pop(number, ()):
            self.tell(one.hosted, one.old, one.cause)

    def _follow(self, hosted: Hosted, config: Config) -> str:
        name = hosted.instance.name
        if hosted.component is None:  # it comes back with this
            hosted.config = config
            return ""
        try:
            hosted.reconfigure(config)
        except Refused as refusal:
            return str(refusal)
        except Exception as error:  # as in a step: the failure of the component alone
            self.failed(name, error)
            return f"'{name}' has failed: {type(error).__name__}: {error}"
        return ""
