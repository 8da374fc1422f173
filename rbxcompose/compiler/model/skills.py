"""What missions can use and know of the robot: skills, topics, services; driving, levels and conditions."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from rbxcompose.base.expressions.check import check_condition
from rbxcompose.base.expressions.types import FLAG
from rbxcompose.base.findings import Related, Span
from rbxcompose.base.geometry import Pose2
from rbxcompose.base.plugins import BrokenPluginError
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.compiler.model.flow import MessageFlow
from rbxcompose.compiler.model.robot import NOTHING, Outside, PortEnd, Robot, RobotComponent, RobotMission
from rbxcompose.manifest.tree import at
from rbxcompose.missions.analysis.examined import NodeScope, base_scope, views
from rbxcompose.missions.analysis.facts import Bounds, Constants, constants_of, truth
from rbxcompose.missions.analysis.travel_times import Driving, Ways
from rbxcompose.missions.engine.world import POSE
from rbxcompose.missions.program.goals import service_skill, skill_of, topic_skill
from rbxcompose.missions.program.parts import Asked
from rbxcompose.missions.program.program import Program, Skill
from rbxcompose.missions.sources import Orders, OrderTopic, SkillSource, SkillWay, TopicSource
from rbxcompose.sdk.capabilities import CommandsMotion, Drains, Navigates
from rbxcompose.sdk.ports import In, Out, Qos, Serves, ServesAction, ServesTopic
from rbxcompose.sdk.registry import SkillType, skill_names, skill_type


def skills_of(
    components: Mapping[str, RobotComponent], programs: Iterable[Program], outside: Outside = NOTHING
) -> dict[str, SkillSource]:
    """Return the skills of the robot: actions, services, topics, and those in Python or of others that it uses."""
    asked = {node.skill for program in programs for node in program.nodes if node.skill}
    others = [skill_source for skill_source in outside.skills if skill_source.skill.name in asked]
    found: dict[str, SkillSource] = {}
    for source in [*served_skills(components), *python_skills(asked), *others]:
        found.setdefault(source.skill.name, source)
    return found


def names_of_skills(components: Mapping[str, RobotComponent], outside: Outside = NOTHING) -> frozenset[str]:
    """Return the names of all skills that a mission of the robot may use."""
    served = (source.skill.name for source in (*served_skills(components), *outside.skills))
    return frozenset((*served, *skill_names()))


def usable_skills(robot: Robot) -> dict[str, SkillSource]:
    """Return all skills that a mission of the robot may use, by name: those in Python also where none does so far."""
    in_python = {source.skill.name: source for source in python_skills(skill_names())}
    return dict(sorted({**in_python, **robot.skills}.items()))


def served_skills(components: Mapping[str, RobotComponent]) -> Iterable[SkillSource]:
    """Return the skills that components serve."""
    return (*_actions(components), *_services(components), *_topics(components))


def _actions(components: Mapping[str, RobotComponent]) -> Iterable[SkillSource]:
    for end in _ends(components):
        port = end.port
        if isinstance(port, ServesAction) and port.interface is not None and end.skill:
            skill = skill_of(
                port.interface,
                end.skill,
                port.claims,
                port.restartable,
                pausable=port.pausable,
                outcomes=port.outcomes,
                entries=port.entries,
                measures=port.measures,
                choices=port.choices,
                ranges=port.ranges,
                may_lack=port.may_lack,
            )
            yield SkillSource(skill, end.type_name, end.topic)


def _services(components: Mapping[str, RobotComponent]) -> Iterable[SkillSource]:
    for end in _ends(components):
        if isinstance(end.port, Serves) and end.port.interface is not None and end.skill:
            skill = service_skill(end.port.interface, end.skill)
            if skill is not None:
                yield SkillSource(skill, end.type_name, end.topic, SkillWay.SERVICE)


def _topics(components: Mapping[str, RobotComponent]) -> Iterable[SkillSource]:
    for end in _ends(components):
        port = end.port
        if not isinstance(port, ServesTopic) or port.interface is None:
            continue
        ends = port.ends.interface if port.ends is not None else None
        skill = topic_skill(
            port.interface, end.skill, ends, port.claims, port.restartable, outcomes=port.outcomes, entries=port.entries
        )
        yield SkillSource(skill, end.type_name, end.topic, SkillWay.TOPIC, _orders(components, end, port))


def _orders(components: Mapping[str, RobotComponent], end: PortEnd, port: ServesTopic[Any]) -> Orders:
    """Return the components that carry out orders, and the topics of the ports for their ends and halts."""
    servers = [each for each in _ends(components) if isinstance(each.port, ServesTopic) and each.topic == end.topic]
    own = components[end.instance].ends
    return Orders(
        str(port.qos),
        tuple(dict.fromkeys(server.instance for server in servers)),
        _beside(own, port.ends) if port.ends is not None else None,
        _beside(own, port.halts) if port.halts is not None else None,
    )


def _beside(own: Iterable[PortEnd], port: In[Any] | Out[Any]) -> OrderTopic:
    found = next((end for end in own if end.port is port), None)
    if found is None:
        raise ValueError(f"the port '{port.name}' of '{port.topic}' belongs to orders of a component that lacks it")
    return OrderTopic(found.topic, found.type_name, str(port.qos))


def python_skills(names: Iterable[str]) -> list[SkillSource]:
    """Return the skills in Python with these names, if they exist and can be used."""
    found = []
    for name in sorted(set(names) & set(skill_names())):
        try:
            found.append(SkillSource(as_skill(skill_type(name)), "", "", SkillWay.PYTHON))
        except BrokenPluginError:  # a mission that uses it gets a finding that nobody provides it
            continue
    return found


def as_skill(declared: SkillType) -> Skill:
    """Return a skill in Python as missions see it."""
    return Skill(
        declared.name,
        declared.arguments,
        declared.main,
        declared.required,
        declared.claims,
        declared.restartable,
        declared.pausable,
        declared.outcomes,
    )


def topics_of(manifest: RobotManifest, components: Mapping[str, RobotComponent]) -> dict[str, TopicSource]:
    """Return the topics whose type is known, with and without the robot's namespace."""
    found: dict[str, TopicSource] = {}
    for end in _ends(components):
        if isinstance(end.port, In | Out) and end.type_name:
            qos = end.port.qos if isinstance(end.port, In) else Qos.EVENT
            for name in _written(end.topic, manifest):
                if isinstance(end.port, In) or name not in found:
                    found[name] = TopicSource(end.type_name, str(qos.value))
    return found


def services_of(manifest: RobotManifest, components: Mapping[str, RobotComponent]) -> dict[str, str]:
    """Return the services with their types, with and without the robot's namespace."""
    ends = [end for end in _ends(components) if isinstance(end.port, Serves) and end.type_name]
    return {name: end.type_name for end in ends for name in _written(end.topic, manifest)}


def _ends(components: Mapping[str, RobotComponent]) -> Iterable[PortEnd]:
    return (end for component in components.values() for end in component.ends)


def _written(topic: str, manifest: RobotManifest) -> tuple[str, ...]:
    """Return the ways to write a topic in missions: absolute, or relative to the robot's namespace."""
    namespace = (manifest.bus.namespace or "").strip("/")
    before = f"/{namespace}/" if namespace else "/"
    return (topic, topic.removeprefix(before)) if topic.startswith(before) else (topic,)


def constants(mission: RobotMission) -> Constants:
    """Return the values of those `$names` of a mission that never change on this robot."""
    return constants_of(mission.program, mission.inputs)


def batteries(robot: Robot) -> dict[str, tuple[RobotComponent, Drains]]:
    """Return the values that are the level of a battery, each with that battery."""
    levels = {f"{component.name}.{drains.level}": (component, drains) for component, drains in robot.declared(Drains)}
    entries = robot.manifest.values.items()
    return {name: levels[entry.port] for name, entry in entries if entry.port in levels}


def navigator_of(robot: Robot, skill: str) -> tuple[RobotComponent, Navigates] | None:
    """Return the component that drives to places as this skill, None if it does not drive."""
    found = (pair for pair in robot.declared(Navigates) if is_served(robot, skill, pair[0], pair[1].goals))
    return next(found, None)


def is_served(robot: Robot, skill: str, component: RobotComponent, port: str) -> bool:
    """Return whether a port of a component serves a skill."""
    source, end = robot.skills.get(skill), component.end(port)
    return source is not None and end is not None and end.topic == source.topic


def top_speed(robot: Robot, driver: RobotComponent, navigates: Navigates) -> float:
    """Return the highest speed at which the robot drives to a place [m/s], infinite if no limit is known."""
    limits = [navigates.max_speed, *(motion.max_speed for motion in driver.declared(CommandsMotion))]
    limits += [drive.drives.max_speed for drive in MessageFlow(robot).drives() if drive.driver is driver]
    return min((limit.value for limit in limits if limit), default=math.inf)


def ways_of(robot: Robot, mission: RobotMission) -> Ways | None:
    """Return an empty record of the mission's ways; None if it drives with several skills."""
    used = {node.skill for node in mission.program.nodes if node.skill}
    found = [(skill, *pair) for skill in sorted(used) if (pair := navigator_of(robot, skill))]
    if not found:
        return Ways(mission.program, Driving("", "", 0.0, Pose2.distance), robot.manifest.places)
    if len(found) > 1:
        return None
    skill, driver, navigates = found[0]
    tolerance, least_time = navigates.tolerance, _least_time(robot, driver, navigates)
    driving = Driving(skill, robot.skills[skill].skill.main, tolerance.value if tolerance else 0.0, least_time)
    return Ways(mission.program, driving, robot.manifest.places)


def _least_time(robot: Robot, driver: RobotComponent, navigates: Navigates) -> Callable[[Pose2, Pose2], float]:
    """Return what tells the least time between two poses [s]: the driver itself, or the straight way at full speed."""
    if (own := navigates.least_time) is not None:
        base = next((drive.drives for drive in MessageFlow(robot).drives() if drive.driver is driver), None)
        return lambda start, goal: own(start, goal, base)
    speed, tolerance = top_speed(robot, driver, navigates), navigates.tolerance
    free = 2 * tolerance.value if tolerance else 0.0  # from edge to edge of the tolerances
    return lambda start, goal: max(0.0, start.distance(goal) - free) / speed


FULL = Bounds(0.0, 1.0)  # possible levels of a battery


def decided(robot: Robot, holds: bool) -> Iterator[tuple[Asked, Span, list[Related]]]:
    """Yield the conditions on the running robot that always hold, or never do, with the place that decides them.

    A condition that only compares written values is left out: it chooses between settings.
    """
    measured = {*robot.values, POSE}
    full = dict.fromkeys(batteries(robot), FULL)
    for mission in robot.missions.values():
        known = {name: Bounds(value, value) for name, value in constants(mission).items() if isinstance(value, float)}
        for asked, scope in _conditions(robot, mission):
            is_measured = any(name.name in measured for name in asked.expression.names)
            is_open = is_measured and not check_condition(asked.expression, scope)
            if is_open and truth(asked.expression.tree, known | full) is holds:
                yield asked, *blamed(robot, mission, asked)


def _conditions(robot: Robot, mission: RobotMission) -> Iterator[tuple[Asked, NodeScope]]:
    program, names = mission.program, robot.names
    for view in views(program, names):
        yield from ((asked, view.scope) for asked in view.node.asked if asked.wanted == FLAG)
    base = base_scope(program, names)
    yield from ((interrupt.when, base) for interrupt in program.interrupts)


def blamed(robot: Robot, mission: RobotMission, asked: Asked) -> tuple[Span, list[Related]]:
    """Return the place that decides a condition: the one input that it reads, else the condition itself."""
    inputs = {name.name for name in asked.expression.names} & mission.program.inputs.keys()
    if len(inputs) != 1:
        return asked.scalar.span, []
    [name] = inputs
    default = mission.program.inputs[name].default
    path = ("missions", mission.name, "with", name)
    if at(robot.manifest.root, path) is not None:
        return robot.value(*path), [Related(asked.scalar.span, "the condition")]
    return (default.span if default else asked.scalar.span), [Related(asked.scalar.span, "the condition")]
