"""Reads `events`: what happens to the robot from outside."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Span
from rbxcompose.manifest import test_file as trials
from rbxcompose.manifest.tree import KeyPath, SequenceNode, TreeNode, at, key_span, value_span
from rbxcompose.manifest.validate import to_plain
from rbxcompose.mission_tests import codes
from rbxcompose.mission_tests.fault_reader import FAULT, read_fault
from rbxcompose.mission_tests.model import EventDeed, TrialEvent
from rbxcompose.mission_tests.sections import TrialContext, entries_of
from rbxcompose.model.wires import resolve
from rbxcompose.msgs import registry
from rbxcompose.msgs.plain import from_plain

AT, SET, PUBLISH = "at", "set", "publish"


def read_events(
    context: TrialContext, node: TreeNode | None, models: Sequence[trials.EventModel]
) -> tuple[TrialEvent, ...]:
    """Return the events in the order of the text."""
    items = node.items if isinstance(node, SequenceNode) else ()
    return tuple(_event(context, item, model) for item, model in zip(items, models, strict=False))


def _event(context: TrialContext, node: TreeNode, model: trials.EventModel) -> TrialEvent:
    words = [word for word, _ in entries_of(node) if word != AT]
    if not words:
        context.report.add(codes.NEVER.at(node.span, "nothing happens here", help="give 'set', 'publish', 'stop', ..."))
    deeds = (_deed(context, word, node, model) for word in words)
    return TrialEvent(model.at, tuple(deed for deed in deeds if deed), value_span(node, (AT,)))


def _deed(context: TrialContext, word: str, node: TreeNode, model: trials.EventModel) -> EventDeed | None:
    if word == SET:
        return EventDeed(SET, context.settings(at(node, (SET,)), {}))
    if word == PUBLISH and model.publish:
        return _published(context, node, model.publish)
    if word == FAULT and model.fault:
        return read_fault(context, node, model.fault)
    return EventDeed(word)


def _published(context: TrialContext, node: TreeNode, sent: trials.SentModel) -> EventDeed | None:
    """Return a message for a topic that has a publisher or subscriber."""
    topics, topic = _topics(context), resolve(sent.topic, context.robot.manifest.bus.namespace or "")
    if topic not in topics:
        message = f"no component has the topic '{sent.topic}'"
        span, known = value_span(node, (PUBLISH, "topic")), [name.removeprefix("/") for name in topics]
        context.report.add(codes.UNKNOWN.misspelt(span, message, sent.topic, known, "topics of this robot"))
        return None
    cls, place = registry.message(topics[topic]), (PUBLISH, "message")
    written = at(node, place)
    data = {} if written is None else to_plain(written)
    if not isinstance(data, dict):
        data = {next(iter(cls.FIELDS)): data}
    made, findings = from_plain(cls, data, MessagePlaces(node, place))
    context.report.extend(findings)
    return EventDeed(PUBLISH, topic=topic, message=made) if made is not None else None


def _topics(context: TrialContext) -> dict[str, str]:
    """Return the absolute names of topics with their types: those of components, and those of values."""
    namespace = context.robot.manifest.bus.namespace or ""
    own = {resolve(name, namespace): message for name, message in context.names.topics.items()}
    return {**own, **{source.topic: source.message for source in context.robot.values.values()}}


@dataclass(frozen=True, slots=True)
class MessagePlaces:
    """The places of the parts of a message."""

    node: TreeNode
    below: KeyPath

    def key(self, path: KeyPath) -> Span:
        """Return the place of a field's name."""
        return key_span(self.node, (*self.below, *path))

    def value(self, path: KeyPath) -> Span:
        """Return the place of a field's value."""
        return value_span(self.node, (*self.below, *path))
