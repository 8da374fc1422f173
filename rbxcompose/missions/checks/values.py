"""Values of the wrong type: arguments, fields of messages, inputs, conditions."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

from rbxcompose.base.expressions.check import check
from rbxcompose.base.expressions.tree import Number, Word, walk
from rbxcompose.base.expressions.types import (
    COUNT,
    PLACE,
    PLACED,
    STRUCTURED,
    TEXT,
    UNKNOWN,
    Type,
    TypeKind,
    choice_of,
    quantity_of,
)
from rbxcompose.base.findings import Finding, Related, Span, clauses, nearest, suggest
from rbxcompose.base.printable import plain
from rbxcompose.base.units import NUMBER, QUOTIENT, TIME, Dimension, example
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.analysis import facts
from rbxcompose.missions.analysis.examined import Ending, Examined, View, check_written, findings_of, mission_check
from rbxcompose.missions.analysis.facts import Constants
from rbxcompose.missions.codes import UNKNOWN_NAME, WRONG_INPUT, WRONG_TYPE
from rbxcompose.missions.engine.world import show
from rbxcompose.missions.language.literals import WrongValue, help_with_place, is_pose, nodes_of, typed
from rbxcompose.missions.program import parts
from rbxcompose.missions.program.outcomes import Outcomes
from rbxcompose.missions.program.program import Program, Skill
from rbxcompose.missions.program.registry import modifier_keys
from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import FieldShape, parse_type
from rbxcompose.msgs.fields import measure_of
from rbxcompose.msgs.types import Message


@mission_check("RBX4105", is_fixable=True)
def wrong_argument(mission: Examined) -> Iterator[Finding]:
    """Wrong, missing or unknown argument of a skill."""
    for view in mission.views:
        skill = mission.robot.skills.get(view.node.skill)
        if skill:
            if pose := _written_pose(skill, view.node.step.arguments):
                yield pose
                continue
            for argument in view.node.step.arguments:
                yield from _argument(view, skill, argument)
            yield from _missing(view, skill)


def _written_pose(skill: Skill, arguments: Collection[parts.WrittenArgument]) -> Finding | None:
    """Return the one finding about coordinates in the place of the argument that takes a place."""
    main = skill.arguments.get(skill.main)
    unknown = {argument.name: argument for argument in arguments if argument.name not in skill.arguments}
    if main is None or main.kind not in PLACED or len(unknown) != len(arguments) or not is_pose(unknown):
        return None
    message = f"the skill '{skill.name}' takes {main.phrase}, not its coordinates"
    first = next(iter(unknown.values()))
    help_text = help_with_place({name: argument.value for name, argument in unknown.items()})
    return wrong_argument.at(first.span, message, help=help_text)


def _missing(view: View, skill: Skill) -> Iterator[Finding]:
    given = {argument.name or skill.main for argument in view.node.step.arguments}
    if given - skill.arguments.keys():
        return  # the missing argument may be the misspelt one
    if skill.entries and not given & {*skill.entries.each, skill.main, skill.entries.instead}:
        first, measured = next(iter(skill.entries.each.items()))
        names = ", ".join(filter(None, (skill.main, skill.entries.instead, *skill.entries.each)))
        message = f"the skill '{skill.name}' needs at least one of {names}"
        yield wrong_argument.at(view.node.span, message, help=f"write '{first}: {example(measured)}' below it")
    for name in sorted(skill.required - given):
        message = f"the skill '{skill.name}' needs its argument '{name}'"
        help_text = f"write '{skill.name}: ...'" if name == skill.main else f"write '{name}: ...' below it"
        yield wrong_argument.at(view.node.span, message, help=help_text)


def _one_by_one(view: View, skill: Skill, value: TreeNode) -> str:
    """Return how to do it for each item of a list of words, names or quantities; nothing if that is not meant."""
    items = value.items if isinstance(value, SequenceNode) else ()
    words = [item.text for item in items if isinstance(item, ScalarNode) and item.text[:1] not in "+-.0123456789"]
    if not words or len(words) != len(items):
        return ""
    if len(words) == 1:
        return f"write '{skill.name}: {plain(words[0], 60)}', without brackets"
    shown = plain(", ".join(words), 60)
    return f"to do it for each: 'for: one', 'in: [{shown}]', 'do: {{{skill.name}: $one}}', each on a line of its own"


def _argument(view: View, skill: Skill, argument: parts.WrittenArgument) -> Iterator[Finding]:
    name = argument.name or skill.main
    if not name:
        message = f"the skill '{skill.name}' takes no single value"
        none = f"it has no arguments: write '{skill.name}:' with nothing behind it"
        help_text = suggest("", skill.arguments, "its arguments") or none
        yield wrong_argument.at(argument.span, message, help=help_text)
    elif name not in skill.arguments:
        message = f"the skill '{skill.name}' has no argument '{name}'"
        taken = {written_argument.name for written_argument in view.node.step.arguments}
        arguments = skill.arguments
        if name in modifier_keys() and not nearest(name, arguments):
            help_text = f"'{name}' is a setting of the step: move it left, into the column of '{skill.name}'"
            yield wrong_argument.at(argument.span, message, help=help_text)
            return
        finding = wrong_argument.misspelt(argument.span, message, name, arguments, "its arguments", taken=taken)
        is_only = len(taken - arguments.keys()) == 1  # else it is hardly the main argument that is meant
        if is_only and skill.main and not taken & {skill.main, ""} and not nearest(name, arguments):
            value = argument.value
            if not isinstance(value, ScalarNode):
                finding = replace(finding, help=clauses(finding.help, f"write '{skill.name}: ...'"))
            elif not any(check_written(view, value, skill.arguments[skill.main], wrong_argument)):
                finding = replace(finding, help=clauses(finding.help, f"write '{skill.name}: {plain(value.text, 60)}'"))
        yield finding
    elif isinstance(argument.value, ScalarNode):
        if argument.value.plain and not argument.value.text:
            yield wrong_argument.at(argument.span, f"the argument '{name}' of '{skill.name}' has no value")
        else:
            yield from check_written(view, argument.value, skill.arguments[name], wrong_argument)
    elif skill.arguments[name].kind in STRUCTURED:
        yield from _inside(argument.value, skill.arguments[name], f"the argument '{name}' of '{skill.name}'")
    else:
        message = f"the argument '{name}' of '{skill.name}' must be {skill.arguments[name].phrase}"
        help_text = _one_by_one(view, skill, argument.value)
        if not help_text and skill.arguments[name].kind in PLACED:
            help_text = help_with_place(nodes_of(argument.value))
        yield wrong_argument.at(argument.span, message, help=help_text)


def _inside(node: TreeNode, wanted: Type, what: str) -> Iterator[Finding]:
    """Yield what is wrong in a list or a map whose entries have types of their own."""
    if wanted.kind is TypeKind.LIST and isinstance(node, SequenceNode):
        for number, item in enumerate(node.items, 1):
            yield from _inside(item, wanted.entry, f"item {number} of {what}")
    elif wanted.parts and isinstance(node, MappingNode):
        for key, entry in node.entries.items():
            if key in wanted.parts:
                yield from _inside(entry.value, wanted.parts[key], f"'{key}' of {what}")
            else:
                message, taken = f"{what} has no entry '{key}'", node.entries
                yield wrong_argument.misspelt(entry.key.span, message, key, wanted.parts, "its entries", taken=taken)
    elif wanted != UNKNOWN:
        try:
            typed(node, wanted)
        except WrongValue as error:
            yield error.finding(wrong_argument, node.span, what)


FITTING = {  # the types of expressions that fit a field, by its ROS type; all others are numbers
    "bool": (TypeKind.FLAG,),
    "string": (TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE),
}
BYTES = ("uint8", "byte", "char")  # a text may be written for a list of them
NUMBERS = (TypeKind.QUANTITY, TypeKind.COUNT)


@mission_check("RBX4151", is_fixable=True)
def wrong_field(mission: Examined) -> Iterator[Finding]:
    """A message of a mission does not fit its type."""
    topics, services = mission.robot.topics, mission.robot.services
    for view in mission.views:
        for message in facts.published(view.node):
            if message.target.text in topics:
                yield from _check_body(view, message, registry.message(topics[message.target.text]))
        for message in facts.called(view.node):
            if message.target.text in services:
                yield from _check_body(view, message, registry.service(services[message.target.text]).Request)


def _check_body(view: View, message: parts.MessageTemplate, ros: type[Message]) -> Iterator[Finding]:
    body = message.body
    if body is None:
        return
    if isinstance(body, Mapping):
        yield from _check_fields(view, body, ros, message.keys)
    elif len(ros.FIELDS) == 1:
        yield from _check_value(view, body, next(iter(ros.FIELDS.values())), message.target.span)
    else:
        text = f"{ros.TYPE} has several fields: name them"
        help_text = f"they are {', '.join(ros.FIELDS)}" if ros.FIELDS else "it has no fields at all"
        yield wrong_field.at(_span_of(body) or message.target.span, text, help=help_text)


def _check_fields(
    view: View,
    body: Mapping[str, parts.TemplateShape],
    ros: type[Message],
    keys: Mapping[tuple[str, ...], Span],
    path: tuple[str, ...] = (),
    measured: Dimension | None = None,
) -> Iterator[Finding]:
    for name, shape in body.items():
        span = keys[(*path, name)]
        if name not in ros.FIELDS:
            text = f"{ros.TYPE} has no field '{name}'"
            yield wrong_field.misspelt(span, text, name, ros.FIELDS, "its fields", taken=body)
        elif isinstance(shape, Mapping) and "/" in parse_type(ros.FIELDS[name]).base:
            inner = registry.message(parse_type(ros.FIELDS[name]).base)
            below = measure_of(ros.TYPE, name) or measured
            yield from _check_fields(view, shape, inner, keys, (*path, name), below)
        else:
            found = list(_check_value(view, shape, ros.FIELDS[name], span))
            yield from found or _measured(view, shape, measure_of(ros.TYPE, name) or measured)


def _check_value(view: View, shape: parts.TemplateShape, ros_type: str, span: Span) -> Iterator[Finding]:
    field = parse_type(ros_type)
    if isinstance(shape, Mapping):
        yield wrong_field.at(span, f"a map does not fit the type {ros_type}")
    elif isinstance(shape, parts.WrittenValue) and (field.shape is FieldShape.SINGLE or field.base in BYTES):
        yield from _check_written(view, shape, field.base, ros_type)
    elif isinstance(shape, parts.WrittenValue):
        yield from _check_list(view, shape, ros_type)
    elif field.shape is FieldShape.SINGLE:
        yield wrong_field.at(_span_of(shape) or span, f"a list does not fit the type {ros_type}")
    else:
        for item in shape if not field.is_message else ():
            yield from _check_value(view, item, field.base, span)


def _measured(view: View, shape: parts.TemplateShape, wanted: Dimension | None) -> Iterator[Finding]:
    """Yield a finding if a value with a unit is no value of what a field measures."""
    if wanted is None or not isinstance(shape, parts.WrittenValue) or shape.expression is None:
        return
    given, _ = check(shape.expression, view.scope)
    if any(each.dimension not in (None, NUMBER, QUOTIENT, wanted) for each in given.each):
        message = f"this must be {wanted.phrase}; it is {given.phrase}"
        yield wrong_field.at(shape.scalar.span, message, help=f"write {wanted.phrase}, such as '{example(wanted)}'")


def _check_list(view: View, shape: parts.WrittenValue, ros_type: str) -> Iterator[Finding]:
    """Yield a finding if a single value is where a list must be; a name may refer to a list."""
    found = check(shape.expression, view.scope)[0].kind if shape.expression else TypeKind.TEXT
    if found not in (TypeKind.LIST, TypeKind.UNKNOWN):
        help_text = f"write '[{shape.scalar.text}]'"
        yield wrong_field.at(shape.scalar.span, f"this must be a list, {ros_type}", help=help_text)


def _check_written(view: View, shape: parts.WrittenValue, base: str, ros_type: str) -> Iterator[Finding]:
    if base == "string":
        yield from check_written(view, shape.scalar, TEXT, wrong_field)
    elif shape.expression is None:
        yield wrong_field.at(shape.scalar.span, f"'{shape.scalar.text}' is no value of the type {ros_type}")
    else:
        found = list(view.typed(shape.expression, UNKNOWN, shape.scalar, wrong_field))
        yield from found
        given, _ = check(shape.expression, view.scope)
        if not found and "/" in base and given.kind in (*NUMBERS, TypeKind.FLAG, TypeKind.TEXT, TypeKind.CHOICE):
            yield _no_message(shape, base)
        fitting = (*FITTING.get(base, NUMBERS), TypeKind.UNKNOWN)
        if not found and any(each.kind not in fitting for each in given.each) and "/" not in base:
            yield wrong_field.at(shape.scalar.span, f"this must be of the type {ros_type}; it is {given.phrase}")


def _no_message(shape: parts.WrittenValue, base: str) -> Finding:
    """Return the finding about a single value in the place of a message."""
    fields = registry.message(base).FIELDS
    first = next(iter(fields), "")
    help_text = f"write '{{{first}: {shape.scalar.text}}}'; its fields are {', '.join(fields)}" if first else ""
    return wrong_field.at(shape.scalar.span, f"this must be a {base}, not a single value", help=help_text)


def _span_of(shape: parts.TemplateShape) -> Span | None:
    """Return the span of a value, or of the first one in a list."""
    match shape:
        case parts.WrittenValue(scalar=scalar):
            return scalar.span
        case (first, *_):
            return _span_of(first)
    return None


@mission_check(WRONG_INPUT)
def wrong_input(mission: Examined) -> Iterator[Finding]:
    """Yield the inputs that the `with` of a `use` gets wrong or leaves out."""
    for view in mission.views:
        used = view.node.step.uses
        program = mission.robot.missions.get(used.text) if used else None
        is_read = all(argument.name for argument in view.node.step.arguments)
        if used and program and is_read:
            yield from _given(view, used.text, program)
            yield from _missing_input(view, used.text, program)


def _given(view: View, name: str, program: Program) -> Iterator[Finding]:
    inputs = program.inputs
    for argument in view.node.step.arguments:
        if argument.name not in inputs:
            message = f"the mission '{name}' has no input '{argument.name}'"
            yield WRONG_INPUT.misspelt(argument.span, message, argument.name, inputs, "its inputs")
        elif isinstance(argument.value, ScalarNode):
            yield from check_written(view, argument.value, inputs[argument.name].type, WRONG_INPUT)
        elif (wanted := inputs[argument.name].type) != UNKNOWN:
            try:
                typed(argument.value, wanted)
            except WrongValue as error:
                yield error.finding(WRONG_INPUT, argument.value.span, f"the input '{argument.name}'")


def _missing_input(view: View, mission: str, program: Program) -> Iterator[Finding]:
    given = {argument.name for argument in view.node.step.arguments}
    if given - program.inputs.keys():
        return  # the missing input may be the misspelt one
    for name, declared in program.inputs.items():
        if declared.must_be_given and name not in given:
            message = f"the input '{name}' of the mission '{mission}' needs a value"
            yield WRONG_INPUT.at(view.node.span, message, help=f"write it under 'with': '{name}: ...'")


LISTED = (TypeKind.LIST, TypeKind.MAP, TypeKind.UNKNOWN)


@mission_check(WRONG_TYPE)
def wrong_type(mission: Examined) -> Iterator[Finding]:
    """Yield the expressions that have the wrong type, or name something that does not exist."""
    known = facts.constants_of(mission.program, {})
    for view in mission.views:
        is_placed = _goes_to_places(view)
        for asked in view.node.asked:
            if not asked.is_assigned:
                is_word = asked.wanted == UNKNOWN and isinstance(asked.expression.tree, Word)
                wanted = PLACE if is_placed and is_word else asked.wanted
                found = list(view.typed(asked.expression, wanted, asked.scalar, WRONG_TYPE))
                yield from found or _negative(asked, known)
        for assignment in facts.assignments(view.node):
            yield from _assigned(view, assignment)
        yield from _not_listed(view)
        yield from _other_cases(view)
        yield from _outcomes(view, mission.ending)
    whole = [*(interrupt.when for interrupt in mission.program.interrupts), *mission.program.outputs.values()]
    for asked in whole:
        yield from findings_of(asked.expression, asked.wanted, asked.scalar, mission.scope, WRONG_TYPE)


def _negative(asked: parts.Asked, known: Constants) -> Iterator[Finding]:
    """Yield a finding if a duration or a count is surely negative: the step would always fail."""
    value = facts.number_of(asked.expression, known) if asked.wanted in (COUNT, quantity_of(TIME)) else None
    if value is not None and value < 0:
        message = f"this must be at least 0; it is {show(asked.wanted, value)}"
        yield WRONG_TYPE.at(
            asked.scalar.span, message, help="" if asked.expression.names else "write it without the sign"
        )


def _goes_to_places(view: View) -> bool:
    """Return whether a node is a loop that gives its item to a skill as a place."""
    node = view.node
    for below in view.program.nodes[node.number + 1 : node.end] if node.item else ():
        skill = view.robot.skills.get(below.skill)
        for argument in below.step.arguments if skill else ():
            wanted = skill.arguments.get(argument.name or skill.main) if skill else None
            is_item = isinstance(argument.value, ScalarNode) and argument.value.text == f"${node.item}"
            if is_item and wanted is not None and wanted.kind in PLACED:
                return True
    return False


def _assigned(view: View, assignment: parts.Assignment) -> Iterator[Finding]:
    """Yield a finding if a value does not fit its datum.

    A count accepts any number: `sum: 0` under `data` does not say that it stays whole. And a text accepts a place:
    `room: dock` is both a text and the name of a place. So do entries of lists and maps, by `accepts`.
    """
    asked, data = assignment.asked, view.program.data
    datum = data.get(assignment.name)
    wanted = datum.type if datum else UNKNOWN
    found, problems = check(asked.expression, view.scope)
    if wanted == TEXT and found == PLACE:
        wanted = PLACE
    if wanted == COUNT:
        wanted = quantity_of(NUMBER)
    for finding in view.typed(asked.expression, wanted, asked.scalar, WRONG_TYPE):
        if datum is None or finding.help or problems or finding.code != WRONG_TYPE.code:
            yield finding
            continue
        help_text = f"a datum keeps the type of its first value: give '{assignment.name}' one of this type under 'data'"
        yield replace(finding, help=help_text, related=(*finding.related, Related(datum.span, "its first value")))


def _not_listed(view: View) -> Iterator[Finding]:
    """Yield a finding if a loop iterates over something that is neither a list nor a map."""
    items = view.node.step.items
    if items is not None and not isinstance(items, tuple) and view.node.asked:
        found, _ = check(items, view.scope)
        if any(each.kind not in LISTED for each in found.each):
            message = f"'in' must be a list or a map; it is {found.phrase}"
            times = f"to do it {items.text} times, write 'repeat: {items.text}' instead of 'for' and 'in'"
            help_text = times if found == COUNT else "write a list: '[...]'"
            yield WRONG_TYPE.at(view.node.asked[0].scalar.span, message, help=help_text)


def _other_cases(view: View) -> Iterator[Finding]:
    """Yield the cases whose dimension differs from that of the value to choose by."""
    choice = view.node.step.choice
    if choice is None:
        return
    chosen, _ = check(choice.asked, view.scope)
    for case in choice.cases if chosen.kind in NUMBERS else ():
        tree = case.expression.tree
        if isinstance(tree, Number) and tree.dimension != chosen.measure:
            message = f"the case is {tree.dimension.phrase}; '{choice.asked.text}' is {chosen.phrase}"
            yield WRONG_TYPE.at(case.scalar.span, message)


def _outcomes(view: View, ending: Ending) -> Iterator[Finding]:
    """Yield the findings about the conditions over the branches of a parallel."""
    branches = view.node.step.branches
    if branches is None or not branches.outcomes:
        return
    names, branch_ends = dict(view.scope.names), ending.of_branches(view.node)
    for branch, ends in branch_ends.items():
        names[branch] = choice_of(*parts.RESULTS, *(word for word in ends.named if word not in parts.RESULTS))
    scope = replace(view.scope, names=names)
    for outcome in branches.outcomes:
        if asked := outcome.asked:
            found = list(findings_of(asked.expression, asked.wanted, asked.scalar, scope, WRONG_TYPE))
            unknown = [finding for finding in found if finding.code == UNKNOWN_NAME.code]
            others = (_with_results(finding, asked, branch_ends) for finding in found)
            yield from unknown or others  # the word compared with a misspelt branch would count as an unknown place


def _with_results(finding: Finding, asked: parts.Asked, ends: Mapping[str, Outcomes]) -> Finding:
    """Return a finding about a word that is no result, with the results of the branch that it is compared with."""
    for part, _ in walk(asked.expression.tree):
        branch, word = facts.compared_with_word(part) or ("", None)
        if word and branch in ends and finding.span == parts.inner_span(asked.scalar, word.start, word.end):
            results = ends[branch].words
            text = f"it ends with {' or '.join(results)}" if results else "it never ends"
            return replace(finding, message=f"the branch '{branch}' never ends with '{word.name}'", help=text)
    return finding
