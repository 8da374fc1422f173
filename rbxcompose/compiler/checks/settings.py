"""Rules about settings: processes, restarts, simulation and access, and what missions change."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.evaluate import evaluate
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.expressions.types import Type, TypeKind
from rbxcompose.base.expressions.values import EvaluationError, Scope, Value
from rbxcompose.base.findings import NAMES, OUR_CODES, Finding, Related, Severity
from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.compiler.check_runner import check, checks_of
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.compiler.model.skills import constants
from rbxcompose.manifest.tree import ScalarNode, at
from rbxcompose.missions.analysis.examined import Examined, check_written
from rbxcompose.missions.analysis.facts import Constants, constants_of
from rbxcompose.missions.program.parts import WrittenSetting, expression_of


@check("RBX3025")
def access_elsewhere(robot: Robot) -> Iterator[Finding]:
    """The access is restricted at a router that is not the robot's own."""
    bus = robot.manifest.bus
    if bus.access == "user" and bus.router is not None:
        yield access_elsewhere.at(
            robot.value("bus", "access"),
            "'access: user' has no effect on an existing router",
            help="remove 'router', or protect that router itself and remove 'access'",
            related=[Related(robot.value("bus", "router"), "the router that decides who takes part")],
        )


@check("RBX8002")
def external_clock(robot: Robot) -> Iterator[Finding]:
    """The real robot must keep its own time."""
    if robot.manifest.is_simulated or robot.manifest.bus.clock != "external":
        return
    yield external_clock.at(
        robot.value("bus", "clock"),
        "the real robot cannot follow the time of a simulator",
        help="run it without '--real', or remove 'clock'",
    )


@check("RBX8001")
def only_simulated(robot: Robot) -> Iterator[Finding]:
    """A component that exists only in simulation cannot run on the real robot."""
    if robot.manifest.is_simulated:
        return
    for component in robot.components.values():
        if component.cls.simulated:
            yield only_simulated.at(
                robot.value(*component.path, "type"),
                f"'{component.name}' exists only in simulation: '{component.type_name}'",
                help="run it without '--real', or use a type for the real device",
            )


WORLD = "world"


@check("RBX6001", Severity.WARNING, closed=())
def world_group(robot: Robot) -> Iterator[Finding]:
    """The process group `world` is for simulated truth only."""
    for component in robot.components.values():
        if component.process == component.cls.process or WORLD not in (component.process, component.cls.process):
            continue
        if component.process == WORLD == robot.manifest.process:
            continue
        if component.cls.process == WORLD:
            message = f"'{component.name}' is simulated and belongs in the group 'world', not in '{component.process}'"
        else:
            message = f"'{component.name}' is not part of the simulated world, but runs in its group"
        is_of_all = component.process == robot.manifest.process
        place = robot.value("process") if is_of_all else robot.value(*component.path, "process")
        yield world_group.at(place, message, help="write 'process: world'" if is_of_all else "remove 'process'")


_LIMITS = ("max", "within", "backoff")


@check("RBX3508", Severity.WARNING, closed=())
def idle_restart(robot: Robot) -> Iterator[Finding]:
    """A limit of restarts that never happen."""
    for component in robot.components.values():
        path = (*component.path, "restart")
        if component.restart.when != "never" or at(robot.manifest.root, path) is None:
            continue
        for key in _LIMITS:
            if at(robot.manifest.root, (*path, key)) is not None:
                message = f"'{key}' changes nothing: '{component.name}' is never restarted"
                yield idle_restart.at(
                    robot.key(*path, key), message, help=f"write 'when: on_failure', or remove '{key}'"
                )


@check("RBX5006", Severity.WARNING)
def shortened_pause(robot: Robot) -> Iterator[Finding]:
    """The pause before a restart is longer than it can be."""
    for component in robot.components.values():
        limits = component.restart
        longest = limits.within / limits.max
        path = (*component.path, "restart", "backoff")
        if limits.when == "on_failure" and limits.backoff > longest and at(robot.manifest.root, path) is not None:
            enough = sum(limits.backoff * 2.0**number for number in range(limits.max - 1))
            wanted, shortened = format_quantity(limits.backoff, TIME), format_quantity(longest, TIME)
            yield shortened_pause.at(
                robot.value(*path),
                f"'{component.name}' never pauses for {wanted}: {shortened} is the longest with which {limits.max} "
                f"failures fit into {format_quantity(limits.within, TIME)}",
                help=f"pauses that double from {wanted} need 'within: {format_quantity(enough, TIME)}' or more, "
                "or a lower 'max'",
            )


@check("RBX7011", closed=(NAMES,))
def parameter_value(robot: Robot) -> Iterator[Finding]:
    """A mission gives a setting a value that it cannot have."""
    for mission in robot.missions.values():
        for view in Examined(mission.program, robot.names).views:
            setting = view.node.step.effects.setting
            if setting is None:
                continue
            wanted = robot.names.settings.get(setting.component.text, {}).get(setting.parameter.text)
            value = view.node.step.arguments[0].value
            if wanted is None or not isinstance(value, ScalarNode) or not value.text:
                continue
            found = list(check_written(view, value, wanted, parameter_value))
            known = constants_of(mission.program, mission.inputs)
            component = robot.components[setting.component.text]
            yield from found or _beyond(component, setting.parameter.text, value, wanted, known)


class _Constants(Scope):
    """What is known before the mission runs: values that nothing changes, no places and no messages."""

    def __init__(self, known: Constants) -> None:
        self._known = known

    def variable(self, name: str) -> Value:
        """Return a value that nothing changes."""
        return self._known[name]


def _beyond(
    component: RobotComponent, name: str, value: ScalarNode, wanted: Type, known: Constants
) -> Iterator[Finding]:
    """Yield the finding on a value that is known and that the component would refuse."""
    from rbxcompose.sdk.parameters import UnsettableError  # with messages that few robots need for a check

    try:
        config_with(component, name, value, wanted, known)
    except UnsettableError as error:
        yield parameter_value.at(value.span, f"'{component.name}' would refuse this: {error}")


def config_with(
    component: RobotComponent, name: str, value: ScalarNode, wanted: Type, known: Constants
) -> Config | None:
    """Return the configuration of a component with a setting as a mission writes it; None if that is not known.

    Raises:
        UnsettableError: if the component refuses the value.
    """
    if wanted.kind in (TypeKind.TEXT, TypeKind.CHOICE):
        return None  # its words are checked as its type
    try:
        given = evaluate(expression_of(value), _Constants(known))
    except (EvaluationError, ExpressionError, KeyError):
        return None
    from rbxcompose.msgs.rcl_interfaces import Parameter  # messages that few robots need for a check
    from rbxcompose.sdk.parameters import changed, to_message

    message = to_message(given)
    return None if message is None else changed(component.config, [Parameter(name, message)], component.bounds)


@check("RBX7010", is_fixable=True, closed=(NAMES,))
def unknown_parameter(robot: Robot) -> Iterator[Finding]:
    """A mission changes a setting that the robot does not have, or that cannot change while it runs."""
    for mission in robot.missions.values():
        for node in mission.program.nodes:
            if (setting := node.step.effects.setting) is not None:
                yield from _of_setting(robot, setting)


def _of_setting(robot: Robot, setting: WrittenSetting) -> Iterator[Finding]:
    component, parameter = setting.component, setting.parameter
    types = robot.names.settings
    if not component.text or not parameter.text:
        return  # reported where it was read
    if component.text not in robot.components:
        yield _unknown(component, f"the robot has no component '{component.text}'", types, "components with settings")
    elif parameter.text not in types.get(component.text, {}):
        from rbxcompose.sdk.parameters import settings  # with messages that few robots need for a check

        known = settings(robot.components[component.text].config)
        live = types.get(component.text, {})
        if parameter.text in known:
            message = f"'{parameter.text}' of '{component.text}' cannot change while the robot runs"
            help_text = f"what may change is {', '.join(live)}" if live else ""
            yield unknown_parameter.at(parameter.span, message, help=help_text)
        else:
            message = f"'{component.text}' has no setting '{parameter.text}'"
            yield _unknown(parameter, message, live, "its live settings")


def _unknown(scalar: ScalarNode, message: str, valid: Iterable[str], what: str) -> Finding:
    return unknown_parameter.misspelt(scalar.span, message, scalar.text, list(valid), what)


@check("RBX4186", Severity.WARNING)
def setting_breaks_rule(robot: Robot) -> Iterator[Finding]:
    """A mission gives a setting a value that does not fit the rest of the robot."""
    written = list({(one.place, one.value.text): one for one in _written(robot)}.values())
    before = {(finding.code, finding.span) for finding in _found(robot)} if written else set()
    refused = {span for code, span in before if code == parameter_value.code}
    for change in written:
        if change.value.span in refused:
            continue
        new = [found for found in _found(_with(robot, change)) if (found.code, found.span) not in before]
        others = [other for other in written if other.place != change.place]
        helped = (_codes(_with(_with(robot, other), change)) for other in others)  # by what was set before
        if new and all(new[0].code in codes for codes in helped):
            yield setting_breaks_rule.at(
                change.value.span,
                f"with this, {new[0].message} ({new[0].code}): the change would be refused",
                help=new[0].help,
                related=[Related(new[0].span, "what it does not fit")] if new[0].span else [],
            )


@dataclass(frozen=True, slots=True)
class _Change:
    """A step that sets something: the component, the setting with its type, the value, and what is constant there."""

    component: str
    parameter: str
    wanted: Type
    value: ScalarNode
    known: Constants

    @property
    def place(self) -> tuple[str, str]:
        return self.component, self.parameter


def _written(robot: Robot) -> Iterator[_Change]:
    """Yield the changes that are known before a mission runs and that a rule may notice."""
    settings = robot.settings
    for mission in robot.missions.values() if settings else ():
        for node in mission.program.nodes:
            if (setting := node.step.effects.setting) is None:
                continue
            name, parameter = setting.component.text, setting.parameter.text
            value, wanted = node.step.arguments[0].value, settings.get(name, {}).get(parameter)
            if wanted is not None and isinstance(value, ScalarNode) and value.text:
                change = _Change(name, parameter, wanted, value, constants(mission))
                if _with(robot, change) is not robot:
                    yield change


def _with(robot: Robot, change: _Change) -> Robot:
    """Return the robot as it is after a change; itself, if that is unknown, refused or of no concern to rules."""
    from rbxcompose.sdk.parameters import UnsettableError  # with messages that few robots need for a check

    old = robot.components[change.component]
    try:
        config = config_with(old, change.parameter, change.value, change.wanted, change.known)
    except UnsettableError:
        return robot  # reported by RBX7011
    capabilities = old.cls.capabilities(config) if config is not None and old.is_sound else old.capabilities
    if config is None or capabilities == old.capabilities:
        return robot
    new = replace(old, config=config, capabilities=capabilities)
    return replace(robot, components={**robot.components, change.component: new})


def _found(robot: Robot) -> Iterator[Finding]:
    """Yield what our other rules about the robot find."""
    for one in checks_of(robot):
        if one.code.startswith(OUR_CODES) and one.code != setting_breaks_rule.code:
            yield from one(robot)


def _codes(robot: Robot) -> set[str]:
    return {finding.code for finding in _found(robot)}
