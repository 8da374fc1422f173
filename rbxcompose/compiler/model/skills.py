"""What missions can use of the robot: skills, topics to publish on, services to call."""

from collections.abc import Iterable, Mapping
from typing import Any

from rbxcompose.base.plugins import BrokenPluginError
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.compiler.model.robot import NOTHING, Outside, PortEnd, RobotComponent
from rbxcompose.missions.program.goals import service_skill, skill_of, topic_skill
from rbxcompose.missions.program.program import Program, Skill
from rbxcompose.missions.sources import Orders, OrderTopic, SkillSource, SkillWay, TopicSource
from rbxcompose.sdk.ports import In, Out, Qos, Serves, ServesAction, ServesTopic
from rbxcompose.sdk.skills import SkillType, skill_names, skill_type


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
    servers = [
        port_end
        for port_end in _ends(components)
        if isinstance(port_end.port, ServesTopic) and port_end.topic == end.topic
    ]
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
