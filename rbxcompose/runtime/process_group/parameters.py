"""Parameters on the bus: the six services of each component, and the events that report changes."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import resolve
from rbxcompose.clock import Clock
from rbxcompose.config import Config
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.stamps import to_time
from rbxcompose.params import core
from rbxcompose.params.values import from_message
from rbxcompose.qos import Qos
from rbxcompose.requests import Refused
from rbxcompose.runtime.process_group.hosted import Hosted
from rbxcompose.units import format_quantity

EVENTS = "/parameter_events"


class Parameters:
    """Serves the parameters of the components of one process."""

    def __init__(self, owner: str, bus: Bus, clock: Clock, namespace: str) -> None:
        self._bus, self._clock, self._namespace = bus, clock, namespace
        self._tell = bus.publisher(owner, EVENTS, rcl.ParameterEvent, Qos.EVENT)

    def serve(self, hosted: Hosted) -> None:
        """Answer the six services of a component, until its ends on the bus are closed."""
        served = _Served(self, hosted)
        name, serve = hosted.instance.name, self._bus.serve
        serve(name, f"{name}/list_parameters", rcl.ListParameters, served.list)
        serve(name, f"{name}/get_parameters", rcl.GetParameters, served.get)
        serve(name, f"{name}/get_parameter_types", rcl.GetParameterTypes, served.types)
        serve(name, f"{name}/describe_parameters", rcl.DescribeParameters, served.describe)
        serve(name, f"{name}/set_parameters", rcl.SetParameters, served.set_each)
        serve(name, f"{name}/set_parameters_atomically", rcl.SetParametersAtomically, served.set_all)

    def change(self, hosted: Hosted, config: Config) -> None:
        """Apply new settings to a component, and publish the change.

        Raises:
            Refused: if this cannot be done now, with the reason.
        """
        _Served(self, hosted).follow(config)

    def tell(self, name: str, parameters: Sequence[rcl.Parameter]) -> None:
        """Publish that parameters of a component have changed."""
        stamp, node = to_time(self._clock.stamp()), resolve(name, self._namespace)
        self._tell(rcl.ParameterEvent(stamp=stamp, node=node, changed_parameters=tuple(parameters)))


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

    def _set(self, parameters: Sequence[rcl.Parameter]) -> rcl.SetParametersResult:
        try:
            self.follow(core.changed(self._hosted.config, parameters, self._hosted.instance.bounds))
        except (core.UnsettableError, Refused) as refusal:
            return rcl.SetParametersResult(successful=False, reason=str(refusal))
        return rcl.SetParametersResult(successful=True)

    def follow(self, new: Config) -> None:
        old = self._hosted.config
        self._hosted.reconfigure(new)
        others = core.differences(old, new)
        if others:
            self._say(others)
            self._parameters.tell(self._hosted.instance.name, others)

    def _say(self, parameters: Sequence[rcl.Parameter]) -> None:
        component, known = self._hosted.component, self._settings
        words = []
        for one in parameters:
            value, dimension = from_message(one.value), known[one.name].dimension
            is_quantity = dimension is not None and isinstance(value, float)
            words.append(f"{one.name} = {format_quantity(value, dimension) if is_quantity else value}")  # type: ignore[arg-type]
        if component is not None:
            component.info(f"set: {', '.join(words)}")
