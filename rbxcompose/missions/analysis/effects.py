"""What nodes set, publish and call, by themselves or in their hooks."""

from collections.abc import Iterable, Iterator

from rbxcompose.base.findings import Itself, once
from rbxcompose.missions.language.asked import Assignment
from rbxcompose.missions.program.answers import Deeds, WrittenSetting
from rbxcompose.missions.program.machines import MessageTemplate
from rbxcompose.missions.program.program import MissionNode, Program


def assignments(node: MissionNode) -> Iterator[Assignment]:
    """Yield the assignments that a node makes."""
    yield from node.step.effects.assignments
    for deeds in _deeds(node):
        yield from deeds.assignments


def published(node: MissionNode) -> Iterator[MessageTemplate]:
    """Yield the messages that a node publishes."""
    if message := node.step.effects.published:
        yield message
    yield from (deeds.message for deeds in _deeds(node) if deeds.message)


def called(node: MissionNode) -> Iterator[MessageTemplate]:
    """Yield the request that a node makes."""
    if request := node.step.effects.called:
        yield request


def replaced(program: Program) -> frozenset[str]:
    """Return the names of all data that are assigned while a mission runs."""
    return program.saved.union(assignment.name for node in program.nodes for assignment in assignments(node))


def written(program: Program) -> frozenset[str]:
    """Return the names of all data that change while a mission runs, including those that only lose items."""
    return _written(Itself(program))


@once  # many rules ask
def _written(program: Itself[Program]) -> frozenset[str]:
    shortened = (node.step.effects.shortened for node in program.value.nodes)
    return replaced(program.value).union(name for name in shortened if name)


def sent_by(programs: Iterable[Program]) -> tuple[set[str], set[str]]:
    """Return the topics on which missions publish, and the services that they call, as they write them."""
    nodes = [node for program in programs for node in program.nodes]
    topics = {message.target.text for node in nodes for message in published(node)}
    services = {message.target.text for node in nodes for message in called(node)}
    return topics, services | {setting.service for setting in settings_of(nodes)}


def settings_of(nodes: Iterable[MissionNode]) -> list[WrittenSetting]:
    """Return the settings of components that nodes change."""
    return [setting for node in nodes if (setting := node.step.effects.setting) is not None]


def _deeds(node: MissionNode) -> Iterator[Deeds]:
    for modifier in node.modifiers.values():
        if modifier.moments:
            yield from modifier.moments.deeds.values()
