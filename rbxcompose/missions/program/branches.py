"""Branches: what decides between parallel nodes, the outcomes by conditions over them, the cases of a value."""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Comparison, Expression, ExpressionNode, Variable, Word
from rbxcompose.base.expressions.values import NotArrived, Value
from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions import codes
from rbxcompose.missions.engine.scopes import Inner, MissionScope
from rbxcompose.missions.language.asked import Asked
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.program.outcomes import FAILURE, NAMES, SKIPPED, SUCCESS

ALL, ANY = "all", "any"
OTHERWISE, HALTED = "otherwise", "halted"
CONDITIONAL = frozenset(("if", "then", "else", "when", "check", "choose", "cases"))
"""Words of conditions, which are no outcomes."""
RESULTS = (NAMES[SUCCESS], NAMES[FAILURE], NAMES[SKIPPED], HALTED)


def compared_with_word(tree: ExpressionNode) -> tuple[str, Word] | None:
    """Return the `$name` and the word that a comparison tests for equality, None for anything else."""
    match tree:
        case Comparison(operator="==", left=Variable(name=name), right=Word() as word):
            return name, word
        case Comparison(operator="==", left=Word() as word, right=Variable(name=name)):
            return name, word
    return None


@dataclass(frozen=True, slots=True)
class OutcomeRule:
    """An outcome and its condition over the branches, None for `otherwise`."""

    name: str
    condition: Expression | None
    asked: Asked | None


@dataclass(frozen=True, slots=True)
class Branches:
    """What decides how parallel nodes end: `all` of them, `any`, a number of them, or one branch.

    `names` are the names of the branches, if they have any, in the order of the children.
    """

    names: tuple[str, ...] = ()
    succeed_when: Expression | str = ALL
    fail_when: Expression | str = ANY
    ends_with: str = ""
    ends_at: Span | None = None  # where `ends_with` names its branch
    outcomes: tuple[OutcomeRule, ...] = ()

    def deciding(self, children: tuple[int, ...]) -> tuple[int, ...]:
        """Return the children whose results count."""
        return (children[self.names.index(self.ends_with)],) if self.ends_with in self.names else children


@dataclass(frozen=True, slots=True)
class BranchChoice:
    """The expression to choose by, and the value of each case, in the order of the children."""

    asked: Expression
    cases: tuple[Asked, ...] = ()


class BranchResult(str):
    """The result of a branch as a text; an outcome of its own also equals the result it counts as."""

    __slots__ = ("counts_as",)
    counts_as: str

    @classmethod
    def of(cls, status: int, outcome: str) -> BranchResult:
        """Return the result of a branch; one that has not ended was halted."""
        plain = NAMES[status] if NAMES[status] in RESULTS else HALTED
        ended = cls(outcome or plain)
        ended.counts_as = plain
        return ended

    def __eq__(self, other: object) -> bool:
        return str.__eq__(self, other) or (isinstance(other, str) and str.__eq__(self.counts_as, other))

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = str.__hash__


class BranchScope(Inner):
    """The scope of the conditions of a parallel's outcomes, which adds the result of each branch."""

    def __init__(self, outer: MissionScope, ended: Mapping[str, BranchResult]) -> None:
        super().__init__(outer)
        self._ended = ended

    def variable(self, name: str, /) -> Value | NotArrived:
        """Return the result of a branch, or look the name up in the outer scope."""
        return self._ended[name] if name in self._ended else self.outer.variable(name)


def read_outcomes(reader: NodeReader, key: str) -> tuple[OutcomeRule, ...]:
    """Read the outcomes of a parallel; `otherwise` comes last and must be there."""
    value = reader.map_of(key, "a map from outcomes to conditions")
    if value is None:
        return ()
    if not reader.names:
        message = "'outcomes' needs branches with names"
        reader.add(codes.WRONG_SHAPE.at(reader.key_span(key), message, help="write the branches as a map"))
    read = []
    for index, (name, entry) in enumerate(value.entries.items()):
        is_last = index + 1 == len(value.entries)
        is_otherwise = isinstance(entry.value, ScalarNode) and entry.value.text == OTHERWISE
        if is_otherwise != is_last:
            message = "'otherwise' comes last" if is_otherwise else f"the last outcome must be '{OTHERWISE}'"
            help_text = f"add a line such as 'lost: {OTHERWISE}'"
            reader.add(codes.WRONG_SHAPE.at(entry.value.span, message, help=help_text))
        if reader.check_name(entry.key) and name in CONDITIONAL:
            message = f"'{name}' belongs to conditions, so no outcome is named so"
            reader.add(codes.WRONG_SHAPE.at(entry.key.span, message, help="choose another name, such as 'other'"))
        asked = None if is_otherwise else reader.asked_later(value, name)
        read.append(OutcomeRule(name, asked.expression if asked else None, asked))
    return tuple(read)
