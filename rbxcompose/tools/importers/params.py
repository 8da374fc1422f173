"""`params`: files of ROS 2 parameters, and dumps of `dynamic_reconfigure`."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from pydantic import ValidationError

from rbxcompose.base.config import Config, Dimensioned
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Related, Report, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.base.units import UNITS, Dimension
from rbxcompose.commands.importing import ros_parameters
from rbxcompose.commands.importing.foreign_files import ForeignFile, FreeNames, Given
from rbxcompose.commands.importing.importer import CLOCK, DISAGREES, NOT_CARRIED_OVER, OTHER_PROGRAM, importer
from rbxcompose.commands.importing.manifest_text import Row, header, place, quantity, row, section
from rbxcompose.compiler.composition.robot_file import is_own_name
from rbxcompose.manifest.shapes import alternatives, exact, field_types
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.sdk.registry import component_type, usable_names

GUESSED_TYPE = kind("RBX2293", Severity.WARNING)
# What programs of ROS have by themselves, and what decides here.
_OF_ROS = {
    "use_sim_time": CLOCK,
    "qos_overrides": "the class of a port decides",
    "start_type_description_service": "there is no such service",
}


@dataclass(frozen=True, slots=True)
class KnownComponent:
    """A component with its settings as a manifest has them, each with its place in the file of parameters."""

    name: str
    node: str
    span: Span
    type: str
    settings: Mapping[str, tuple[str, Span]]


def known_component(
    node: ros_parameters.NodeParameters,
    parameters: Mapping[tuple[str, ...], Given[ros_parameters.ParameterData]],
    report: Report,
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
    settings = {name: (_written(entry.value, dimensions.get(name)), entry.span) for name, entry in given.items()}
    return KnownComponent(own, node.node, node.span, fitting[0], settings)


def _fits(type_: str, node: str, given: Mapping[str, Given[ros_parameters.ParameterData]]) -> bool:
    cls = component_type(type_)
    config = cls.config_type()
    fields = config.model_fields
    required = {name for name, field in fields.items() if field.is_required()}
    if cls.made_by or not fields or not required <= given.keys() <= fields.keys():
        return False
    if node != type_ and given.keys() != fields.keys():
        return False
    dimensions = _dimensions(config)
    try:
        config.model_validate({name: _data(entry.value, dimensions.get(name)) for name, entry in given.items()})
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


def _data(value: ros_parameters.ParameterData, dimension: Dimension | None) -> object:
    return value if dimension is None or isinstance(value, str) else _written(value, dimension)


def _written(value: ros_parameters.ParameterData, dimension: Dimension | None) -> str:
    """Return a value as a manifest has it; numbers of files are in SI."""
    if dimension is None or isinstance(value, bool | str | list):
        return ros_parameters.written(value)
    units = (name for name, unit in UNITS.items() if unit.dimension == dimension and unit.to_si(1.0) == 1.0)
    unit = next(units, None)
    return exact(float(value), dimension) if unit is None else quantity(float(value), unit)


ParameterPath = tuple[str, ...]
GivenValues = dict[ParameterPath, Given[ros_parameters.ParameterData]]


@importer("params", "files of ROS 2 parameters, and dumps of dynamic_reconfigure")
def params(files: Sequence[ForeignFile], name: str, report: Report) -> str:
    """Return a robot with a component for each node that is one of ours, and an argument for each other parameter."""
    found = [file for file in files if _is_one(file, report)]
    nodes: dict[str, tuple[ros_parameters.NodeParameters, GivenValues]] = {}
    for file in found:
        for node in ros_parameters.parameters_of(file):
            _, known = nodes.setdefault(node.node, (node, {}))
            _add(known, node, report)
    components = {
        name: made
        for name, (node, known) in nodes.items()
        if (made := known_component(node, known, report)) is not None
    }
    others = {name: one for name, one in nodes.items() if name not in components and one[1]}
    text = "\n".join(
        part for part in (section(_argument_rows(others)), section(_component_rows(components.values()))) if part
    )
    return f"{header('params', [file.name for file in found], 'Robot', name)}\n{text}" if text else ""


def _is_one(file: ForeignFile, report: Report) -> bool:
    words = ""
    if not isinstance(file.root, MappingNode):
        words = "it is not a map of keys"
    elif {"rbx", "kind"} <= file.root.entries.keys():
        words = "it is a manifest"
    if words:
        report.add(OTHER_PROGRAM.at(file.root.span, f"'{plain(file.name)}' is not a file of parameters: {words}"))
    return not words


def _add(known: GivenValues, node: ros_parameters.NodeParameters, report: Report) -> None:
    """Add the parameters of a node; report those that cannot be carried over, and those that disagree."""
    for path, entry in ros_parameters.scalars_of(node.root):
        shown = f"'{plain(ros_parameters.shown_name(path), 60)}' of '{plain(node.node, 60)}'"
        value = ros_parameters.value_of(entry.value)
        if path[0] in _OF_ROS and not (value is not None and value.value is False):
            words = f"{shown} is not carried over: {_OF_ROS[path[0]]}"
            report.add(NOT_CARRIED_OVER.at(entry.key.span, words))
        if path[0] in _OF_ROS:
            continue
        if value is None and ros_parameters.was_refused(entry.value):
            continue
        if value is None:
            words = f"{shown} is not carried over: it is neither a value nor a list of values"
            report.add(NOT_CARRIED_OVER.at(entry.value.span, words))
        elif (other := known.setdefault(tuple(".".join(path).split(".")), value)) != value:
            words = f"{shown} was something else before; the first one counts"
            report.add(DISAGREES.at(value.span, words, related=[Related(other.span, "the first one")]))


def _argument_rows(nodes: dict[str, tuple[ros_parameters.NodeParameters, GivenValues]]) -> Iterator[Row]:
    """Yield an argument for each parameter, below the name of its node."""
    names = FreeNames()
    if nodes:
        yield row(0, "args:")
    for name, (node, known) in nodes.items():
        yield row(1, "", f"{place(node.span)}: '{plain(name, 60)}'")
        for path, value in known.items():
            last = "_".join(path)
            wanted = last if len(nodes) == 1 else f"{name.rpartition('/')[2].replace('**', 'all')}_{last}"
            text = (
                f"{{type: {ros_parameters.argument_type(value.value)}, default: {ros_parameters.written(value.value)}}}"
            )
            origin = f"{place(value.span)}: {plain(ros_parameters.shown_name(path), 60)}"
            yield row(1, f"{names.take(wanted, 'parameter')}: {text}", origin)


def _component_rows(components: Iterable[KnownComponent]) -> Iterator[Row]:
    names, is_first = FreeNames(is_own_name), True
    for component in components:
        if is_first:
            yield row(0, "components:")
        is_first = False
        origin = f"{place(component.span)}: '{plain(component.node, 60)}'"
        yield row(1, f"{names.take(component.name, component.type)}:", origin)
        yield row(2, f"type: {component.type}", "the settings are those of this type")
        for setting, (text, span) in component.settings.items():
            yield row(2, f"{setting}: {text}", place(span))
