"""A mission on a robot as the checks in `missions/checks` see it: scopes, how nodes end, claims; runs the checks."""

import importlib
import pkgutil
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import field, replace
from functools import cache, cached_property
from itertools import takewhile

from rbxcompose.base.config import VALUE
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.check import ExpressionProblem, check_value
from rbxcompose.base.expressions.text import TextSlot, parse_template, refuse_foreign
from rbxcompose.base.expressions.tree import Expression, ExpressionError, Word
from rbxcompose.base.expressions.types import PLACE, POSE, TEXT, UNKNOWN, Type, TypeKind, map_of
from rbxcompose.base.findings import (
    Finding,
    FindingKind,
    Rule,
    Severity,
    Span,
    belonging,
    declared,
    nearest,
    replacement,
)
from rbxcompose.base.units import TIME, minutes_help
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions import checks as package
from rbxcompose.missions import codes
from rbxcompose.missions.analysis.facts import Constants, constants_of
from rbxcompose.missions.engine.world import POSE as POSE_NAME
from rbxcompose.missions.program.outcomes import ALWAYS_SUCCEEDS, ANY, FAILS, SUCCEEDS, Outcomes
from rbxcompose.missions.program.parts import MachineStates, expression_of, inner_span
from rbxcompose.missions.program.program import END, MissionNode, Program, RobotNames

_PLACELESS = (TypeKind.QUANTITY, TypeKind.COUNT, TypeKind.FLAG, TypeKind.STEP)  # types that no place can have


@dataclass(frozen=True, slots=True)
class NodeScope:
    """The names that expressions of a node may use, with their types (a scope for static checks)."""

    names: Mapping[str, Type]
    places: Iterable[str]
    removed: Mapping[str, Span] = field(default_factory=dict)  # removed places, each with what removed it
    may_have: Callable[[str], bool] = lambda name: False  # whether a name may exist that could not be read
    items: Container[str] = ()  # items of loops anywhere in the mission

    def variable(self, name: str) -> Type | None:
        """Return the type of `$name`, if there is one."""
        return self.names.get(name) or (UNKNOWN if self.may_have(name) else None)

    def word(self, name: str) -> Type | None:
        """Return the type of a bare word, if it is a place."""
        return PLACE if name in self.places else None

    def variables(self) -> Iterable[str]:
        """Return all names."""
        return self.names

    def words(self) -> Iterable[str]:
        """Return the names of all places."""
        return self.places


@dataclass(frozen=True, slots=True)
class View:
    """A node as its checks see it."""

    program: Program
    robot: RobotNames
    node: MissionNode
    scope: NodeScope

    @property
    def waits(self) -> bool:
        """Return whether the node, or any below it, takes time by itself."""
        return any(below.step.waits for below in self.program.below(self.node.number))

    def typed(self, expression: Expression, wanted: Type, scalar: ScalarNode, kind: FindingKind) -> Iterator[Finding]:
        """Yield the findings about an expression that must have the type `wanted`."""
        return findings_of(expression, wanted, scalar, self.scope, kind)


def _named_twice(program: Program, robot: RobotNames) -> set[str]:
    """Return the names that the mission gives to something of another type than what the robot has under it."""
    of_robot = {**robot.values, POSE_NAME: POSE}
    own = {name: input_.type for name, input_ in program.inputs.items()}
    own |= {name: datum.type for name, datum in program.data.items()}
    return {name for name, found in own.items() if name in of_robot and found != of_robot[name]}


def base_names(program: Program, robot: RobotNames) -> dict[str, Type]:
    """Return the names in scope throughout a mission, with their types."""
    data = {name: datum.type for name, datum in program.data.items()}
    shortened = {node.step.effects.shortened for node in program.nodes}
    for name in data.keys() & shortened:
        data[name] = replace(data[name], parts={})  # its items move up
    for name in data.keys() & program.saved:
        data[name] = map_of(UNKNOWN) if data[name].kind is TypeKind.MAP else data[name]  # a result has other entries
    return {
        **robot.values,
        POSE_NAME: POSE,
        **{name: input_.type for name, input_ in program.inputs.items()},
        **data,
        **dict.fromkeys(_named_twice(program, robot), UNKNOWN),  # that is told, and not what follows from it
        **{name: map_of(UNKNOWN, _entries(program, robot, name)) for name in program.saved - program.data.keys()},
    }


def _entries(program: Program, robot: RobotNames, name: str) -> tuple[str, ...]:
    """Return the entries that a saved result can have; none if they are not known."""
    found = [_result_names(node, robot) for node in program.nodes if node.saved and node.saved.text == name]
    return tuple(dict.fromkeys(entry for names in found for entry in names)) if all(found) else ()


def _result_names(node: MissionNode, robot: RobotNames) -> tuple[str, ...]:
    used = robot.missions.get(node.step.uses.text) if node.step.uses else None
    if used is not None and not used.is_open:
        return tuple(used.outputs)
    skill = robot.skills.get(node.skill)
    return tuple(skill.results) if skill is not None else node.step.result_names


def base_scope(program: Program, robot: RobotNames) -> NodeScope:
    """Return the scope of a whole mission."""

    def may_have(name: str) -> bool:
        return program.is_open or robot.may_have(VALUE, name)

    return NodeScope(base_names(program, robot), robot.places, robot.removed, may_have, program.items)


def views(program: Program, robot: RobotNames) -> Iterator[View]:
    """Yield each node with its scope, in the order of the text."""
    base = base_scope(program, robot)
    below: dict[int, NodeScope] = {}  # the scope of a node's children
    for node in program.nodes:
        scope = base if node.parent is None else below[node.parent]
        view = View(program, robot, node, scope)
        shown = node.step.shows(node, scope)
        below[node.number] = replace(scope, names={**scope.names, **shown}) if shown else scope
        yield view


def findings_of(
    expression: Expression, wanted: Type, scalar: ScalarNode, scope: NodeScope, kind: FindingKind
) -> Iterator[Finding]:
    """Yield the findings about an expression; those about neither a name nor a place are of the given kind."""
    for problem in check_value(expression, scope, wanted):
        span = inner_span(scalar, problem.start, problem.end)
        written = expression.text[problem.start : problem.end]
        fix = replacement(span, written, problem.meant) if problem.meant else None
        unknown_word = _at(problem, ((word.name, word.start) for word in expression.words))
        if unknown_word and scope.word(unknown_word) is None and problem.meant.startswith("$"):
            yield codes.UNKNOWN_NAME.at(span, problem.message, help=problem.help, fix=fix)
        elif unknown_word and wanted.kind in _PLACELESS and isinstance(expression.tree, Word):
            is_place = scope.word(unknown_word) is not None
            named = f"'{unknown_word}' is a place" if is_place else f"nothing is named '{unknown_word}'"
            message = f"this must be {wanted.phrase}; {named}"
            help_text = "write a number such as 2" if wanted.kind is TypeKind.COUNT else problem.help
            yield kind.at(span, message, help=help_text, fix=fix, about=[unknown_word])
        elif unknown_word and wanted == TEXT and unknown_word not in scope.removed:
            yield _no_text(unknown_word, span, scope, kind)
        elif unknown_word and problem.is_choice:
            yield kind.at(span, problem.message, help=problem.help, fix=fix)
        elif unknown_word in scope.removed:
            yield codes.removed_place(span, unknown_word, scope.removed[unknown_word])
        elif unknown_word and scope.word(unknown_word) is None:
            unquoted = f"there is no place '{unknown_word}'"
            yield codes.UNKNOWN_PLACE.at(span, unquoted, help=problem.help, fix=fix, about=[unknown_word])
        elif (name := _at(problem, ((name.name, name.start) for name in expression.names))) and not scope.variable(
            name
        ):
            kept = f"'${name}' is known in its loop only: keep it there by 'set' in a datum, and read that"
            help_text, fix = (kept, None) if name in scope.items else (problem.help, fix)
            yield codes.UNKNOWN_NAME.at(span, problem.message, help=help_text, fix=fix)
        else:
            help_text = problem.help or (minutes_help(written) if wanted.dimension == TIME else "")
            yield kind.at(span, problem.message, help=help_text, fix=fix)


def _no_text(word: str, span: Span, scope: NodeScope, kind: FindingKind) -> Finding:
    """Return the finding about a bare word where a text must be: a misspelt place, or a text that needs quotes."""
    message = f"there is no place '{word}'"
    if near := nearest(word, scope.words()):
        return codes.UNKNOWN_PLACE.at(span, message, help=f"did you mean '{near[0]}', or the text '\"{word}\"'?")
    fix = replacement(span, word, f'"{word}"', is_safe=False)
    return kind.at(span, message, help=f"a text needs quotes: write '\"{word}\"'", fix=fix)


def _at(problem: ExpressionProblem, names: Iterable[tuple[str, int]]) -> str:
    """Return the name that stands exactly where a problem begins."""
    return next((name for name, start in names if start == problem.start), "")


def claims_of(program: Program, robot: RobotNames, within: tuple[str, ...] = ()) -> frozenset[str]:
    """Return everything that a mission claims, including what the missions it uses claim."""
    return frozenset(name for name, _ in claims_below(program.nodes, robot, within))


def claims_below(
    nodes: tuple[MissionNode, ...], robot: RobotNames, within: tuple[str, ...] = ()
) -> Iterator[tuple[str, Span]]:
    """Yield the claims of nodes, each with its span; `within` are missions that are already being examined."""
    for node in nodes:
        skill = robot.skills.get(node.skill)
        if skill and skill.claims:
            yield skill.claims, node.span
        name = node.step.uses.text if node.step.uses else ""
        if name in robot.missions and name not in within:
            if name not in robot.claims:
                robot.claims[name] = claims_of(robot.missions[name], robot, (*within, name))
            for claim in robot.claims[name]:
                yield claim, node.span


Leads = Mapping[str, frozenset[str]]  # the states and ends that each state leads to, by its name


def transitions(program: Program) -> Iterator[tuple[MachineStates, list[MissionNode], Leads]]:
    """Yield each machine, its states in the order of the text, and where each leads to."""
    for node in program.nodes:
        if node.step.states:
            states = [program.nodes[child] for child in node.children]
            yield node.step.states, states, {state.name: _targets(state) for state in states}


def reached(start: str, leads: Leads) -> frozenset[str]:
    """Return all states and ends that can be reached from a state, including the state itself."""
    return _all_from([start], leads)


def leading_to(goals: Iterable[str], leads: Leads) -> frozenset[str]:
    """Return all states and ends from which one of `goals` can be reached, including the goals."""
    back: dict[str, set[str]] = {}
    for name, targets in leads.items():
        for target in targets:
            back.setdefault(target, set()).add(name)
    return _all_from(goals, back)


def _all_from(begin: Iterable[str], steps: Mapping[str, AbstractSet[str]]) -> frozenset[str]:
    """Return all that can be reached in some steps, including where they begin."""
    found = set(begin)
    open_ones = list(found)
    while open_ones:
        new = steps.get(open_ones.pop(), frozenset()) - found
        found |= new
        open_ones.extend(new)
    return frozenset(found)


def _targets(state: MissionNode) -> frozenset[str]:
    return frozenset(state.step.leads_to.to.values() if state.step.leads_to else ())


class Ending:
    """Finds how the nodes of a mission may end."""

    def __init__(self, program: Program, robot: RobotNames, within: tuple[str, ...] = ()) -> None:
        self.program = program
        self.robot = robot
        self.within = within  # missions that are being examined
        self._known: dict[int, Outcomes] = {}

    @cached_property
    def constants(self) -> Constants:
        """Return the data that nothing changes."""
        return constants_of(self.program, {})

    def of(self, number: int, /) -> Outcomes:
        """Return how a node may end, its modifiers included."""
        if number not in self._known:
            self._known[number] = self.inside_of(self.program.nodes[number])
        return self._known[number]

    def inside_of(self, node: MissionNode, key: str = "") -> Outcomes:
        """Return the outcomes of a node inside its modifier `key`; without a key, with all its modifiers."""
        found = node.step.may_end(node, self)
        for name in takewhile(lambda modifier: modifier != key, reversed(tuple(node.modifiers))):
            found = node.modifiers[name].changed(found)
        return found

    def mission(self) -> Outcomes:
        """Return how the mission may end."""
        found = self.of(self.program.main)
        for interrupt in self.program.interrupts:
            reaction = ALWAYS_SUCCEEDS if interrupt.root is None else self.of(interrupt.root)
            found = found.both(Outcomes(interrupt.afterwards == END, reaction.counting_as(FAILS)))
        for result in (node.step.ends_mission for node in self.program.nodes if node.step.ends_mission):
            found = found.both(Outcomes(result == SUCCEEDS, result == FAILS))
        return found

    def of_mission(self, name: str, /) -> Outcomes:
        """Return how another mission may end."""
        program, known = self.robot.missions.get(name), self.robot.ends
        if program is None or name in self.within:
            return ANY
        if name not in known:
            known[name] = Ending(program, self.robot, (*self.within, name)).mission()
        return known[name]

    def of_branches(self, node: MissionNode) -> dict[str, Outcomes]:
        """Return how each branch of a node may end, by its name."""
        names = node.step.branches.names if node.step.branches else ()
        return {name: self.of(child) for name, child in zip(names, node.children, strict=False)}


@dataclass(frozen=True)
class Examined:
    """A mission, and what the robot offers it."""

    program: Program
    robot: RobotNames

    @cached_property
    def views(self) -> tuple[View, ...]:
        """Return each node with its scope, in the order of the text."""
        return tuple(views(self.program, self.robot))

    @cached_property
    def scope(self) -> NodeScope:
        """Return the scope of the whole mission."""
        return base_scope(self.program, self.robot)

    @cached_property
    def ending(self) -> Ending:
        """Return the analyser of how nodes may end."""
        return Ending(self.program, self.robot)


MissionCheck = Rule[Examined]
Find = Callable[[Examined], Iterable[Finding]]

_CHECKS: dict[str, MissionCheck] = {}


def mission_check(
    kind: str | FindingKind,
    severity: Severity = Severity.ERROR,
    *,
    is_fixable: bool = False,
    closed: tuple[str, ...] | None = None,
) -> Callable[[Find], MissionCheck]:
    """Declare a rule under its own code, or under a kind of finding that reading a mission also reports.

    `closed` is what it takes for known, see `Rule`.

    Raises:
        ValueError: if it has no docs page, or another rule has its code.
    """

    def declare(find: Find) -> MissionCheck:
        if isinstance(kind, FindingKind):
            made = belonging(find, kind, closed)
        else:
            made = declared(find, kind, severity, is_fixable, closed)
        if _CHECKS.setdefault(made.code, made) is not made:
            raise ValueError(f"two rules have the code {made.code}")
        return made

    return declare


@cache
def mission_checks() -> tuple[MissionCheck, ...]:
    """Import all rules, and return them by code."""
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    return tuple(_CHECKS[code] for code in sorted(_CHECKS))


def check_program(program: Program, robot: RobotNames) -> list[Finding]:
    """Return all findings about a mission on this robot, in the order of the text."""
    return sorted((finding for _, finding in rule_findings(Examined(program, robot), mission_checks())), key=_place)


def rule_findings(mission: Examined, rules: Iterable[MissionCheck]) -> Iterator[tuple[MissionCheck, Finding]]:
    """Yield the findings of rules about a mission, each with its rule."""
    for check in rules:
        yield from ((check, finding) for finding in check(mission))


def _place(finding: Finding) -> tuple[str, int, int]:
    return (finding.span.file, finding.span.line, finding.span.column) if finding.span else ("", 0, 0)


def check_written(view: View, scalar: ScalarNode, wanted: Type, kind: FindingKind) -> Iterator[Finding]:
    """Yield the findings on a value that must have a type; a wrong type is a finding of the given kind."""
    try:
        if wanted.kind is not TypeKind.TEXT:
            yield from view.typed(expression_of(scalar), wanted, scalar, kind)
            return
        refuse_foreign(scalar.text)
        for slot in parse_template(scalar.text).parts:
            if isinstance(slot, TextSlot):
                part = ScalarNode(slot.value.text, inner_span(scalar, slot.start, slot.end))
                yield from view.typed(slot.value, UNKNOWN, part, kind)
    except ExpressionError as error:
        yield codes.NO_EXPRESSION.at(inner_span(scalar, error.start, error.end), error.message, help=error.help)
