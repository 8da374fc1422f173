"""What can be written at a position: keys, words, names of other sections and files, units."""

import re
import string
from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.config import PLACE, PREFIXED
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.units import NUMBER_TEXT, Dimension, units_of
from rbxcompose.compiler.schema.guide import Guide, GuidedValue
from rbxcompose.compiler.schema.scalars import Schema
from rbxcompose.manifest.documents import KINDS
from rbxcompose.missions.program.registry import anywhere
from rbxcompose.tools.lsp.answers import fills, variables
from rbxcompose.tools.lsp.document import SKILL, Document, Spot, named_by_key

_FILL = re.compile(r"\$\{\s*([A-Za-z0-9_.]*)$")
_VARIABLE = re.compile(r"\$([A-Za-z0-9_]*)$")
_WORD_CHARACTERS = f"{string.ascii_letters}{string.digits}_."
_QUANTITY = re.compile(rf"\s*[+-]?{NUMBER_TEXT}(?P<space>\s*)(?P<unit>(?:[A-Za-z%/^][A-Za-z%/^0-9]*)?)")


@dataclass(frozen=True, slots=True)
class CompletionItem:
    """One proposal: `text` replaces the `replaces` characters before the position.

    `sort` is 'key', 'name', 'word', 'unit' or 'variable'.
    """

    label: str
    sort: str
    text: str
    replaces: int
    detail: str = ""
    about: str = ""


def complete(document: Document, line: int, column: int) -> list[CompletionItem]:
    """Return what can be written at a position (from 0), in the best order to show it."""
    spot = document.at(line, column)
    if spot is None:
        return []
    if not spot.cursor.is_key:
        return list(_of_value(spot, spot.cursor.path))
    words = _words_of_item(spot) if spot.cursor.begins_item else iter(())
    return [*words, *_of_key(spot)]


def _of_key(spot: Spot) -> Iterator[CompletionItem]:
    cursor = spot.cursor
    taken = cursor.siblings
    schemas = _open_keys(spot)
    kind = named_by_key(cursor.path, spot.document.is_overlay)
    names = spot.known.of(kind, cursor.path) if kind else {}
    if spot.document.is_mission and _takes_nodes(schemas):
        names = spot.known.of(SKILL)
    for key, about in names.items():
        if key not in taken:
            yield _key(spot, key, "name", about, schemas.get(key, {}).get("description", ""))
    for key, schema in schemas.items():
        if key not in taken and key not in names:
            yield _key(spot, key, "key", _kind_of_value(schema), schema.get("description", ""))


def _open_keys(spot: Spot) -> dict[str, Schema]:
    """Return the keys allowed at the position; there is no second step beside a skill."""
    guide = spot.guide
    schemas = Guide(guide.schema, spot.cursor.around, guide.types).keys(spot.cursor.path)
    if _takes_nodes(schemas) and any(key not in anywhere() for key in spot.cursor.siblings):
        return {key: schemas[key] for key in anywhere() if key in schemas}
    return schemas


def _takes_nodes(schemas: Mapping[str, Any]) -> bool:
    return "sequence" in schemas


def _key(spot: Spot, key: str, sort: str, detail: str, about: str) -> CompletionItem:
    text = key if spot.cursor.has_colon else f"{key}: "
    return CompletionItem(key, sort, text, len(spot.cursor.before), detail, about)


def _kind_of_value(schema: Mapping[str, Any]) -> str:
    value = GuidedValue([dict(schema)])
    return value.dimension.name if value.dimension else ""


def _words_of_item(spot: Spot) -> Iterator[CompletionItem]:
    """Yield what can be written as a word in a list where a key is possible as well."""
    path = spot.cursor.path
    if spot.document.is_mission and _takes_nodes(spot.guide.keys(path)):
        yield from _names(spot.known.of(SKILL), "name", len(spot.cursor.before))
    else:
        yield from _of_value(spot, path)


def _of_value(spot: Spot, path: tuple[str | int, ...]) -> Iterator[CompletionItem]:
    before, value = spot.cursor.before, spot.guide.value(path)
    if match := _FILL.search(before):
        yield from _names(fills(spot), "variable", len(match[1]))
        return
    if spot.document.is_mission and (match := _VARIABLE.search(before)):
        yield from _names(variables(spot), "variable", len(match[1]))
        return
    if match := _QUANTITY.fullmatch(before):
        if value.dimension:
            yield from _units(value.dimension, match)
        return
    kind = value.names
    replaces = len(before) if kind in PREFIXED else len(before) - len(before.rstrip(_WORD_CHARACTERS))
    yield from _names(spot.known.of(kind, path) if kind else {}, "name", replaces)
    if spot.document.is_mission and not kind and value.dimension is None and not value.words:
        yield from _names(spot.known.of(PLACE), "name", replaces)  # places can be compared here
    kinds = dict.fromkeys((spot.document.usual_kind, *KINDS), "") if path == ("kind",) else {}
    for word, about in (kinds or value.words).items():
        yield CompletionItem(word, "word", word, replaces, "", about)
    if not before:
        yield from (CompletionItem(sample, "word", sample, 0, "example") for sample in value.examples)


def _names(names: Mapping[str, str], sort: str, replaces: int) -> Iterator[CompletionItem]:
    return (CompletionItem(name, sort, name, replaces, about) for name, about in names.items())


def _units(dimension: Dimension, match: re.Match[str]) -> Iterator[CompletionItem]:
    space = "" if match["space"] or match["unit"] else " "
    for unit in units_of(dimension):
        yield CompletionItem(unit, "unit", f"{space}{unit}", len(match["unit"]), dimension.name)
