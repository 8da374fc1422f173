"""Plans as text, and back: `load(dump(plan)) == plan`, unless a configuration has a secret, which is never shown.

The text is JSON. It names no types: they are those of the plan's fields and of the components' configurations, so
that loading a file creates nothing but plans. Configurations are validated again, missions are read again from their
located tree, and expressions from their text. Maps keep their order, which components see: that of missions and places
is the one in which they are listed.
"""

import json
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ValidationError
from pydantic_core import to_jsonable_python

from rbxcompose.base.config import HIDDEN, Config, Dimensioned, Place, Secret
from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.findings import Report, Span
from rbxcompose.base.plugins import BrokenPluginError
from rbxcompose.base.units import DIMENSIONS, Dimension, Quantity
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, SequenceNode, TreeNode
from rbxcompose.missions.language.reader import read_program
from rbxcompose.missions.program.program import Program
from rbxcompose.msgs import registry
from rbxcompose.sdk.registry import component_names, component_type


def dimension_to_data(dimension: Dimension) -> str | dict[str, Any]:
    """Return the name of a dimension, if it has its own, else the name with the exponents."""
    if DIMENSIONS.get(dimension.name) == dimension:
        return dimension.name
    return {"name": dimension.name, "exponents": list(dimension.exponents)}


def dimension_of_data(data: Any) -> Dimension:
    """Return the dimension that `dimension_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    if isinstance(data, str):
        return DIMENSIONS[data]
    return Dimension(str(data["name"]), tuple(map(int, data["exponents"])))


def quantity_to_data(quantity: Quantity) -> dict[str, Any]:
    """Return the value in SI with its dimension."""
    return {"value": quantity.value, "dimension": dimension_to_data(quantity.dimension)}


def quantity_of_data(data: Any) -> Quantity:
    """Return the quantity that `quantity_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    return Quantity(float(data["value"]), dimension_of_data(data["dimension"]))


def node_to_data(node: TreeNode, file: str = "") -> dict[str, Any]:
    """Return a node as data; default values are left out, and `file` is that of the node around it."""
    data = _place(node.span, file)
    match node:
        case ScalarNode():
            data["text"] = node.text
            if not node.plain:
                data["quoted"] = True
            if node.filled is not None:
                data["filled"] = quantity_to_data(node.filled) if isinstance(node.filled, Quantity) else node.filled
            if node.scope:
                data["scope"] = node.scope
            return data
        case SequenceNode():
            data["items"] = [node_to_data(item, node.span.file) for item in node.items]
        case MappingNode():
            data["entries"] = [
                [node_to_data(one, node.span.file) for one in (entry.key, entry.value)]
                for entry in node.entries.values()
            ]
    if node.tag:
        data["tag"] = node.tag
    return data


def node_of_data(data: Any, file: str = "") -> TreeNode:
    """Return the node that `node_to_data` wrote down.

    Raises:
        KeyError, TypeError, ValueError: if it did not write this.
    """
    span = _span(data, file)
    if "entries" in data:
        pairs = [(_scalar(key, span.file), node_of_data(value, span.file)) for key, value in data["entries"]]
        return MappingNode({key.text: Entry(key, value) for key, value in pairs}, span, str(data.get("tag", "")))
    if "items" in data:
        items = tuple(node_of_data(item, span.file) for item in data["items"])
        return SequenceNode(items, span, str(data.get("tag", "")))
    return _scalar(data, file)


def _scalar(data: Any, file: str) -> ScalarNode:
    filled = data.get("filled")
    if isinstance(filled, dict):
        filled = quantity_of_data(filled)
    elif not isinstance(filled, bool | int | float | str | None):
        raise ValueError("a value must be a number, a flag or a text")
    return ScalarNode(
        text=str(data["text"]),
        span=_span(data, file),
        plain=not data.get("quoted", False),
        filled=filled,
        scope=str(data.get("scope", "")),
    )


def _place(span: Span, file: str) -> dict[str, Any]:
    data: dict[str, Any] = {"at": [span.line, span.column, span.end_line, span.end_column]}
    return data if span.file == file else {"file": span.file, **data}


def _span(data: Any, file: str) -> Span:
    line, column, end_line, end_column = map(int, data["at"])
    return Span(str(data.get("file", file)), line, column, end_line, end_column)


VERSION = 1
VERSION_KEY = "rbxcompose_plan"


class PlanTextError(ValueError):
    """Raised when a text is not a plan that this installation can read."""


def dump(plan: Plan, *, reveals_secrets: bool = False) -> str:
    """Return a plan as JSON; a secret is written as `***`, unless it is for the robot's own processes."""

    def secret(value: Secret) -> str:
        return value.reveal() if reveals_secrets else HIDDEN

    data = {VERSION_KEY: VERSION, **_encode(plan, Plan)}
    return json.dumps(data, ensure_ascii=False, indent=1, default=secret) + "\n"


def load(text: str) -> Plan:
    """Return the plan that `dump` wrote; names of message types mean those of its robot from then on.

    Raises:
        PlanTextError: if the text is not a plan, or names a component type that is not installed.
    """
    try:
        data = json.loads(text)
        if not isinstance(data, dict) or data.pop(VERSION_KEY, None) != VERSION:
            raise PlanTextError(f"this is not a plan of version {VERSION}")
        registry.choose(_decode(data.get("messages", {}), Mapping[str, str]))
        plan = _decode(data, Plan)
    except PlanTextError:
        raise
    except RecursionError:
        raise PlanTextError("this is not a plan: it is nested too deeply") from None
    except json.JSONDecodeError as error:
        raise PlanTextError(f"this is not JSON: {error}") from error
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise PlanTextError(f"this is not a plan: {error!r}"[:300]) from error
    if not isinstance(plan, Plan):
        raise PlanTextError("this is not a plan")
    return plan


def dump_configs(configs: Mapping[str, tuple[str, Config]]) -> str:
    """Return configurations by component, each with its type, as JSON with their secrets."""
    data = {name: (type_name, _encode(config, type(config))) for name, (type_name, config) in configs.items()}
    return json.dumps(data, default=Secret.reveal)


def load_configs(text: str) -> dict[str, Config]:
    """Return the configurations that `dump_configs` wrote.

    Raises:
        PlanTextError: if a configuration is none of its type.
    """
    types = {name: (component_type(type_name), data) for name, (type_name, data) in json.loads(text).items()}
    return {name: _model(data, cls.config_type()) for name, (cls, data) in types.items()}


def _encode(value: Any, hint: Any) -> Any:
    """Return a value of a field's type as data for JSON."""
    hint = _plain_hint(hint)
    if hint in (Any, object):
        return _encode_free(value)
    match value:
        case Secret():
            return value  # the caller of `dump` decides whether it is shown
        case Program():
            return node_to_data(value.root)
        case Expression():
            return value.text
        case Dimension():
            return dimension_to_data(value)
        case Enum():
            return value.name
        case Mapping():
            return {str(key): _encode(each, _item(hint)) for key, each in value.items()}
        case frozenset() | set():
            return sorted(_encode(each, _item(hint)) for each in value)
        case tuple() | list():
            return [_encode(each, _item(hint, index)) for index, each in enumerate(value)]
        case _ if isinstance(value, Config) or is_dataclass(value):
            cls: Any = type(value)
            hints = _hints(cls)
            return {key: _encode(getattr(value, name), hints[key]) for key, name in _names(cls).items()}
        case _:
            return to_jsonable_python(value)


def _encode_free(value: Any) -> Any:
    """Return a value of an expression as data: one that is no plain JSON value is a map with one key, its kind."""
    match value:
        case Place():
            return {"place": _encode(value, Place)}
        case Mapping():
            return {"map": {str(key): _encode_free(each) for key, each in value.items()}}
        case list():
            return [_encode_free(each) for each in value]
        case _:
            return to_jsonable_python(value)


def _decode(data: Any, hint: Any) -> Any:
    """Return the value of a field's type from the data of `_encode`; what pydantic can read is left to it."""
    dimensions = [one.dimension for one in _metadata(hint) if isinstance(one, Dimensioned)]
    whole, hint = hint, _plain_hint(hint)
    if hint in (Any, object):
        return _decode_free(data)
    if data is None:
        return _none(whole)
    if dimensions:
        return Quantity(float(data), dimensions[0])
    if not isinstance(hint, type):
        return _decode_several(data, hint)
    if hint is Program:
        return _program(data)
    if hint is Expression:
        return parse(data)
    if hint is Dimension:
        return dimension_of_data(data)
    if hint is Instance:
        return _instance(data)
    if issubclass(hint, Secret):
        return Secret(str(data))
    if issubclass(hint, Enum):
        return hint[data]
    if issubclass(hint, BaseModel):
        return _model(data, hint)
    if is_dataclass(hint):
        return hint(**_members(data, hint))
    if hint in (str, bool, int, float) and not isinstance(data, (int, float) if hint is float else hint):
        raise TypeError(f"{data!r} is not a {hint.__name__}")
    return data


def _none(hint: Any) -> None:
    while get_origin(hint) is Annotated:
        hint = get_args(hint)[0]
    if type(None) not in get_args(hint):
        raise TypeError("a value is missing")


def _decode_several(data: Any, hint: Any) -> Any:
    origin = get_origin(hint)
    if not isinstance(origin, type):  # a type without item types, a choice
        return data
    if issubclass(origin, Mapping):
        return {key: _decode(each, _item(hint)) for key, each in data.items()}
    if origin in (frozenset, set, tuple, list):
        if not isinstance(data, list):
            raise TypeError("a list is missing")
        return origin(_decode(each, _item(hint, index)) for index, each in enumerate(data))
    return data


def _decode_free(data: Any) -> Any:
    match data:
        case {"place": place}:
            return _decode(place, Place)
        case {"map": dict(entries)}:
            return {key: _decode_free(each) for key, each in entries.items()}
        case list():
            return [_decode_free(each) for each in data]
        case _:
            return data


def _program(data: Any) -> Program:
    report = Report()
    root = node_of_data(data)
    program = read_program(root, report) if isinstance(root, MappingNode) else None
    if program is None or report.has_errors:
        raise PlanTextError("a mission of this plan cannot be read")
    return program


def _instance(data: Any) -> Instance:
    if data["type"] not in component_names():
        raise PlanTextError(f"no component type '{data['type']}' is installed")
    try:
        config = _model(data["config"], component_type(data["type"]).config_type())
    except BrokenPluginError as error:
        raise PlanTextError(str(error)) from error
    others = {name: each for name, each in data.items() if name != "config"}
    return Instance(config=config, **_members(others, Instance))


def _model(data: Any, cls: type[BaseModel]) -> Any:
    # A default is no user's value: an infinite one, for no limit, would be refused as such.
    defaults = {field.alias or name: field.default for name, field in cls.model_fields.items()}
    given = {key: value for key, value in data.items() if value != defaults.get(key, ...)}
    try:
        return cls.model_validate(_members(given, cls))
    except ValidationError as error:
        raise PlanTextError(f"this is not a plan: {error.errors(include_url=False)[0]['msg']}") from error


def _members(data: Any, cls: Any) -> dict[str, Any]:
    hints = _hints(cls)
    if unknown := data.keys() - hints.keys():
        raise PlanTextError(f"this is not a plan: unknown '{min(unknown)}'"[:300])
    return {name: _decode(each, hints[name]) for name, each in data.items()}


@cache
def _hints(cls: Any) -> dict[str, Any]:
    """Return the types of the fields of a dataclass or a configuration by key, with their annotations."""
    hints = get_type_hints(cls, include_extras=True)
    return {key: hints[name] for key, name in _names(cls).items()}


@cache
def _names(cls: Any) -> dict[str, str]:
    """Return the names of the fields by key: the alias of a field that has one."""
    if issubclass(cls, BaseModel):
        return {field.alias or name: name for name, field in cls.model_fields.items()}
    return {field.name: field.name for field in fields(cls)}


def _metadata(hint: Any) -> tuple[Any, ...]:
    """Return the annotations of a type, including those within `... | None`."""
    if get_origin(hint) is Annotated:
        return (*hint.__metadata__, *_metadata(get_args(hint)[0]))
    alternative = _not_none(hint)
    return () if alternative is None else _metadata(alternative)


def _plain_hint(hint: Any) -> Any:
    """Return a type without its annotations and without `| None`."""
    while True:
        if get_origin(hint) is Annotated:
            hint = get_args(hint)[0]
        elif (alternative := _not_none(hint)) is not None:
            hint = alternative
        else:
            return hint


def _not_none(hint: Any) -> Any:
    """Return the only alternative to None; None if there is not exactly one, which is left to pydantic."""
    if get_origin(hint) not in (Union, types.UnionType):
        return None
    others = [argument for argument in get_args(hint) if argument is not type(None)]
    return others[0] if len(others) == 1 else None


def _item(hint: Any, index: int = 0) -> Any:
    """Return the type of the items of a list or set, or of the values of a map; for a tuple, that of item `index`."""
    arguments = get_args(hint)
    if not arguments:
        return Any
    if get_origin(hint) is tuple and arguments[-1] is not Ellipsis:
        return arguments[index]
    return arguments[0] if get_origin(hint) in (tuple, list, set, frozenset) else arguments[-1]
