"""Declared arguments and inputs: their types, limits and choices, and reading a value of one."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from pydantic import Field

from rbxcompose.base import units
from rbxcompose.base.config import Config, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import TYPES, Type, TypeKind, choice_of
from rbxcompose.base.findings import DID_YOU_MEAN, Finding, FindingKind, Related, Report, Span, replacement
from rbxcompose.base.printable import plain
from rbxcompose.manifest import tree
from rbxcompose.manifest.foreign_words import TYPES as FOREIGN_TYPES
from rbxcompose.manifest.tree import describe
from rbxcompose.manifest.validate import (
    MISSING_KEY,
    NOT_A_CHOICE,
    OUT_OF_RANGE,
    WRONG_TYPE,
    not_a_choice,
    to_plain,
    unit_finding,
    validate,
    where,
)

CHOICE = "choice"


class ArgumentModel(Config):
    """A typed argument of a robot or part, or a typed input of a mission."""

    type: str = Field(json_schema_extra={"enum": [*TYPES, CHOICE]})
    """Its type: a dimension, `count`, `number`, `text`, `flag`, `place`, `pose`, `choice`, `list` or `map`."""
    default: Any = None
    """Value if none is given."""
    min: Any = None
    """Smallest value; for quantities, counts and numbers."""
    max: Any = None
    """Largest value; for quantities, counts and numbers."""
    choices: list[str] = []
    """The words that a `choice` takes."""
    about: str = ""
    """Its purpose."""


@dataclass(frozen=True, slots=True)
class DeclaredArgument:
    """A declared argument: what its values must be."""

    name: str
    type: Type
    default: tree.TreeNode | None
    least: object = None
    most: object = None

    def read(self, node: tree.TreeNode, report: Report) -> object:
        """Return the typed value of a node, `BROKEN` after a finding: see `read_value`."""
        value = read_value(node, self.type, self.name, report)
        for words, bound, sign in (("at least", self.least, 1), ("at most", self.most, -1)):
            if tree.BROKEN not in (value, bound) and bound is not None and (size_of(value) - size_of(bound)) * sign < 0:
                message = f"'{self.name}' must be {words} {show(bound)}"
                report.add(OUT_OF_RANGE.at(node.span, message, label=f"this is {show(value)}"))
                return tree.BROKEN
        return value


def read_argument(name: str, node: tree.TreeNode, path: tree.KeyPath, report: Report) -> DeclaredArgument | None:
    """Return the declaration of an argument at `path`, None after its findings."""
    model = validate(ArgumentModel, node, path, report)
    if model is None or not isinstance(node, tree.MappingNode):
        return None
    declared = _type(model, node, path, report)
    if declared is None:
        return None
    bounds: dict[str, object] = {}
    for key in ("min", "max"):
        if (bound := node.get(key)) is not None:
            if declared.measure is None:
                report.add(WRONG_TYPE.at(tree.key_span(node, (key,)), f"'{key}' does not apply to {declared.phrase}"))
                continue
            bounds[key] = read_value(bound, declared, key, report)
    if model.choices and model.type != CHOICE:
        message = f"'choices' does not apply to {declared.phrase}"
        help_text = "use 'min' and 'max'" if declared.measure else f"write 'type: {CHOICE}'"
        report.add(WRONG_TYPE.at(tree.key_span(node, ("choices",)), message, help=help_text))
    least, most = bounds.get("min"), bounds.get("max")
    if tree.BROKEN not in bounds.values() and None not in (least, most) and size_of(least) > size_of(most):
        place = tree.value_span(node, ("min",))
        report.add(OUT_OF_RANGE.at(place, f"'min' is above 'max', {show(most)}", help="exchange them"))
        bounds.clear()
    return DeclaredArgument(name, declared, node.get("default"), bounds.get("min"), bounds.get("max"))


def _type(model: ArgumentModel, node: tree.MappingNode, path: tree.KeyPath, report: Report) -> Type | None:
    written = node.get("type")
    if model.type == CHOICE:
        if model.choices:
            return choice_of(*model.choices)
        report.add(MISSING_KEY.at(tree.key_span(node, ("type",)), f"{where(path)} is a choice and needs 'choices'"))
    elif found := TYPES.get(model.type):
        return found
    elif written:
        report.add(_unknown_type(written, model, node.get("default")))
    return None


def _unknown_type(written: tree.TreeNode, model: ArgumentModel, default: tree.TreeNode | None) -> Finding:
    """Return the finding for a type that does not exist; a default with a unit tells which one is meant."""
    finding = unknown_type(NOT_A_CHOICE, written.span, model.type)
    unit = units.written_unit(default.text) if isinstance(default, tree.ScalarNode) else None
    if unit is None or (meant := units.UNITS[unit].dimension.name) not in TYPES:
        return finding
    fix = replacement(written.span, model.type, meant, is_safe=False)
    return NOT_A_CHOICE.at(written.span, finding.message, help=f"{DID_YOU_MEAN} '{meant}'?", fix=fix)


def unknown_type(kind: FindingKind, span: Span, name: str) -> Finding:
    """Return the finding for a type of an argument or input that does not exist."""
    message = f"there is no type '{plain(name, 60)}'"
    if ours := FOREIGN_TYPES.get(name.lower()):
        return kind.at(
            span, message, help=f"{DID_YOU_MEAN} '{ours}'?", fix=replacement(span, name, ours, is_safe=False)
        )
    return kind.misspelt(span, message, name, (*TYPES, CHOICE), "types")


def read_value(node: tree.TreeNode, expected: Type, name: str, report: Report) -> object:
    """Return a node as a value of the type `expected`, `BROKEN` after a finding.

    Quantities for dimensions, float for `number`, int for `count`, text for words, names and places, bool for flags,
    the node itself for lists, maps and written-out poses.
    """
    if isinstance(node, tree.ScalarNode) and node.filled is tree.BROKEN:
        return tree.BROKEN
    if expected.dimension and expected.dimension != units.NUMBER:
        return _quantity(node, expected.dimension, name, report)
    value = to_plain(node)
    read: object = None
    match expected.kind:
        case TypeKind.QUANTITY if isinstance(value, int | float) and not isinstance(value, bool):
            read = float(value)
        case TypeKind.COUNT if isinstance(value, int) and not isinstance(value, bool) and value >= 0:
            read = value
        case TypeKind.FLAG if isinstance(value, bool):
            read = value
        case TypeKind.TEXT if isinstance(node, tree.ScalarNode) and value is not None:
            read = node.text if node.filled is None else value if isinstance(value, Secret) else show(value)
        case TypeKind.CHOICE if isinstance(node, tree.ScalarNode):
            read = node.text if node.filled is None else value
            if read not in expected.choices:
                report.add(not_a_choice(node.span, name, node, list(expected.choices)))
                return tree.BROKEN
        case TypeKind.PLACE | TypeKind.POSE if isinstance(value, str):
            read = value
        case TypeKind.POSE | TypeKind.MAP if isinstance(node, tree.MappingNode):
            read = node
        case TypeKind.LIST if isinstance(node, tree.SequenceNode):
            read = node
    if read is None:
        must_be = {TypeKind.COUNT: "a whole number, not below 0", TypeKind.FLAG: "true or false"}
        message = f"'{name}' must be {must_be.get(expected.kind, expected.phrase)}"
        report.add(WRONG_TYPE.at(node.span, message, label=describe(value)))
        return tree.BROKEN
    return read


def _quantity(node: tree.TreeNode, dimension: units.Dimension, name: str, report: Report) -> object:
    try:
        return units.Quantity(units.to_si(to_plain(node), dimension), dimension)
    except units.UnitError as error:
        report.add(unit_finding(error, node, name))
        return tree.BROKEN


def size_of(value: object) -> float:
    """Return a typed value as a number, in SI; what has no size is 0."""
    if isinstance(value, units.Quantity):
        return value.value
    return float(value) if isinstance(value, int | float) else 0.0


def show(value: object) -> str:
    """Return a typed value as text: `0.3 m/s`, `2`, `true`."""
    match value:
        case bool():
            return "true" if value else "false"
        case units.Quantity(value=number, dimension=dimension):
            return units.format_quantity(number, dimension)
        case int() | float():
            return units.format_number(value)
    return str(value)


class GivenSpan(Span):
    """The place of a value that was given to an argument; `uses` are the places where it is used, outermost first.

    It equals the plain place of the value.
    """

    uses: tuple[Span, ...] = ()


def given_span(given: Span, use: Span) -> GivenSpan:
    """Return the place `given` with `use`, where it is filled in; `given` may already have been passed on itself."""
    made = GivenSpan(*given)
    made.uses = (*(given.uses if isinstance(given, GivenSpan) else ()), use)
    return made


def decided_at(root: tree.TreeNode, path: tree.KeyPath, otherwise: Span) -> Span:
    """Return the place of the one value that was given for something at `path` or below it; else another place."""
    node = tree.at(root, path)
    spans = (found.span for found in tree.all_nodes(node)) if node is not None else ()
    given: dict[Span, GivenSpan] = {}
    for span in spans:
        if isinstance(span, GivenSpan):
            given.setdefault(Span(*span), span)
    return next(iter(given.values())) if len(given) == 1 else otherwise


def at_its_argument(finding: Finding) -> Finding:
    """Return a finding with plain places; if it is about a given value, it also shows where that value is used."""
    related = [one for other in finding.related for one in _plain(other)]
    if not isinstance(finding.span, GivenSpan):
        return finding if related == list(finding.related) else replace(finding, related=_once(related))
    uses = [Related(use, "passed on here") for use in finding.span.uses[:-1]]
    uses += [Related(use, "used here") for use in finding.span.uses[-1:]]
    return replace(finding, span=Span(*finding.span), related=_once([*uses, *related]))


def _plain(related: Related) -> Iterator[Related]:
    if not isinstance(related.span, GivenSpan):
        yield related
        return
    yield Related(Span(*related.span), related.message)
    yield from (Related(use, "used here") for use in related.span.uses[-1:])


def _once(related: Iterable[Related]) -> tuple[Related, ...]:
    return tuple(dict.fromkeys(related))
