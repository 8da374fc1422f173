"""Parameters on the bus: the six services of each component, one of our own, and the events that report changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import count

from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import resolve
from rbxcompose.bus.services import ServedRequest
from rbxcompose.clock import Clock
from rbxcompose.config import Config
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters, NodeChange
from rbxcompose.msgs.stamps import to_time
from rbxcompose.params import core
from rbxcompose.params.change import ChangeRefusal, Configs, RobotRules, WantedChange
from rbxcompose.params.history import BY_A_TOOL, ChangeCause, ParameterHistory
from rbxcompose.params.values import from_message
from rbxcompose.qos import Qos
from rbxcompose.requests import Refused
from rbxcompose.runtime.process_group.hosted import Hosted
from rbxcompose.runtime.process_group.live_changes import LiveChanges
from rbxcompose.runtime.setting_messages import AskForChange
from rbxcompose.units import format_quantity

EVENTS = "/parameter_events"
BY_APPLY = ChangeCause("apply")
OWN = 0  # the number of a change that needs nobody else; those of the supervisor begin at 1

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
        hosted: Mapping[str, Hosted],
        failed: Callable[[str, Exception], None],
        deciders: Deciders,
    ) -> None:
        self._bus, self._clock, self._namespace, self._deciders = bus, clock, namespace, deciders
        self._tell = bus.publisher(owner, EVENTS, rcl.ParameterEvent, Qos.EVENT)
        self._histories: dict[str, ParameterHistory] = {}
        self.changes = LiveChanges(hosted, failed, self.tell, self.history)
        self._asked: dict[int, WhenDecided] = {}
        self._numbers = count(1)

    def serve(self, hosted: Hosted) -> None:
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

    def change(self, hosted: Hosted, config: Config) -> None:
        """Apply the settings of a new plan to a component, and publish the change.

        Raises:
            Refused: if this cannot be done now, with the reason.
        """
        old = hosted.config
        hosted.reconfigure(config)
        self.tell(hosted, old, BY_APPLY)

    def want(self, wanted: WantedChange, then: WhenDecided) -> None:
        """Change settings of components, by their nodes; `then` gets why not, now or later.

        What no rule about the whole robot could notice, and concerns one component, is decided here.
        """
        if self._deciders.ask is None:
            then(self._decided(wanted, self._deciders.rules))
            return
        (name, *others) = self._own(wanted).parts or [""]
        if len(wanted.parts) == 1 and not others and name and self.changes.is_open(name):
            is_over, refusal = self._alone(wanted)
            if is_over:
                then(refusal)
                return
        number = next(self._numbers)
        self._asked[number] = then
        self._deciders.ask(AskForChange(number, wanted))

    def decided(self, number: int, refusal: ChangeRefusal | None) -> None:
        """Take what the supervisor has decided."""
        self._asked.pop(number)(refusal)

    def _own(self, wanted: WantedChange) -> WantedChange:
        """Return what is wanted of the components of this process, by their names."""
        names = {self.node(name): name for name in self.changes.hosted}
        parts = {names[node]: part for node, part in wanted.parts.items() if node in names}
        return WantedChange(parts, wanted.by, wanted.together)

    def _alone(self, wanted: WantedChange) -> tuple[bool, ChangeRefusal | None]:
        """Decide about a change of one component if no rule could notice it; return whether that was so."""
        try:
            (one,) = self.changes.prepare(OWN, self._own(wanted))
        except Refused as refusal:
            return True, ChangeRefusal(str(refusal))
        reason = "" if one.is_ruled else self.changes.commit(OWN)
        self.changes.end(OWN)
        return not one.is_ruled, ChangeRefusal(reason) if reason else None

    def _decided(self, wanted: WantedChange, rules: RobotRules | None) -> ChangeRefusal | None:
        """Carry out a change here, where all components are in this process."""
        own = self._own(wanted)
        if unknown := next((node for node in wanted.parts if node not in map(self.node, own.parts)), None):
            return ChangeRefusal(f"'{unknown}' is no component of this robot")
        try:
            new: Configs = {one.hosted.instance.name: one.new for one in self.changes.prepare(OWN, own)}
            broken = rules.why_not(self.changes.live, new) if rules else None
            reason = "" if broken else self.changes.commit(OWN)
        except Refused as refusal:
            return ChangeRefusal(str(refusal))
        finally:
            self.changes.end(OWN)
        return broken or (ChangeRefusal(reason) if reason else None)

    def tell(self, hosted: Hosted, old: Config, cause: ChangeCause) -> None:
        """Log, keep and publish which parameters of a component have changed."""
        after = core.differences(old, hosted.config)
        if not after:
            return
        name = hosted.instance.name
        _say(hosted, after, cause)
        self.history(name).note(core.differences(hosted.config, old), after, cause, self._clock.stamp())
        stamp = to_time(self._clock.stamp())
        self._tell(rcl.ParameterEvent(stamp=stamp, node=self.node(name), changed_parameters=tuple(after)))


class _Served:
    """The implementation of the services of one component."""

    def __init__(self, parameters: Parameters, hosted: Hosted) -> None:
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
        return rcl.GetParameterTypes.Response(types=bytes(one.type for one in found))

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
        return any(one.is_live for one in self._settings.values())

    def change(self, asked: ServedRequest[ChangeParameters.Request, ChangeParameters.Response]) -> None:
        """Change all parameters or none, unless somebody has changed what the caller takes for known."""
        request = asked.message

        def reply(refusal: ChangeRefusal | None) -> None:
            changes = self._parameters.history(self._hosted.instance.name).changes if request.tell_changes else ()
            told = refusal or ChangeRefusal("")
            asked.reply(
                ChangeParameters.Response(
                    success=refusal is None,
                    message=told.reason,
                    help=told.help,
                    breaks_rule=told.breaks_rule,
                    is_half_done=told.is_half_done,
                    changes=tuple(changes),
                )
            )

        parts = {resolve(one.node, ""): one for one in request.others}
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


def _say(hosted: Hosted, parameters: Sequence[rcl.Parameter], cause: ChangeCause) -> None:
    known, words = core.settings(hosted.config), []
    for one in parameters:
        value, dimension = from_message(one.value), known[one.name].dimension
        is_quantity = dimension is not None and isinstance(value, float)
        words.append(f"{one.name} = {format_quantity(value, dimension) if is_quantity else value}")  # type: ignore[arg-type]
    if hosted.component is not None:
        who = "" if cause == BY_A_TOOL else f", by {cause.by}"
        hosted.component.info(f"set: {', '.join(words)}{who}")
