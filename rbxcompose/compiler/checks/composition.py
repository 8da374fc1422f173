"""Rules about layers and parts of a robot."""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

from rbxcompose.base.findings import NAMES, WIRING, Finding, Related, Severity, suggest
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.composition.overlay import SET
from rbxcompose.compiler.composition.robot_manifest import About, Claim, HistoryStep, IncludedPart
from rbxcompose.compiler.model.robot import PortEnd, Robot, resolve
from rbxcompose.manifest.files import PREFIX
from rbxcompose.manifest.reader import REPLACE
from rbxcompose.manifest.tree import ScalarNode, SequenceNode, TreeNode, at
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Port, Serves, ServesAction, ServesTopic


@check("RBX7001", Severity.WARNING, closed=())
def idle_overlay(robot: Robot) -> Iterator[Finding]:
    """A profile or an overlay sets a value to what it already is."""
    for before, after, path in changes(robot):
        match before.node, after.node:
            case ScalarNode(text=old, plain=was_plain), ScalarNode(text=new, plain=is_plain):
                if (old, was_plain) == (new, is_plain):
                    yield idle_overlay.at(
                        after.span,
                        f"{after.layer} sets '{path}' to the value that it already has",
                        help="remove it, or write another value",
                        related=[Related(before.span, f"the same in {before.layer}")],
                    )


def changes(robot: Robot) -> Iterator[tuple[HistoryStep, HistoryStep, str]]:
    """Yield each value of a layer and the earlier value it replaces, with the path; `--set` may repeat values."""
    for path in robot.manifest.history.paths:
        for before, after in pairwise(robot.manifest.history.of(path)):
            if after.span.file != SET:
                yield before, after, ".".join(map(str, path))


WIRES: tuple[tuple[type[Port[Any]], type[Port[Any]]], ...] = ((Out, In), (Calls, Serves), (CallsAction, ServesAction))
"""The classes of the two ends of a wire."""


@check("RBX3021", closed=(WIRING, NAMES))
def part_needs(robot: Robot) -> Iterator[Finding]:
    """A part needs a topic that nothing else provides."""
    for part in robot.manifest.parts.values():
        for need in part.claims:
            if need.about is not About.NEED:
                continue
            others = [end for end in _at(robot, need.name) if end.instance not in own_instances(part)]
            fitting = [end for end in others if is_type(end, need.type)]
            answers = _answers(end for end in _at(robot, need.name) if end.instance in own_instances(part))
            if any(not answers or isinstance(end.port, answers) for end in fitting):
                continue
            wrong = next((end for end in others if end.type_name and end not in fitting), None)
            if wrong:
                yield part_needs.at(
                    need.span,
                    f"part '{part.name}' needs '{need.name}' as {short(need.type)}, and '{wrong.instance}' has it as "
                    f"{short(wrong.type_name)}",
                    help=f"write '{short(wrong.type_name)}', or connect the part to another topic with 'connect:'",
                )
                continue
            yield part_needs.at(
                part.span,
                f"part '{part.name}' needs '{need.name}' ({short(need.type)}) from outside, and nothing has it",
                help=f"include a part with '{need.name}', or connect it to the right topic with 'connect:'",
                related=[Related(need.span, "needed here")],
                about=(part.name, need.name),
            )


def own_instances(part: IncludedPart) -> frozenset[str]:
    """Return all instances that a part brought, including muxes: a mux that it feeds is its own end of the wire."""
    return part.components | part.muxes


def is_type(end: PortEnd, written: str) -> bool:
    """Return whether an end has the type written in a part: `geometry_msgs/Twist`."""
    return short(end.type_name) == short(written)


def short(type_name: str) -> str:
    """Return the short form of a type: `geometry_msgs/msg/Twist` without its middle."""
    package, _, name = type_name.partition("/")
    return f"{package}/{name.rpartition('/')[-1]}"


def _at(robot: Robot, topic: str) -> list[PortEnd]:
    absolute = resolve(topic, robot.manifest.bus.namespace or "")
    return [end for end in robot.ends if end.topic == absolute]


def _answers(own: Iterable[PortEnd]) -> tuple[type[Port[Any]], ...]:
    """Return the types of ports that may be at the other end of the wires of `own`."""
    pairs = [*WIRES, *(wire[::-1] for wire in WIRES)]
    return tuple({other for end in own for cls, other in pairs if isinstance(end.port, cls)})


@check("RBX7002", Severity.WARNING, closed=())
def shortened_list(robot: Robot) -> Iterator[Finding]:
    """A profile or an overlay adds to a list and drops its old items."""
    for before, after, path in changes(robot):
        if words := lost(before.node, after.node):
            yield shortened_list.at(
                after.span,
                f"{after.layer} replaces the list '{path}' and drops {', '.join(map(repr, words))}",
                help="write the whole list, or '!replace' before it if you mean it",
                related=[Related(before.span, f"the list in {before.layer}")],
            )


def dropped(robot: Robot) -> set[str]:
    """Return all words that lists lose in this way."""
    return {word for before, after, _ in changes(robot) for word in lost(before.node, after.node)}


def taken_out(robot: Robot) -> dict[str, HistoryStep]:
    """Return all words that lists lose, each with the list that lacks it."""
    found: dict[str, HistoryStep] = {}
    for before, after, _ in changes(robot):
        if isinstance(after.node, SequenceNode):
            new = _words(after.node)
            found |= {word: after for word in _words(before.node) if word not in new}
    return found


def lost(before: TreeNode | None, after: TreeNode | None) -> list[str]:
    """Return the words missing from a new list that also adds some and is not marked `!replace`."""
    if not isinstance(after, SequenceNode) or after.tag == REPLACE:
        return []
    old, new = _words(before), _words(after)
    return [word for word in old if word not in new] if new.keys() - old.keys() else []


def _words(node: TreeNode | None) -> dict[str, None]:
    items = node.items if isinstance(node, SequenceNode) else ()
    return dict.fromkeys(item.text for item in items if isinstance(item, ScalarNode))


@check("RBX3022", closed=(WIRING, NAMES, "values"))
def part_provides(robot: Robot) -> Iterator[Finding]:
    """A part lacks something that it says it provides."""
    for part in robot.manifest.parts.values():
        ends = [end for name in own_instances(part) & robot.components.keys() for end in robot.components[name].ends]
        if (part.components & robot.written) - robot.components.keys():
            continue  # one of its components has mistakes, which are reported at their own places
        for claim in part.claims:
            if claim.about is not About.NEED and (what := _lacking(robot, claim, ends)):
                message = f"part '{part.name}' does not have {what}, which it says it provides"
                about = (part.name, claim.name)
                is_own = part.components <= robot.components.keys() and not claim.span.file.startswith(PREFIX)
                if not is_own:  # something of it was removed or changed
                    related = [Related(claim.span, "promised here")]
                    yield part_provides.at(part.span, message, related=related, about=about)
                    continue
                known = [end.skill for end in ends if _serves(end, end.skill)] if claim.about is About.SKILL else []
                help_text = suggest(claim.name, known, "its skills")
                yield part_provides.at(claim.span, message, help=help_text, about=about)


def _serves(end: PortEnd, skill: str) -> bool:
    return isinstance(end.port, Serves | ServesAction | ServesTopic) and end.skill == skill


def _lacking(robot: Robot, claim: Claim, ends: list[PortEnd]) -> str:
    """Return what a part promises but lacks, in words; empty if it keeps its promise."""
    match claim.about:
        case About.VALUE if at(robot.manifest.root, ("values", claim.name)) is None:
            return f"the value '{claim.name}'"
        case About.SKILL if claim.name not in robot.skills or not any(_serves(end, claim.name) for end in ends):
            return f"the skill '{claim.name}'"
        case About.PORT:
            topic = resolve(claim.name, robot.manifest.bus.namespace or "")
            if not any(end.topic == topic and is_type(end, claim.type) for end in ends):
                return f"the topic '{claim.name}' ({short(claim.type)})"
    return ""
