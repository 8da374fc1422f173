"""The answers of `why`, as text and as data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rbxcompose.composition.history import ROBOT_LAYER
from rbxcompose.composition.overlay import SET
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Span
from rbxcompose.inspection.origin import Origin, as_data
from rbxcompose.manifest.tree import TreeNode
from rbxcompose.printable import plain
from rbxcompose.units import UNITS, Dimension, format_number

LABEL = 15  # width of the labels


@dataclass(frozen=True, slots=True)
class Layer:
    """What one layer wrote; None if it removed the value."""

    name: str
    value: str | None
    span: Span

    @property
    def place(self) -> str:
        """Return the place where it is written; empty for the command line."""
        return "" if self.span.file == SET else str(self.span)


@dataclass(frozen=True, slots=True)
class ArgumentSource:
    """An argument that a value was filled in from; `below` are the layers whose values it replaced."""

    name: str
    value: str
    origin: Origin | None
    below: tuple[Layer, ...] = ()


@dataclass(frozen=True, slots=True)
class PathAnswer:
    """Everything known about one path; the last of `layers` is in effect."""

    path: str
    value: str
    about: str = ""
    dimension: Dimension | None = None
    si: float | None = None
    layers: tuple[Layer, ...] = ()
    sources: tuple[ArgumentSource, ...] = ()
    is_default: bool = False
    hints: tuple[tuple[str, str], ...] = ()  # a label and a text
    place: str = ""
    body: str = ""
    node: TreeNode | None = None

    def text(self) -> str:
        """Return the answer as text for people."""
        lines = [f"{self.path} = {plain(self.value)}", *([f"  {self.about}"] if self.about else [])]
        lines += [f"  {label:<{LABEL}}{text}".rstrip() for label, text in self._rows()]
        if self.body:
            lines += ["", *(f"  {line}" for line in self.body.splitlines())]
        return "\n".join(lines)

    def _rows(self) -> Iterator[tuple[str, str]]:
        if self.si is not None and self.dimension is not None:
            yield "in SI", f"{format_number(self.si)} {si_unit(self.dimension)}".rstrip() + f", {self.dimension.phrase}"
        if self.place:
            yield "where", self.place
        match self.layers:
            case ():
                pass
            case (only,):
                written = f", as {plain(only.value)}" if only.value not in (None, self.value) else ""
                yield "where", f"{_where(only)}{written}"
            case _:
                for index, row in enumerate(self._layer_rows()):
                    yield "" if index else "layers", row
        for index, source in enumerate(self.sources):
            place = f"  {source.origin.comment}" if source.origin else ""
            is_or_has = "=" if source.origin else "has"
            yield "" if index else "from", f"{source.name} {is_or_has} {plain(source.value)}{place}"
            for layer in reversed(source.below):
                origin = Origin(layer.span, layer.name)
                yield "", f"  instead of {plain(layer.value or 'nothing')}  {origin.comment}"
        yield from self.hints

    def _layer_rows(self) -> Iterator[str]:
        rows = [(layer.name, layer.value or "(removed)", layer.place) for layer in self.layers]
        widths = [max(len(row[column]) for row in rows) for column in range(2)]
        for row in rows:
            holds = "  <- holds" if row is rows[-1] else ""
            yield f"{row[0]:<{widths[0]}}  {plain(row[1]):<{widths[1]}}  {row[2]}".rstrip() + holds

    def data(self) -> dict[str, Any]:
        """Return the answer as data for programs."""
        return {
            "path": self.path,
            "value": as_data(self.node) if self.node is not None else self.value,
            "about": self.about,
            "si": self.si,
            "unit": si_unit(self.dimension) if self.dimension else "",
            "is_default": self.is_default,
            "layers": _as_data(self.layers),
            "filled_in_from": [
                {
                    "name": one.name,
                    "value": one.value,
                    **(_placed(one.origin.span) if one.origin else {}),
                    "below": _as_data(one.below),
                }
                for one in self.sources
            ],
            "more": dict(self.hints),
        }


def _as_data(layers: tuple[Layer, ...]) -> list[dict[str, Any]]:
    return [{"layer": one.name, "value": one.value, **_placed(one.span)} for one in layers]


def _where(layer: Layer) -> str:
    return ", ".join(part for part in (layer.place, layer.name if layer.name != ROBOT_LAYER else "") if part)


def _placed(span: Span) -> dict[str, Any]:
    return {"file": span.file, "line": span.line, "column": span.column}


def si_unit(dimension: Dimension) -> str:
    """Return the unit in which values of a dimension are kept, nothing if it has none of its own."""
    units = (unit.name for unit in UNITS.values() if unit.dimension == dimension and unit.to_si(1.0) == 1.0)
    return next(units, "")
