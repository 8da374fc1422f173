"""Nodes whose parameters are the settings of a component type: those of robots that were described here before."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import ValidationError

from rbxcompose.composition.dump import exact
from rbxcompose.config import Config, Dimensioned
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report, Severity, Span, kind
from rbxcompose.importing.foreign_files import Given
from rbxcompose.importing.manifest_text import quantity
from rbxcompose.importing.parameter_values import ParameterData, written
from rbxcompose.importing.ros_parameters import NodeParameters
from rbxcompose.manifest.shapes import alternatives, field_types
from rbxcompose.printable import plain
from rbxcompose.sdk.registry import component_type, usable_names
from rbxcompose.units import UNITS, Dimension

GUESSED_TYPE = kind("RBX2293", Severity.WARNING)


@dataclass(frozen=True, slots=True)
class KnownComponent:
    """A component with its settings as a manifest has them, each with its place in the file of parameters."""

    name: str
    node: str
    span: Span
    type: str
    settings: Mapping[str, tuple[str, Span]]


def known_component(
    node: NodeParameters, parameters: Mapping[tuple[str, ...], Given[ParameterData]], report: Report
) -> KnownComponent | None:
    """Return the component that a node is; None unless its parameters are those of just one type.

    They are if all are settings, and none is missing, or the node has the name of the type and none that is required
    is missing.
    """
    given = {path[0]: value for path, value in parameters.items() if len(path) == 1}
    if not given or len(given) != len(parameters):
        return None
    own = node.node.rpartition("/")[2]
    fitting = [name for name in usable_names() if _fits(name, own, given)]
    if len(fitting) != 1:
        return None
    words = f"'{plain(node.node, 60)}' is taken for a '{fitting[0]}', by its parameters"
    report.add(GUESSED_TYPE.at(node.span, words))
    dimensions = _dimensions(component_type(fitting[0]).config_type())
    settings = {name: (_written(one.value, dimensions.get(name)), one.span) for name, one in given.items()}
    return KnownComponent(own, node.node, node.span, fitting[0], settings)


def _fits(type_: str, node: str, given: Mapping[str, Given[ParameterData]]) -> bool:
    cls = component_type(type_)
    config = cls.config_type()
    fields = config.model_fields
    required = {name for name, one in fields.items() if one.is_required()}
    if cls.made_by or not fields or not required <= given.keys() <= fields.keys():
        return False
    if node != type_ and given.keys() != fields.keys():
        return False
    dimensions = _dimensions(config)
    try:
        config.model_validate({name: _data(one.value, dimensions.get(name)) for name, one in given.items()})
    except ValidationError:
        return False
    return True


def _dimensions(config: type[Config]) -> dict[str, Dimension]:
    return {
        name: mark.dimension
        for name, hint in field_types(config).items()
        for mark in alternatives(hint)
        if isinstance(mark, Dimensioned)
    }


def _data(value: ParameterData, dimension: Dimension | None) -> object:
    return value if dimension is None or isinstance(value, str) else _written(value, dimension)


def _written(value: ParameterData, dimension: Dimension | None) -> str:
    """Return a value as a manifest has it; numbers of files are in SI."""
    if dimension is None or isinstance(value, bool | str | list):
        return written(value)
    units = (name for name, unit in UNITS.items() if unit.dimension == dimension and unit.to_si(1.0) == 1.0)
    unit = next(units, None)
    return exact(float(value), dimension) if unit is None else quantity(float(value), unit)
