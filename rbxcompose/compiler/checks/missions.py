"""Rules about missions and triggers."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path

from rbxcompose.base.config import MISSION as MISSION_NAME
from rbxcompose.base.expressions import tree as syntax
from rbxcompose.base.expressions.types import FLAG, PLACED
from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import MISSIONS, OWN, WIRING, Finding, Related, Severity, Span, suggest
from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.compiler.check_runner import check
from rbxcompose.compiler.composition.robot_file import MISSION
from rbxcompose.compiler.model.robot import Robot, RobotMission
from rbxcompose.compiler.model.skills import constants, decided, ways_of
from rbxcompose.compiler.model.values import is_type, message_of
from rbxcompose.compiler.sections.missions import CAUSES, TriggerModel, triggers
from rbxcompose.manifest.files import files_named
from rbxcompose.manifest.reader import read_file
from rbxcompose.manifest.tree import MappingNode, ScalarNode, SequenceNode, at
from rbxcompose.missions.analysis.examined import Examined, claims_of
from rbxcompose.missions.analysis.facts import Bounds, Known, place_in_text, places_taken, shortened, texts_in, truth
from rbxcompose.missions.analysis.travel_times import too_short
from rbxcompose.missions.program.outcomes import FAILS, SUCCEEDS
from rbxcompose.missions.program.parts import expression_of, inner_span
from rbxcompose.missions.program.program import END, Interrupt, Program
from rbxcompose.missions.triggers.trigger import HALTED, INTERRUPT


@check("RBX4123", Severity.WARNING, closed=(MISSIONS,))
def always_holds(robot: Robot) -> Iterator[Finding]:
    """A condition always holds."""
    for asked, span, related in decided(robot, True):
        message = f"the condition '{asked.expression.text}' always holds"
        yield always_holds.at(span, message, help="compare with a level that makes a difference", related=related)


@check("RBX4122", closed=(OWN,))
def never_holds(robot: Robot) -> Iterator[Finding]:
    """A condition can never hold."""
    for asked, span, related in decided(robot, False):
        message = f"the condition '{asked.expression.text}' can never hold"
        yield never_holds.at(span, message, help=_cure(asked.expression), related=related)


def _cure(expression: syntax.Expression) -> str:
    tree = expression.tree
    is_contrary = isinstance(tree, syntax.Junction) and all(truth(operand, {}) is None for operand in tree.operands)
    contrary = "its parts contradict each other: join them by 'or', or change a limit"
    return contrary if is_contrary else "compare with a level that can be reached"


@check("RBX4132", Severity.WARNING, closed=(MISSIONS,))
def beyond_list(robot: Robot) -> Iterator[Finding]:
    """A list item that does not exist."""
    for mission in robot.missions.values():
        known = constants(mission)
        for scalar, expression in _expressions(mission.program):
            parts = [part for part, _ in syntax.walk(expression.tree)]
            if any(isinstance(part, syntax.FunctionCall) and part.function == "count" for part in parts):
                continue  # the expression checks how long the list is before it takes the item
            for tree in parts:
                match tree:
                    case syntax.Index(of=syntax.Variable(name=name), index=syntax.Number(value=index)):
                        items, datum = known.get(name), mission.program.data.get(name)
                        if datum and isinstance(items, list | tuple) and index >= len(items):
                            yield beyond_list.at(
                                inner_span(scalar, tree.start, tree.end),
                                f"'${name}' has no item {index:.0f}: "
                                + (f"its last is {len(items) - 1}" if items else "it is empty"),
                                help="items are counted from 0",
                                related=[Related(datum.span, "the list")],
                            )


def _expressions(program: Program) -> Iterator[tuple[ScalarNode, syntax.Expression]]:
    """Yield all expressions of a mission, the arguments of its skills included."""
    yield from ((asked.scalar, asked.expression) for _, asked in program.asked())
    for node in program.nodes:
        for argument in node.step.arguments:
            if isinstance(argument.value, ScalarNode):
                try:
                    yield argument.value, expression_of(argument.value)
                except syntax.ExpressionError:
                    continue  # reported where missions are read


@check("RBX4131", closed=("places",))
def place_in_data(robot: Robot) -> Iterator[Finding]:
    """The data or inputs of a mission name a place that the robot does not know."""
    places = robot.manifest.places
    for mission in robot.missions.values():
        program, known = mission.program, {**shortened(mission.program), **constants(mission)}
        defaults = {name for name, one in program.inputs.items() if one.type.kind not in PLACED}
        names = program.data.keys() | mission.given.keys() | defaults
        wrong = {name: _without(value, places) for name, value in known.items() if name in names}
        for node, name, datum in places_taken(program, robot.names.skills):
            for text in wrong.get(datum, ()):
                yield place_in_data.at(
                    mission.given[datum] if datum in mission.given else _place_of(program, datum, text),
                    f"there is no place '{text}', which '{node.skill}' gets from '${name}'",
                    help=suggest(text, places, "places of this robot"),
                    related=[Related(node.span, "used here")],
                    about=(text, node.skill),
                )


def _without(value: Value, places: Collection[str]) -> list[str]:
    """Return the texts of a datum that are no places: a list is read once, however many loops are over it."""
    return [text for text in texts_in(value) if text not in places]


def _place_of(program: Program, datum: str, text: str) -> Span:
    """Return the place of a text in a datum or a default, or that of its name if the text is not found."""
    declared = program.data.get(datum) or program.inputs[datum]
    path = ("data", datum) if datum in program.data else ("inputs", datum, "default")
    match at(program.root, path):
        case MappingNode(entries=entries) if text in entries:
            return entries[text].key.span
        case SequenceNode(items=items):
            spans = (item.span for item in items if isinstance(item, ScalarNode) and item.text == text)
            return next(spans, declared.span)
        case ScalarNode(span=span):
            return span
    return declared.span


_ITS_OWN = ("new", "age")  # their answers depend on when the interrupt acted last


@check("RBX4184", Severity.WARNING, closed=())
def shadowed_interrupt(robot: Robot) -> Iterator[Finding]:
    """An interrupt cannot cut in, because an earlier one always does first."""
    for mission in robot.missions.values():
        known = bounds_of(mission)
        for index, later in enumerate(mission.program.interrupts):
            for earlier in mission.program.interrupts[:index]:
                if _keeps_out(robot, mission.program, earlier, later, known):
                    acts = "never acts" if earlier.afterwards == END else "waits until its reaction is done"
                    yield shadowed_interrupt.at(
                        later.when.scalar.span,
                        f"'{earlier.name}' comes first and holds whenever this does, so '{later.name}' {acts}",
                        help=f"put '{later.name}' before '{earlier.name}': the first one that holds wins",
                        related=[Related(earlier.when.scalar.span, "it holds as well")],
                    )
                    break


def bounds_of(mission: RobotMission) -> Known:
    """Return the bounds of the numbers of a mission that nothing changes."""
    numbers = {name: value for name, value in constants(mission).items() if isinstance(value, float)}
    return {name: Bounds(value, value) for name, value in numbers.items()}


def _keeps_out(robot: Robot, program: Program, earlier: Interrupt, later: Interrupt, known: Known) -> bool:
    expression, other = earlier.when.expression, later.when.expression
    if expression.text == other.text or _is_its_own(robot, expression) or _is_its_own(robot, other):
        return False  # RBX4171 tells two equal ones
    if truth(expression.tree, known) is not None or truth(other.tree, known) is not None:
        return False  # decided by itself, which others tell
    takes_time = earlier.root is not None and any(below.step.waits for below in program.below(earlier.root))
    return (takes_time or earlier.afterwards == END) and implies(other, expression, known)


def _is_its_own(robot: Robot, expression: syntax.Expression) -> bool:
    calls = (part for part, _ in syntax.walk(expression.tree) if isinstance(part, syntax.FunctionCall))
    names = {name.name for name in expression.names}
    return any(call.function in _ITS_OWN for call in calls) or bool(names & robot.names.events)


def implies(narrow: syntax.Expression, wide: syntax.Expression, known: Known) -> bool:
    """Return whether one condition surely holds whenever another one does."""
    all_of, any_of = _parts(narrow.tree, "and"), _parts(wide.tree, "or")
    if {narrow.text[node.start : node.end] for node in all_of} & {wide.text[node.start : node.end] for node in any_of}:
        return True
    start, end = narrow.tree.start, narrow.tree.end
    return truth(syntax.Junction(start, end, "and", (*all_of, syntax.Not(start, end, wide.tree))), known) is False


def _parts(tree: syntax.ExpressionNode, operator: str) -> tuple[syntax.ExpressionNode, ...]:
    return tree.operands if isinstance(tree, syntax.Junction) and tree.operator == operator else (tree,)


@check("RBX4181", Severity.WARNING, closed=(WIRING,))
def stale_event(robot: Robot) -> Iterator[Finding]:
    """An old message would end a wait at once."""
    doubtful = [name for name in robot.values if _may_be_stale(robot, name)]
    for mission in robot.missions.values() if doubtful else ():
        own = {*mission.program.data, *mission.program.inputs}
        for node in mission.program.nodes:
            for asked in node.asked if node.step.only_asks else ():
                wanted = _wanted(asked.expression) if asked.is_watched else ()
                for name in (name for name in wanted if name in doubtful and name not in own):
                    doubtful.remove(name)
                    place = Related(robot.key("values", name), "the value")
                    message = f"the last message of '${name}' ends this wait, however old it is"
                    help_text = f"write 'event: true' at the value '{name}', or 'event: false' if it reports a state"
                    yield stale_event.at(asked.scalar.span, message, help=help_text, related=[place])


def _may_be_stale(robot: Robot, name: str) -> bool:
    """Return whether a value is a flag from outside whose nature is not told."""
    entry, source = robot.manifest.values[name], robot.values[name]
    is_outside = entry.topic is not None and source.topic not in robot.writers
    return is_outside and source.type == FLAG and entry.event is None


def _wanted(condition: syntax.Expression) -> list[str]:
    """Return the flags whose last messages may make a condition hold."""
    tree, fresh = condition.tree, syntax.new_names(condition)
    operands = tree.operands if isinstance(tree, syntax.Junction) else (tree,)
    return [operand.name for operand in operands if isinstance(operand, syntax.Variable) and operand.name not in fresh]


_ENDING = ".yaml"


@check("RBX3009", is_fixable=True)
def start_mission(robot: Robot) -> Iterator[Finding]:
    """`start:` names a mission that the robot does not have."""
    start = robot.manifest.start
    if start is None or start in robot.manifest.missions or robot.manifest.contents.may_have(MISSION_NAME, start):
        return
    place = robot.value("start")
    message = f"the robot has no mission '{start}' to start"
    if files := _files((place, robot.value("name")), start):
        help_text = f"add '{start}: {files[0]}' below 'missions:'"
        yield start_mission.at(place, message, help=help_text, about=[start])
        return
    yield start_mission.misspelt(place, message, start, robot.manifest.missions, "missions of this robot")


def _files(places: Iterable[Span], start: str) -> list[str]:
    """Return the project's mission files of this name, as the first existing file of `places` has to write them."""
    # `--set` and the library have no file.
    writer = next((path for place in places if (path := Path(place.file)).is_file()), None)
    found = files_named(f"{start}{_ENDING}", writer) if writer else []
    return [text for text in found if writer and _is_mission(writer.resolve().parent / text)]


def _is_mission(file: Path) -> bool:
    root, _ = read_file(file, str(file), {})
    written = root.get("kind") if isinstance(root, MappingNode) else None
    return isinstance(written, ScalarNode) and written.text == MISSION


@check("RBX4129", Severity.WARNING, closed=(OWN,))
def unread_name(robot: Robot) -> Iterator[Finding]:
    """A mission never reads one of its inputs or data."""
    seen = set()
    for mission in robot.missions.values():
        program = mission.program
        if program.file in seen:
            continue  # shares its file with another mission
        seen.add(program.file)
        read = program.reads
        for node in program.nodes:
            kept = node.saved
            if kept and kept.text not in read:
                message = f"the mission '{program.name}' never reads what it keeps as '{kept.text}'"
                help_text = f"remove 'save', or write '${kept.text}' where it belongs"
                yield unread_name.at(kept.span, message, help=help_text)
        for what, names in (("input", program.inputs), ("datum", program.data)):
            for name in names:
                if name not in read:
                    yield unread_name.at(
                        names[name].span,
                        f"the mission '{program.name}' never reads its {what} '{name}'",
                        help=f"remove it, or write '${name}' where it belongs",
                    )


@check("RBX4168", Severity.WARNING)
def hurried_rounds(robot: Robot) -> Iterator[Finding]:
    """The rounds of a loop take longer than the time between their starts."""
    for mission in robot.missions.values():
        if (ways := ways_of(robot, mission)) is None:
            continue
        list(too_short(ways, constants(mission)))  # consumed for its side effect: it walks the whole mission
        for one in ways.late.values():
            takes, given = (format_quantity(round(time, 2), TIME) for time in (one.needs, one.given))
            yield hurried_rounds.at(
                place_in_text(one.node, one.node.step.lasts),
                f"each round takes at least {takes}, but one is to begin every {given}",
                help=f"make it longer than {takes}, or remove it",
            )


def _all(robot: Robot) -> Mapping[str, TriggerModel]:
    return robot.manifest.contents.of(triggers)


def _place(robot: Robot, name: str, model: TriggerModel) -> Span:
    """Return the place of the cause of a trigger."""
    return robot.value("triggers", name, next(key for key in CAUSES if getattr(model, key) is not None))


@check("RBX4191", is_fixable=True)
def missing_mission(robot: Robot) -> Iterator[Finding]:
    """A trigger names a mission that the robot does not have."""
    names = robot.manifest.missions
    for name, model in _all(robot).items():
        for key, mission in (("mission", model.mission), ("ends", model.ends)):
            if mission and mission not in names and not robot.manifest.contents.may_have("mission", mission):
                place, message = robot.value("triggers", name, key), f"the robot has no mission '{mission}'"
                yield missing_mission.misspelt(place, message, mission, names, "missions of this robot")


@check("RBX4192")
def never_comes(robot: Robot) -> Iterator[Finding]:
    """The time of a trigger never comes."""
    for name, model in _all(robot).items():
        if model.schedule and not model.schedule.comes:
            message = f"'{model.cron}' never comes: none of its months has such a day"
            yield never_comes.at(_place(robot, name, model), message, help="change the day of the month, or the month")


@check("RBX4193", closed=(WIRING,))
def unknown_message(robot: Robot) -> Iterator[Finding]:
    """The type of the messages that start a mission is not known."""
    for name, model in _all(robot).items():
        if not model.message:
            continue
        if model.type is None and not message_of(robot, model):
            message = f"no component has the topic '{model.message}', so the type of its messages is not known"
            help_text = "write the type beside it, such as 'type: std_msgs/Empty'"
            yield unknown_message.at(_place(robot, name, model), message, help=help_text, about=[model.message])
        elif model.type and not is_type(model.type):
            place, message = robot.value("triggers", name, "type"), f"there is no type of messages '{model.type}'"
            yield unknown_message.at(place, message, help="'rbxcompose msg ls' lists those that there are")


@check("RBX4194", is_fixable=True, closed=(MISSIONS,))
def unknown_outcome(robot: Robot) -> Iterator[Finding]:
    """A trigger waits for an end that its mission does not have."""
    for name, model in _all(robot).items():
        if model.outcome is None or model.ends is None or model.ends not in robot.missions:
            continue
        program = robot.missions[model.ends].program
        own = Examined(program, robot.names).ending.of(program.main).named
        known = [SUCCEEDS, FAILS, HALTED, *own]
        if model.outcome not in known:
            place = robot.value("triggers", name, "outcome")
            message = f"the mission '{model.ends}' has no end '{model.outcome}'"
            yield unknown_outcome.misspelt(place, message, model.outcome, known, "its ends")


@check("RBX4195", closed=(MISSIONS,))
def rival_triggers(robot: Robot) -> Iterator[Finding]:
    """Two triggers of the same priority start missions at the same time, and each interrupts the other."""
    found = [(name, one) for name, one in _all(robot).items() if one.running == INTERRUPT]
    for index, (name, later) in enumerate(found):
        for other, earlier in found[:index]:
            if later.priority == earlier.priority and _coincide(earlier, later) and _clash(robot, earlier, later):
                message = f"'{name}' comes at the same time as '{other}', with the same priority, and ends its mission"
                yield rival_triggers.at(
                    _place(robot, name, later),
                    message,
                    help="give them different priorities: the higher one starts",
                    related=[Related(_place(robot, other, earlier), f"'{other}' comes here")],
                )
                break


def _coincide(one: TriggerModel, other: TriggerModel) -> bool:
    if one.schedule and other.schedule:
        return one.schedule.meets(other.schedule)
    causes = ("when", "message", "at_start", "ends")
    is_same = any(getattr(one, key) and getattr(one, key) == getattr(other, key) for key in causes)
    return is_same and (one.outcome == other.outcome or None in (one.outcome, other.outcome))


def _clash(robot: Robot, one: TriggerModel, other: TriggerModel) -> bool:
    """Return whether the missions are two that cannot run beside each other."""
    names = {one.mission, other.mission} & robot.missions.keys()
    claims = [claims_of(robot.missions[name].program, robot.names) for name in names]
    return len(claims) == len((one, other)) and bool(claims[0] & claims[1])


@check("RBX4196", Severity.WARNING, closed=(MISSIONS,))
def endless_triggers(robot: Robot) -> Iterator[Finding]:
    """The end of a mission starts it again, for ever."""
    leads: dict[str, list[tuple[str, str]]] = {}  # by mission: the triggers that its end fires, and their missions
    for name, model in _all(robot).items():
        if model.ends and model.outcome != HALTED:
            leads.setdefault(model.ends, []).append((name, model.mission))
    told: set[str] = set()
    for mission in leads:
        way = _way_back(mission, leads)
        if way and told.isdisjoint(way):
            told.update(way)
            first, rest = way[0], [Related(robot.key("triggers", name), "and this one") for name in way[1:]]
            message = f"whenever the mission '{mission}' ends, it starts again: this never stops by itself"
            yield endless_triggers.at(
                robot.value("triggers", first, "ends"),
                message,
                help="say which end counts, by 'outcome', or write 'repeat: forever' in one mission",
                related=rest,
            )


def _way_back(goal: str, leads: Mapping[str, list[tuple[str, str]]]) -> tuple[str, ...]:
    """Return the fewest triggers by which the end of a mission leads to its start; nothing if none do."""
    ways: dict[str, tuple[str, ...]] = {goal: ()}
    for mission in (found := [goal]):
        for name, following in leads.get(mission, ()):
            if following == goal:
                return (*ways[mission], name)
            if following not in ways:
                ways[following] = (*ways[mission], name)
                found.append(following)
    return ()


@check("RBX4197")
def two_starts(robot: Robot) -> Iterator[Finding]:
    """`start:` runs a mission while a trigger starts another one."""
    for name, model in _all(robot).items():
        if model.at_start and robot.manifest.start is not None:
            start = robot.manifest.start
            yield two_starts.at(
                robot.key("triggers", name, "at_start"),
                f"'start' runs the mission '{start}' at the same time",
                help=f"remove 'start: {start}', or let this one follow it: 'ends: {start}'",
                related=[Related(robot.value("start"), "the mission that starts, too")],
            )
