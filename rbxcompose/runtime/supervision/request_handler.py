"""Carries out the requests from the control socket, or passes them on to the component that takes them."""

import inspect
import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from traceback import format_exc
from typing import Any, Protocol

from rbxcompose.base.config import value_at, with_values
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import (
    Command,
    Query,
    Refused,
    Request,
    UnreadableError,
    as_data,
    name_in,
    requests,
    to_data,
)
from rbxcompose.compiler.plan.dump import PlanTextError, load
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.msgs import registry
from rbxcompose.runtime import channel as messages
from rbxcompose.runtime.folder import ChosenLayers, RobotState
from rbxcompose.runtime.plan_requests import AdoptSaved, ApplyPlan, ComparePlan, PlanComparison, RevertPlan
from rbxcompose.runtime.requests import (
    ROBOT,
    BringDown,
    ComponentDescription,
    DescribeRobot,
    NoteInLog,
    PortDescription,
    ReleaseRobot,
    RobotStatus,
    StopRobot,
)
from rbxcompose.runtime.supervision.conductor import FINE, Conductor
from rbxcompose.runtime.supervision.members import ConductorEffects
from rbxcompose.runtime.supervision.plan_change import Changes, Consultations, changes
from rbxcompose.runtime.supervision.setting_changes import SettingChanges
from rbxcompose.sdk.capabilities import Capability, Setting
from rbxcompose.sdk.parameters import si_unit
from rbxcompose.sdk.ports import In, Out, Port, Qos, Serves, ServesAction, ServesTopic
from rbxcompose.sdk.registry import component_type

OWN = requests(
    RobotStatus, DescribeRobot, StopRobot, ReleaseRobot, NoteInLog, ComparePlan, ApplyPlan, RevertPlan, AdoptSaved,
    BringDown,
)  # fmt: skip
MOST_BACK = 20  # changes that can be taken back


class Supervised(ConductorEffects, Protocol):
    """What requests can do with a supervisor; an answer carries the number of its request."""

    conductor: Conductor

    def state(self) -> RobotState:
        """Return the state that is known from outside."""
        ...


class RequestHandler:
    """Carries out the requests of the command line and of any other program of this user."""

    def __init__(self, supervisor: Supervised, settings: SettingChanges, *, is_stepped: bool) -> None:
        """On a stepped clock the process group logs what came from outside, at its own time."""
        self._supervisor, self._settings, self._is_stepped = supervisor, settings, is_stepped
        self.consultations = Consultations(supervisor.send)
        self._before = deque[tuple[Plan, ChosenLayers, int]](maxlen=MOST_BACK)  # to which changes can be reverted

    def handle(self, data: object, number: int) -> None:
        """Carry out a request; it is answered now or later."""
        try:
            if name_in(data) in OWN.types:
                self._carry_out(OWN.from_data(data), number)
            else:
                self._pass_on(data, number)
        except UnreadableError as error:
            self._supervisor.refuse(number, f"the request '{name_in(data)}' cannot be read: {error}")
        except RecursionError:
            self._supervisor.refuse(number, "the request is nested too deeply")
        except Refused as refusal:
            self._supervisor.refuse(number, str(refusal))
        except Exception as error:  # our own bug: a question has changed nothing, so the robot goes on
            if not issubclass(OWN.types.get(name_in(data), Command), Query):
                raise
            reason = plain(f"{type(error).__name__}: {error}")
            self._supervisor.log(Level.ERROR, f"a question was not answered: {reason}", format_exc())
            self._supervisor.refuse(number, reason)

    def _carry_out(self, request: Request[Any], number: int) -> None:
        if not isinstance(request, RobotStatus | DescribeRobot | BringDown):
            self._refuse_at_the_end()
        match request:
            case ApplyPlan():
                self._apply(request, number)
            case RevertPlan():
                self._revert(request, number)
            case AdoptSaved(plan, names):
                self._adopt(_loaded(plan), names, number)
            case ComparePlan(plan):
                self._compare(plan, number)
            case _:
                self._supervisor.answer(number, to_data(self._answer(request)))

    def _answer(self, request: Request[Any]) -> object:
        match request:
            case RobotStatus():
                return self._supervisor.state()
            case DescribeRobot():
                return tuple(map(described, self._supervisor.conductor.plan.instances))
            case StopRobot(by):
                return self._stop(plain(by))
            case ReleaseRobot():
                return self._release()
            case NoteInLog(text):
                self._log(plain(text))
                return "noted"
            case BringDown():
                return self._bring_down()
        raise TypeError(f"{request} is not answered here")

    def _refuse_at_the_end(self) -> None:
        if self._supervisor.conductor.is_going_down:
            raise Refused("the robot is going down")

    def _stop(self, by: str) -> str:
        self._log("stop: all motion is held until 'release'")
        self._supervisor.conductor.stop(by)
        return "stopped; 'release' allows motion again"

    def _release(self) -> str:
        if not self._supervisor.conductor.is_stopped:
            raise Refused("the robot is not stopped")
        if reasons := self._supervisor.conductor.latch.holds.values():
            raise Refused(f"the robot must stand still: {'; '.join(reasons)}")
        self._log("release: motion is allowed again")
        self._supervisor.conductor.release()
        return "released"

    def _bring_down(self) -> str:
        if not self._supervisor.conductor.is_going_down:
            self._log("down: the robot goes down")
        self._supervisor.conductor.go_down(FINE, "asked to go down")
        return "going down"

    def _pass_on(self, data: object, number: int) -> None:
        """Pass a request on to the first component that takes it; this component answers."""
        wanted = data.get("component", "") if isinstance(data, dict) else ""
        taker = self._taker(name_in(data), wanted)
        known = component_type(taker.type).requests()
        request = known.from_data(data)
        if isinstance(request, Command):
            self._refuse_at_the_end()
        if self._supervisor.conductor.states[taker.name][0] != "active":
            raise Refused(f"'{taker.name}' is not active")
        self._supervisor.send(taker.process, messages.Ask(number, taker.name, as_data(request)))

    def _taker(self, name: str, wanted: object) -> Instance:
        """Return the first component that takes a request; one that names its component is for that one."""
        abouts = {ROBOT}
        for instance in self._supervisor.conductor.plan.instances:
            known = component_type(instance.type).requests().types
            if name in known and wanted in ("", instance.name):
                return instance
            abouts.update(each.about for each in known.values())
        about, dot, _ = name.partition(".")
        if wanted:
            raise Refused(f"the component '{wanted}' takes no such request")
        if dot and about not in abouts:
            raise Refused(f"this robot has no component of type '{about}'")
        raise Refused(f"there is no request '{name}'" if name else "this version of rbxcompose has no such request")

    # Another plan

    def _compare(self, plan: str, number: int) -> None:
        """Report what another plan would change, and what prevents it now; change nothing."""
        found, conductor = self._changes(_loaded(plan)), self._supervisor.conductor
        hindrance = "" if found.is_empty else conductor.hindrance(found)

        def considered(said: Sequence[str], refused: str) -> None:
            why_not = refused or ("" if found.is_empty else conductor.why_not(found))
            compared = PlanComparison.of(found, conductor.generation, why_not, tuple(said))
            self._supervisor.answer(number, to_data(compared))

        self.consultations.ask(found, () if hindrance else conductor.reached, considered)

    def _apply(self, request: ApplyPlan, number: int) -> None:
        found, conductor = self._changes(_loaded(request.plan)), self._supervisor.conductor
        if request.generation != conductor.generation:
            raise Refused("it was changed by someone else meanwhile: look at the difference again")
        self._change(found, request.layers, number)

    def _adopt(self, saved: Plan, names: Mapping[str, Sequence[str]], number: int) -> None:
        """Change the plan to what components have already."""
        conductor, configs = self._supervisor.conductor, {one.name: one.config for one in saved.instances}

        def with_saved(old: Instance) -> Instance:
            new = {name: value_at(configs[old.name], name) for name in names.get(old.name, ())}
            return replace(old, config=with_values(old.config, new))

        plan = conductor.plan
        try:
            found = changes(plan, replace(plan, instances=tuple(map(with_saved, plan.instances))))
        except (LookupError, AttributeError) as error:
            raise Refused("the robot has no such settings") from error
        if why_not := conductor.why_not(found) or ("they are not live" if found.starting else ""):
            raise Refused(why_not)
        self._hold_settings()

        def adopted(text: str, is_refused: bool) -> None:
            self._settings.go_on()
            self._supervisor.answer(number, text)

        conductor.change(found, adopted)

    def _revert(self, request: RevertPlan, number: int) -> None:
        if not self._before or request.generation not in (None, self._before[-1][2]):
            raise Refused("there is no such change to take back")
        plan, layers, _ = self._before[-1]
        self._change(self._changes(plan), layers, number, is_back=True)

    def _change(self, found: Changes, layers: ChosenLayers, number: int, *, is_back: bool = False) -> None:
        conductor = self._supervisor.conductor
        if hindrance := conductor.hindrance(found):
            raise Refused(hindrance)

        def considered(said: Sequence[str], refused: str) -> None:
            try:
                self._carry_out_change(found, layers, number, refused, is_back=is_back)
            except Refused as refusal:
                self._supervisor.refuse(number, str(refusal))

        self.consultations.ask(found, conductor.reached, considered)

    def _carry_out_change(
        self, found: Changes, layers: ChosenLayers, number: int, refused: str, *, is_back: bool
    ) -> None:
        conductor = self._supervisor.conductor
        if found.before is not conductor.plan:
            raise Refused("it was changed by someone else meanwhile: look at the difference again")
        if why_not := refused or conductor.why_not(found):
            raise Refused(why_not)
        self._hold_settings()
        before = conductor.plan, conductor.layers, conductor.generation

        def applied(text: str, is_refused: bool) -> None:
            self._settings.go_on()
            if conductor.generation != before[2] and is_back:
                self._before.pop()
            elif conductor.generation != before[2]:
                self._before.append(before)
            if not is_refused:
                conductor.layers = layers
            self._supervisor.log(Level.ERROR if is_refused else Level.OK, f"apply: {text}")
            (self._supervisor.refuse if is_refused else self._supervisor.answer)(number, text)

        conductor.change(found, applied)

    def _hold_settings(self) -> None:
        """Let nobody change settings until they go on."""
        if self._settings.is_busy:
            raise Refused("settings of the robot are just being changed: try again")
        self._settings.hold()

    def _changes(self, after: Plan) -> Changes:
        conductor = self._supervisor.conductor
        failed = [name for name, (state, _) in conductor.states.items() if state == "failed"]
        return changes(conductor.plan, after, failed)

    def _log(self, text: str) -> None:
        if not self._is_stepped:
            self._supervisor.log(Level.OK, text)


def _loaded(plan: str) -> Plan:
    try:
        with registry.choosing(registry.chosen().texts):  # the robot keeps its types, also if the plan is refused
            return load(plan)
    except PlanTextError as error:
        raise Refused(str(error)) from error


def described(instance: Instance) -> ComponentDescription:
    """Return what a component of the plan declares."""
    cls = component_type(instance.type)
    ports = cls.ports(instance.config)
    capabilities: dict[str, tuple[Mapping[str, Any], ...]] = {}
    for one in cls.capabilities(instance.config):
        capabilities[type(one).__name__] = (*capabilities.get(type(one).__name__, ()), _plain_fields(one))
    return ComponentDescription(
        name=instance.name,
        type=instance.type,
        about=inspect.cleandoc(cls.__doc__ or "").partition("\n\n")[0].replace("\n", " "),
        process=instance.process,
        ports=tuple(
            _port(ports[wire.port], wire.port, wire.topic, wire.type) for wire in instance.wires if wire.port in ports
        ),
        capabilities=capabilities,
        requests={name: issubclass(taken, Command) for name, taken in cls.requests().types.items()},
    )


def _port(port: Port[Any], name: str, topic: str, type_: str) -> PortDescription:
    named = port.skill if isinstance(port, Serves | ServesAction) else "" if isinstance(port, ServesTopic) else None
    return PortDescription(
        name,
        port.kind,
        topic,
        type_,
        unit=port.unit if isinstance(port, In | Out | Serves) else "",
        skill="" if named is None else named or topic.rpartition("/")[-1],
        is_command=isinstance(port, In) and port.qos is Qos.COMMAND,
        claims=port.claims if isinstance(port, ServesTopic | ServesAction) else "",
        is_pausable=isinstance(port, ServesAction) and port.pausable,
        measures=_units(port.measures) if isinstance(port, ServesAction) else {},
        choices={key: tuple(words) for key, words in port.choices.items()} if isinstance(port, ServesAction) else {},
        outcomes=dict(port.outcomes) if isinstance(port, ServesTopic | ServesAction) else {},
    )


def _units(measures: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _units(one) if isinstance(one, Mapping) else si_unit(one) for key, one in measures.items()}


def _plain_fields(capability: Capability) -> dict[str, Any]:
    """Return the fields of a capability, those that JSON can hold; of a setting, its value."""
    values = ((field.name, getattr(capability, field.name)) for field in fields(capability))
    return {name: _plain(value.value if isinstance(value, Setting) else value) for name, value in values}


def _plain(value: Any) -> Any:
    match value:
        case bool() | int() | str() | None:
            return value
        case float():
            return value if math.isfinite(value) else None
        case Enum():
            return value.value
        case Mapping():
            return {str(key): _plain(entry) for key, entry in value.items()}
        case list() | tuple():
            return [_plain(entry) for entry in value]
    return _plain({field.name: getattr(value, field.name) for field in fields(value)}) if is_dataclass(value) else None
