"""Parameters on the bus: the six services of each component, one of our own, and the events that report changes."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import resolve
from rbxcompose.clock import Clock
from rbxcompose.config import Config
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters
from rbxcompose.msgs.stamps import to_time
from rbxcompose.params import core
from rbxcompose.params.history import BY_A_TOOL, MARK, ChangeCause, ParameterHistory
from rbxcompose.params.values import from_message, to_message
from rbxcompose.qos import Qos
from rbxcompose.requests import Refused
from rbxcompose.runtime.process_group.hosted import Hosted
from rbxcompose.units import format_quantity

EVENTS = "/parameter_events"
BY_APPLY = ChangeCause("apply")


class Parameters:
    """Serves the parameters of the components of one process."""

    def __init__(self, owner: str, bus: Bus, clock: Clock, namespace: str) -> None:
        self._bus, self._clock, self._namespace = bus, clock, namespace
        self._tell = bus.publisher(owner, EVENTS, rcl.ParameterEvent, Qos.EVENT)
        self._histories: dict[str, ParameterHistory] = {}

    def serve(self, hosted: Hosted) -> None:
        """Answer the services of a component, until its ends on the bus are closed."""
        served = _Served(self, hosted)
        name, serve = hosted.instance.name, self._bus.serve
        serve(name, f"{name}/list_parameters", rcl.ListParameters, served.list)
        serve(name, f"{name}/get_parameters", rcl.GetParameters, served.get)
        serve(name, f"{name}/get_parameter_types", rcl.GetParameterTypes, served.types)
        serve(name, f"{name}/describe_parameters", rcl.DescribeParameters, served.describe)
        serve(name, f"{name}/set_parameters", rcl.SetParameters, served.set_each)
        serve(name, f"{name}/set_parameters_atomically", rcl.SetParametersAtomically, served.set_all)
        if served.may_change:
            serve(name, f"{name}/change_parameters", ChangeParameters, served.change)

    def history(self, name: str) -> ParameterHistory:
        """Return the changes of a component, which outlive its restarts in this process."""
        return self._histories.setdefault(name, ParameterHistory(name))

    def change(self, hosted: Hosted, config: Config) -> None:
        """Apply new settings to a component, and publish the change.

        Raises:
            Refused: if this cannot be done now, with the reason.
        """
        _Served(self, hosted).follow(config, BY_APPLY)

    def tell(
        self, name: str, before: Sequence[rcl.Parameter], after: Sequence[rcl.Parameter], cause: ChangeCause
    ) -> None:
        """Keep and publish that parameters of a component have changed."""
        self.history(name).note(before, after, cause, self._clock.stamp())
        stamp, node = to_time(self._clock.stamp()), resolve(name, self._namespace)
        self._tell(rcl.ParameterEvent(stamp=stamp, node=node, changed_parameters=tuple(after)))


class _Served:
    """The implementation of the services of one component."""

    def __init__(self, parameters: Parameters, hosted: Hosted) -> None:
        self._parameters, self._hosted = parameters, hosted

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

    def set_each(self, request: rcl.SetParameters.Request) -> rcl.SetParameters.Response:
        return rcl.SetParameters.Response(results=tuple(self._set([one]) for one in request.parameters))

    def set_all(self, request: rcl.SetParametersAtomically.Request) -> rcl.SetParametersAtomically.Response:
        return rcl.SetParametersAtomically.Response(result=self._set(request.parameters))

    @property
    def may_change(self) -> bool:
        """Return whether any of its parameters may change while the robot runs."""
        return any(one.is_live for one in self._settings.values())

    def change(self, request: ChangeParameters.Request) -> ChangeParameters.Response:
        """Change all parameters or none, unless somebody has changed what the caller takes for known."""
        changes = tuple(self._history.changes) if request.tell_changes else ()
        try:
            self._require_known(request.expected)
            new = core.changed(self._hosted.config, request.parameters, self._hosted.instance.bounds)
            if not request.only_check:
                self.follow(new, ChangeCause(request.by or BY_A_TOOL.by, request.together, request.undoes))
        except (core.UnsettableError, Refused) as refusal:
            return ChangeParameters.Response(success=False, message=str(refusal), changes=changes)
        return ChangeParameters.Response(success=True, changes=changes)

    def _require_known(self, expected: Sequence[rcl.Parameter]) -> None:
        now = self._settings
        for one in expected:
            if (there := now.get(one.name)) is None or to_message(there.value) != one.value:
                last = next((each for each in reversed(self._history.changes) if each.name == one.name), None)
                who = f" by {last.by} ({last.component}{MARK}{last.number})" if last else ""
                raise Refused(f"'{one.name}' was changed meanwhile{who}")

    @property
    def _history(self) -> ParameterHistory:
        return self._parameters.history(self._hosted.instance.name)

    def _set(self, parameters: Sequence[rcl.Parameter]) -> rcl.SetParametersResult:
        try:
            self.follow(core.changed(self._hosted.config, parameters, self._hosted.instance.bounds), BY_A_TOOL)
        except (core.UnsettableError, Refused) as refusal:
            return rcl.SetParametersResult(successful=False, reason=str(refusal))
        return rcl.SetParametersResult(successful=True)

    def follow(self, new: Config, cause: ChangeCause) -> None:
        old = self._hosted.config
        self._hosted.reconfigure(new)
        others = core.differences(old, new)
        if others:
            self._say(others, cause)
            self._parameters.tell(self._hosted.instance.name, core.differences(new, old), others, cause)

    def _say(self, parameters: Sequence[rcl.Parameter], cause: ChangeCause) -> None:
        component, known = self._hosted.component, self._settings
        words = []
        for one in parameters:
            value, dimension = from_message(one.value), known[one.name].dimension
            is_quantity = dimension is not None and isinstance(value, float)
            words.append(f"{one.name} = {format_quantity(value, dimension) if is_quantity else value}")  # type: ignore[arg-type]
        if component is not None:
            who = "" if cause is BY_A_TOOL else f", by {cause.by}"
            component.info(f"set: {', '.join(words)}{who}")
