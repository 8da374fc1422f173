"""The scope of a node before the mission runs: the types of all names in it."""

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import field, replace

from rbxcompose.base.config import VALUE
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.check import ExpressionProblem, check_value
from rbxcompose.base.expressions.tree import Expression, Word
from rbxcompose.base.expressions.types import PLACE, POSE, TEXT, UNKNOWN, Type, TypeKind, map_of
from rbxcompose.base.findings import Finding, FindingKind, Span, nearest, replacement
from rbxcompose.base.units import TIME, minutes_help
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions import codes
from rbxcompose.missions.engine.world import POSE as POSE_NAME
from rbxcompose.missions.language.asked import inner_span
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames

_MEASURED = (TypeKind.QUANTITY, TypeKind.COUNT, TypeKind.FLAG)  # types that no place can have


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
        elif unknown_word and wanted.kind in _MEASURED and isinstance(expression.tree, Word):
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
