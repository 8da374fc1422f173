"""Parameters on the bus, and changes of live settings in two phases."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import partial
from itertools import count
from typing import Any, Protocol

from rbxcompose.base.clock import Clock
from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused
from rbxcompose.base.units import format_quantity
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import resolve
from rbxcompose.bus.services import ServedRequest
from rbxcompose.compiler.plan.dump import dump_configs, load_configs
from rbxcompose.compiler.plan.model import Instance
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, NodeChange
from rbxcompose.msgs.stamps import to_time
from rbxcompose.runtime.channel import AskForChange, SettingsKept
from rbxcompose.runtime.settings_history import BY_A_TOOL, MARK, ChangeCause, ParameterHistory
from rbxcompose.sdk import parameters as core
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.parameters import ChangeRefusal, Configs, RobotRules, WantedChange, from_message, to_message
from rbxcompose.sdk.ports import Qos
from rbxcompose.sdk.registry import component_type

INTERFACES = (
    rcl.ListParameters,
    rcl.GetParameters,
    rcl.GetParameterTypes,
    rcl.DescribeParameters,
    rcl.SetParameters,
    rcl.SetParametersAtomically,
    ChangeParameters,
    rcl.ParameterEvent,
)
"""What each component serves and publishes."""


class Settable(Protocol):
    """An instance in its host, as far as its settings are concerned."""

    instance: Instance
    config: Config
    component: Component[Any] | None

    @property
    def is_busy(self) -> bool:
        """Return whether the component is in a call in its own thread."""
        ...

    def reconfigure(self, config: Config) -> None:
        """Apply another configuration to the component; if it raises, the old one stays."""
        ...


OnChange = Callable[[Settable, Config, ChangeCause], None]  # that a component had another configuration before


@dataclass(slots=True)
class PreparedChange:
    """A change of one component that would be accepted, with what it had before."""

    hosted: Settable
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

    hosted: Mapping[str, Settable]
    failed: Callable[[str, BaseException], None]
    on_change: OnChange
    history: Callable[[str], ParameterHistory]
    _prepared: dict[int, Sequence[PreparedChange]] = field(default_factory=dict)  # by number of the change
    _done: dict[int, list[PreparedChange]] = field(default_factory=dict)

    @property
    def live(self) -> dict[str, Config]:
        """Return the configurations that are not those of the plan, by component."""
        return {name: entry.config for name, entry in self.hosted.items() if entry.config != entry.instance.config}

    def text(self, configs: Mapping[str, Config]) -> str:
        """Return configurations of components as text; empty if there are none."""
        types = {name: (self.hosted[name].instance.type, config) for name, config in configs.items()}
        return dump_configs(types) if types else ""

    def claim(self, number: int, asked: int) -> None:
        """Let what was prepared when it was asked for be that of a change, unless that was prepared itself."""
        self._prepared.setdefault(number, self._prepared.pop(-asked, ()))

    def is_open(self, name: str) -> bool:
        """Return whether no change of a component is prepared."""
        return all(change.hosted.instance.name != name for each in self._prepared.values() for change in each)

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

    def _require_known(self, hosted: Settable, expected: Sequence[rcl.Parameter]) -> None:
        now = core.settings(hosted.config)
        for parameter in expected:
            if (there := now.get(parameter.name)) is None or to_message(there.value) != parameter.value:
                history = self.history(hosted.instance.name).changes
                last = next((each for each in reversed(history) if each.name == parameter.name), None)
                who = f" by {last.by} ({last.component}{MARK}{last.number})" if last else ""
                raise Refused(f"'{parameter.name}' was changed meanwhile{who}")

    def commit(self, number: int) -> str:
        """Carry out a prepared change; return why a component refuses: then all others have their old values."""
        done = self._done[number] = []
        for change in self._prepared.get(number, ()):
            is_there = change.hosted.component is not None
            if reason := self.follow(change.hosted, change.new) if is_there else "it has failed meanwhile":
                return "; ".join(filter(None, (reason, self.undo(number))))
            done.append(change)
        return ""

    def undo(self, number: int) -> str:
        """Give components their old values back; return why one does not take them."""
        done = self._done.pop(number, [])
        reasons = [self.follow(change.hosted, change.old) for change in reversed(done)]
        return "; ".join(filter(None, reasons))

    def end(self, number: int) -> None:
        """Tell what was carried out, and let go of the components."""
        self._prepared.pop(number, None)
        for change in self._done.pop(number, ()):
            self.on_change(change.hosted, change.old, change.cause)

    def follow(self, hosted: Settable, config: Config) -> str:
        """Apply a configuration to a component, or to what it becomes; return why not."""
        name = hosted.instance.name
        if hosted.component is None:  # it comes back with this
            hosted.config = config
            return ""
        try:
            hosted.reconfigure(config)
        except Refused as refusal:
            return str(refusal)
        except (Exception, SystemExit) as error:  # as in a step: the failure of the component alone
            self.failed(name, error)
            return f"'{name}' has failed: {type(error).__name__}: {error}"
        return ""


EVENTS = "/parameter_events"
BY_APPLY, BY_RESTART = ChangeCause("apply"), ChangeCause("the restart of its process")
OWN = 0  # the number of a change where there is no supervisor
# The supervisor numbers its changes from 1; what is prepared when it is asked for has the negative of that number.

WhenDecided = Callable[[ChangeRefusal | None], None]
_SetParameters = Callable[[Sequence[rcl.Parameter], Callable[[rcl.SetParametersResult], None]], None]


@dataclass(frozen=True, slots=True)
class Deciders:
    """Who decides about changes: the supervisor, whom `ask` asks; without one, the `rules` in this process."""

    ask: Callable[[AskForChange], None] | None = None
    rules: RobotRules | None = None


NOBODY_ELSE = Deciders()


class Parameters:
    """Serves the parameters of the components of one process."""

    def __init__(
        self,
        owner: str,
        bus: Bus,
        clock: Clock,
        namespace: str,
        hosted: Mapping[str, Settable],
        failed: Callable[[str, BaseException], None],
        deciders: Deciders,
        notify: Callable[[SettingsKept], None],
    ) -> None:
        self._bus, self._clock, self._namespace, self._deciders = bus, clock, namespace, deciders
        self._notify = notify
        self._publish_event = bus.publisher(owner, EVENTS, rcl.ParameterEvent, Qos.EVENT)
        self._histories: dict[str, ParameterHistory] = {}
        self.changes = LiveChanges(hosted, failed, self.report_change, self.history)
        self._asked: dict[int, WhenDecided] = {}
        self._numbers = count(1)

    def serve(self, hosted: Settable) -> None:
        """Answer the services of a component, until its ends on the bus are closed."""
        served = _Served(self, hosted)
        name, serve, later = hosted.instance.name, self._bus.serve, self._bus.serve_later
        serve(name, f"{name}/list_parameters", rcl.ListParameters, served.list)
        serve(name, f"{name}/get_parameters", rcl.GetParameters, served.get)
        serve(name, f"{name}/get_parameter_types", rcl.GetParameterTypes, served.types)
        serve(name, f"{name}/describe_parameters", rcl.DescribeParameters, served.describe)
        later(name, f"{name}/set_parameters", rcl.SetParameters, served.set_each)
        later(name, f"{name}/set_parameters_atomically", rcl.SetParametersAtomically, served.set_all)
        if served.may_change:
            later(name, f"{name}/change_parameters", ChangeParameters, served.change)

    def history(self, name: str) -> ParameterHistory:
        """Return the changes of a component, which outlive its restarts in this process."""
        return self._histories.setdefault(name, ParameterHistory(name))

    def node(self, name: str) -> str:
        """Return what a component is called on the bus: `/left/battery`."""
        return resolve(name, self._namespace)

    # Changes

    def change(self, hosted: Settable, config: Config) -> None:
        """Apply the settings of a new plan to a component, and publish the change.

        Raises:
            Refused: if this cannot be done now, with the reason.
        """
        old = hosted.config
        hosted.reconfigure(config)
        self.report_change(hosted, old, BY_APPLY)

    def restore(self, hosted: Settable, text: str) -> str:
        """Give a component the settings that it had before its process was restarted; return why it refuses."""
        old, (config,) = hosted.config, load_configs(text).values()
        reason = self.changes.follow(hosted, config)
        self.report_change(hosted, old, BY_RESTART)
        return reason

    def want(self, wanted: WantedChange, then: WhenDecided) -> None:
        """Change settings of components, by their nodes; `then` gets why not, now or later.

        What no rule about the whole robot could notice, and concerns one component, is decided here.
        """
        if self._deciders.ask is None:
            then(self._decided(wanted, self._deciders.rules))
            return
        number, own = next(self._numbers), self._own(wanted)
        (name, *others) = own.parts or [""]
        new = ""
        if len(wanted.parts) == 1 and not others and name and self.changes.is_open(name):
            try:
                (change,) = self.changes.prepare(-number, own)
            except Refused as refusal:
                then(ChangeRefusal(str(refusal)))
                return
            if not change.is_ruled:
                reason = self.changes.commit(-number)
                self.changes.end(-number)
                then(ChangeRefusal(reason) if reason else None)
                return
            new = self.changes.text({name: change.new})
        self._asked[number] = then
        self._deciders.ask(AskForChange(number, wanted, self.changes.text(self.changes.live), new))

    def decided(self, number: int, refusal: ChangeRefusal | None) -> None:
        """Take what the supervisor has decided."""
        self.changes.end(-number)
        self._asked.pop(number)(refusal)

    def _own(self, wanted: WantedChange) -> WantedChange:
        """Return what is wanted of the components of this process, by their names."""
        names = {self.node(name): name for name in self.changes.hosted}
        parts = {names[node]: part for node, part in wanted.parts.items() if node in names}
        return WantedChange(parts, wanted.by, wanted.together)

    def _decided(self, wanted: WantedChange, rules: RobotRules | None) -> ChangeRefusal | None:
        """Carry out a change here, where all components are in this process."""
        own = self._own(wanted)
        if unknown := next((node for node in wanted.parts if node not in map(self.node, own.parts)), None):
            return ChangeRefusal(f"'{unknown}' is no component of this robot")
        try:
            new: Configs = {change.hosted.instance.name: change.new for change in self.changes.prepare(OWN, own)}
            broken = rules.why_not(self.changes.live, new) if rules else None
            reason = "" if broken else self.changes.commit(OWN)
        except Refused as refusal:
            return ChangeRefusal(str(refusal))
        finally:
            self.changes.end(OWN)
        return broken or (ChangeRefusal(reason) if reason else None)

    def report_change(self, hosted: Settable, old: Config, cause: ChangeCause) -> None:
        """Log, keep and publish which parameters of a component have changed."""
        after = core.differences(old, hosted.config)
        if not after:
            return
        name = hosted.instance.name
        _say(hosted, after, cause)
        self.history(name).note(core.differences(hosted.config, old), after, cause, self._clock.stamp())
        stamp = to_time(self._clock.stamp())
        self._publish_event(rcl.ParameterEvent(stamp=stamp, node=self.node(name), changed_parameters=tuple(after)))
        is_live = hosted.config != hosted.instance.config
        self._notify(SettingsKept(name, self.changes.text({name: hosted.config}) if is_live else ""))


class _Served:
    """The implementation of the services of one component."""

    def __init__(self, parameters: Parameters, hosted: Settable) -> None:
        self._parameters, self._hosted = parameters, hosted
        self._node = parameters.node(hosted.instance.name)

    @property
    def _settings(self) -> dict[str, core.ParameterField]:
        return core.settings(self._hosted.config, self._hosted.instance.bounds)

    def list(self, request: rcl.ListParameters.Request) -> rcl.ListParameters.Response:
        found = core.listed(self._settings, request.prefixes, request.depth)
        return rcl.ListParameters.Response(result=found)

    def get(self, request: rcl.GetParameters.Request) -> rcl.GetParameters.Response:
        return rcl.GetParameters.Response(values=core.values_of(self._settings, request.names))

    def types(self, request: rcl.GetParameterTypes.Request) -> rcl.GetParameterTypes.Response:
        found = core.values_of(self._settings, request.names)
        return rcl.GetParameterTypes.Response(types=bytes(value.type for value in found))

    def describe(self, request: rcl.DescribeParameters.Request) -> rcl.DescribeParameters.Response:
        known = self._settings
        found = tuple(
            known[name].descriptor if name in known else rcl.ParameterDescriptor(name=name) for name in request.names
        )
        return rcl.DescribeParameters.Response(descriptors=found)

    def set_each(self, asked: ServedRequest[rcl.SetParameters.Request, rcl.SetParameters.Response]) -> None:
        _EachInTurn(asked, self._set).go_on()

    def set_all(
        self, asked: ServedRequest[rcl.SetParametersAtomically.Request, rcl.SetParametersAtomically.Response]
    ) -> None:
        def reply(result: rcl.SetParametersResult) -> None:
            asked.reply(rcl.SetParametersAtomically.Response(result=result))

        self._set(asked.message.parameters, reply)

    @property
    def may_change(self) -> bool:
        """Return whether any of its parameters may change while the robot runs."""
        return any(setting.is_live for setting in self._settings.values())

    def change(self, asked: ServedRequest[ChangeParameters.Request, ChangeParameters.Response]) -> None:
        """Change all parameters or none, unless somebody has changed what the caller takes for known."""
        request = asked.message

        def reply(refusal: ChangeRefusal | None) -> None:
            changes = self._parameters.history(self._hosted.instance.name).changes if request.tell_changes else ()
            answer = refusal or ChangeRefusal("")
            asked.reply(
                ChangeParameters.Response(
                    success=refusal is None,
                    message=answer.reason,
                    help=answer.help,
                    breaks_rule=answer.breaks_rule,
                    is_half_done=answer.is_half_done,
                    changes=tuple(changes),
                )
            )

        parts = {resolve(other.node, ""): other for other in request.others}
        if request.parameters:
            parts[self._node] = NodeChange(self._node, request.parameters, request.expected, request.undoes)
        if parts:
            wanted = WantedChange.of(parts, request.by or BY_A_TOOL.by, request.together)
            self._parameters.want(wanted, reply)
        else:
            reply(None)

    def _set(self, parameters: Sequence[rcl.Parameter], then: Callable[[rcl.SetParametersResult], None]) -> None:
        part = NodeChange(self._node, tuple(parameters))
        self._parameters.want(WantedChange.of({self._node: part}, BY_A_TOOL.by), partial(_answer, then))


class _EachInTurn:
    """Sets the parameters of a request one after the other; an answer may come at once or later."""

    def __init__(
        self, asked: ServedRequest[rcl.SetParameters.Request, rcl.SetParameters.Response], set_: _SetParameters
    ) -> None:
        self._asked, self._set = asked, set_
        self._wanted, self._results = asked.message.parameters, list[rcl.SetParametersResult]()
        self._is_going = False

    def go_on(self) -> None:
        """Set the next ones, as far as answers come at once."""
        self._is_going = True
        while (had := len(self._results)) < len(self._wanted):
            self._set([self._wanted[had]], self._take)
            if len(self._results) == had:
                break
        else:
            self._asked.reply(rcl.SetParameters.Response(results=tuple(self._results)))
        self._is_going = False

    def _take(self, result: rcl.SetParametersResult) -> None:
        self._results.append(result)
        if not self._is_going:
            self.go_on()


def _answer(then: Callable[[rcl.SetParametersResult], None], refusal: ChangeRefusal | None) -> None:
    then(rcl.SetParametersResult(successful=refusal is None, reason=refusal.text if refusal else ""))


def _say(hosted: Settable, parameters: Sequence[rcl.Parameter], cause: ChangeCause) -> None:
    known, words = core.settings(hosted.config), []
    for parameter in parameters:
        value, dimension = from_message(parameter.value), known[parameter.name].dimension
        is_quantity = dimension is not None and isinstance(value, float)
        words.append(f"{parameter.name} = {format_quantity(value, dimension) if is_quantity else value}")  # type: ignore[arg-type]
    if hosted.component is not None:
        who = "" if cause == BY_A_TOOL else f", by {cause.by}"
        hosted.component.info(f"set: {', '.join(words)}{who}")
