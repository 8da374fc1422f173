"""Arguments of the robot and of the instances of parts, and filling in references to them, each in its own scope."""

from collections.abc import Mapping
from dataclasses import replace

from rbxcompose.base.config import ARGUMENT
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import UNKNOWN
from rbxcompose.base.findings import Related, Report, Span, kind, nearest
from rbxcompose.compiler.composition.includes import PartInstance
from rbxcompose.compiler.composition.layers import Composed, only
from rbxcompose.compiler.composition.robot_manifest import ROBOT_LAYER, History, ScopedBounds, bounds_of, own_bounds
from rbxcompose.compiler.sections.args import args
from rbxcompose.manifest.arguments import DeclaredArgument
from rbxcompose.manifest.fill import Names, Typed, fill, with_arguments
from rbxcompose.manifest.registry import sections_in_use
from rbxcompose.manifest.section import ROBOT, Contents
from rbxcompose.manifest.tree import BROKEN, MappingNode
from rbxcompose.manifest.validate import UNKNOWN_KEY

NO_VALUE = kind("RBX1206")


@dataclass(frozen=True, slots=True)
class FilledScopes:
    """The robot's sections and its `include:` with every `${...}` filled in.

    `bounds` are those of arguments, by scope and name.
    """

    root: MappingNode
    include: MappingNode
    bounds: ScopedBounds


def fill_scopes(composed: Composed, names: Names) -> FilledScopes:
    """Fill in every `${...}` of a robot.

    The arguments' own values come first: those of the robot, then those of each instance, which are given in the scope
    of the file that includes it.
    """
    root, parts = composed.root, composed.parts
    report = parts.documents.report
    arguments = fill(only(root, args.name), names, report)
    declared = Contents(arguments, parts.robot, parts.documents).of(args)
    values = {name: _own_value(name, argument, composed.history, report) for name, argument in declared.items()}
    bounds = {"": {name: own_bounds(name, one, "the robot") for name, (one, _) in declared.items()}}
    whole = Contents(root, parts.robot, parts.documents, sections_in_use(ROBOT))
    may_have = (lambda name: whole.may_have(ARGUMENT, name)) if whole.stray or args.is_unreadable(root) else None
    names = with_arguments(names, values, "", may_have)
    include = fill(composed.include, names, report)
    for instance in reversed(composed.instances):  # an instance follows those that it includes
        declared = Contents(fill(instance.arguments, names, report), parts.robot, parts.documents).of(args)
        bounds[instance.name] = {
            name: own_bounds(name, one, f"the part '{instance.name}'") + bounds_of(instance.given.get(name), bounds)
            for name, (one, _) in declared.items()
        }
        may_have = (lambda name: True) if args.is_unreadable(instance.arguments) else None
        names = with_arguments(names, _given_values(instance, declared, names, report), instance.name, may_have)
    others = {name: entry for name, entry in root.entries.items() if name != args.name}
    running = {section.name: section.running for section in sections_in_use(ROBOT) if section.running}
    filled = {**arguments.entries, **fill(replace(root, entries=others), names, report, running=running).entries}
    return FilledScopes(replace(root, entries={name: filled[name] for name in root.entries}), include, bounds)


def _own_value(name: str, declared: tuple[DeclaredArgument | None, Span], history: History, report: Report) -> Typed:
    argument, span = declared
    if argument is None:
        return Typed(UNKNOWN, BROKEN)
    if argument.default is None:
        message = f"the argument '{name}' has no value"
        report.add(NO_VALUE.at(span, message, help=f"give it a 'default:', or --set args.{name}=VALUE"))
        return Typed(argument.type, BROKEN)
    is_given = history.layer(("args", name, "default")) != ROBOT_LAYER
    return Typed(argument.type, argument.read(argument.default, report), argument.default.span if is_given else None)


def _given_values(
    instance: PartInstance, declared: Mapping[str, tuple[DeclaredArgument | None, Span]], names: Names, report: Report
) -> dict[str, Typed]:
    """Return the values of a part's arguments: those given by `with:`, else their defaults."""
    given = fill(instance.given, names, report)
    for name, entry in given.entries.items():
        if name not in declared:
            message = f"part '{instance.name}' has no argument '{name}'"
            finding = UNKNOWN_KEY.misspelt(
                entry.key.span, message, name, declared, "its arguments", taken=given.entries
            )
            report.add(finding)
    unknown = given.entries.keys() - declared.keys()  # then any other argument may be what was meant
    meant = {near for name in unknown for near in nearest(name, declared)}
    values: dict[str, Typed] = {}
    for name, (argument, span) in declared.items():
        node = given.get(name) or (argument.default if argument else None)
        if argument is None:
            values[name] = Typed(UNKNOWN, BROKEN)
        elif (node is not None and unknown and name not in given) or (node is None and name in meant):
            values[name] = Typed(argument.type, BROKEN)
        elif node is None:
            message = f"part '{instance.name}' needs a value for its argument '{name}'"
            related = [Related(span, "declared here")]
            help_text = f"give it one: 'with: {{{name}: ...}}'"
            report.add(NO_VALUE.at(instance.span, message, help=help_text, related=related))
            values[name] = Typed(argument.type, BROKEN)
        else:
            values[name] = Typed(argument.type, argument.read(node, report), node.span if name in given else None)
    return values
