"""The base of every configuration: a closed model with quantities, names, references, docstrings of fields."""

import ast
import inspect
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import pairwise
from operator import attrgetter
from typing import Annotated, Any, Literal, TypeVar, get_args

import pydantic
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from rbxcompose.base import units
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import need
from rbxcompose.base.units import Dimension, to_si

FieldDocs = Mapping[str, str]
_Classes = Mapping[str, FieldDocs]  # by qualified name


@cache
def field_docs(model: type) -> FieldDocs:
    """Return the docstring of each field that has one; that of an inherited field stands in the class that has it."""
    found: dict[str, str] = {}
    for cls in reversed(model.__mro__):
        own = _of_module(cls.__module__).get(cls.__qualname__, {})
        for name in inspect.get_annotations(cls):
            found[name] = own.get(name, "")
    return {name: text for name, text in found.items() if text}


@cache
def _of_module(name: str) -> _Classes:
    module = sys.modules.get(name)
    try:
        return dict(_of_body(ast.parse(inspect.getsource(module)).body, "")) if module is not None else {}
    except (OSError, TypeError):  # it has no source, as what is compiled or typed in has none
        return {}


def _of_body(body: list[ast.stmt], prefix: str) -> Iterator[tuple[str, FieldDocs]]:
    """Yield the fields of the classes in a body, at any depth."""
    for statement in body:
        if isinstance(statement, ast.ClassDef):
            name = f"{prefix}{statement.name}"
            yield name, dict(_of_class(statement.body))
            yield from _of_body(statement.body, f"{name}.")
        elif isinstance(statement, ast.FunctionDef):
            yield from _of_body(statement.body, f"{prefix}{statement.name}.<locals>.")


def _of_class(body: list[ast.stmt]) -> Iterator[tuple[str, str]]:
    for field, below in pairwise(body):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                yield name, "\n\n".join(" ".join(part.split()) for part in inspect.cleandoc(text).split("\n\n"))


COMPONENT, PLACE, VALUE, MISSION = "component", "place", "value", "mission"
ANALYZER, ARGUMENT, INSTANCE = "analyzer", "argument", "instance"
PORT = "port"
"""A component, or `component.port`."""
LINK, JOINT = "link", "joint"
"""A link or a joint of the body."""
SERVO_BUS, ACTUATOR, CONTROLLER = "servo bus", "actuator", "controller"
ARM, OBJECT = "arm", "object"
FAULT = "fault"
DEVICE, DEVICE_PORT = "device", "device port"
"""A device; its port, `dev:NAME`, in a field that takes paths, too."""
RUNNING = "running"
"""All components: those of the user and those of every robot."""
PUBLISHED, SERVICE = "published topic", "service"
"""A topic on which missions may publish; a service that they may call."""
TOPIC, FILE, ANYTHING = "topic", "file", "anything"
"""A topic; a path relative to the file that writes it; a word that may be a name of any kind."""

PREFIXED: Mapping[str, tuple[str, str]] = {DEVICE_PORT: ("dev:", DEVICE)}
"""Kinds of words that are a name behind a prefix, or something else: the prefix, and the kind of the name."""

NAMES = "x-names"
"""The schema keyword that gives the kind of a name."""
_HIDDEN = (TOPIC, ANYTHING)  # kinds whose names editors do not know

Known = Mapping[str, Mapping[str, object]]
"""The context of a validation: kind of name -> name -> its meaning."""
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Refers:
    """Marks a field that takes the name of something; `kind` is the kind of thing it names.

    A name that does not exist is a finding if the validation context knows the names of that kind, unless a check
    reports it in more detail (`is_reported`). A field that is not text holds the thing named.
    """

    kind: str
    is_reported: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: pydantic.GetCoreSchemaHandler) -> CoreSchema:
        if self.is_reported:
            return handler(source)
        if isinstance(source, type) and not issubclass(source, str):
            word = core_schema.str_schema()
            return core_schema.with_info_before_validator_function(
                self._thing(source), core_schema.is_instance_schema(source), json_schema_input_schema=word
            )
        return core_schema.with_info_after_validator_function(self._name, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: pydantic.GetJsonSchemaHandler
    ) -> dict[str, Any]:
        made = handler(schema)
        return made if self.kind in _HIDDEN else {**made, NAMES: self.kind}

    def _name(self, name: str, info: pydantic.ValidationInfo) -> str:
        """Return the name if it exists."""
        known: Known = {} if info.context is None else info.context
        prefix, kind = PREFIXED.get(self.kind, ("", self.kind))
        if name.startswith(prefix) and kind in known and name.removeprefix(prefix) not in known[kind]:
            raise self._unknown(name, {f"{prefix}{one}": one for one in known[kind]} if prefix else known[kind])
        return name

    def _thing(self, wanted: type[T]) -> Callable[[object, pydantic.ValidationInfo], object]:
        """Return the function that replaces a name with the thing it names."""

        def find(value: object, info: pydantic.ValidationInfo) -> object:
            if isinstance(value, wanted):
                return value
            if not isinstance(value, str):
                raise PydanticCustomError(self.kind, "must be the name of a {kind}", {"kind": self.kind})
            there = ({} if info.context is None else info.context).get(self.kind, {})
            if value not in there:
                raise self._unknown(value, there)
            return there[value]

        return find

    def _unknown(self, name: str, there: Mapping[str, object]) -> PydanticCustomError:
        valid = there if self.kind in (LINK, JOINT) else list(there)  # theirs are known, others may be being read
        prefix, kind = PREFIXED.get(self.kind, ("", self.kind))
        context: dict[str, object] = {"kind": kind, "name": name}
        if prefix and not there:
            own = name.removeprefix(prefix)
            context["help"] = f"add '{own}' below '{plural(kind)}', or write a path such as '/dev/ttyUSB0'"
        else:
            context |= {"valid": valid, "what": f"{plural(kind)} of this robot"}
        return PydanticCustomError(self.kind, "there is no {kind} '{name}'", context)


def plural(kind: str) -> str:
    """Return the plural of a kind."""
    return f"{kind}{'es' if kind.endswith(('s', 'x', 'ch')) else 's'}"


class Config(pydantic.BaseModel):
    """A closed, frozen set of fields; a key that it does not declare is a finding."""

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", defer_build=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: pydantic.GetJsonSchemaHandler) -> dict[str, Any]:
        made = handler(schema)
        properties = handler.resolve_ref_schema(made).get("properties", {})
        for name, text in field_docs(cls).items():
            shown = properties.get(cls.model_fields[name].alias or name) if name in cls.model_fields else None
            if shown is not None:
                shown.setdefault("description", text)
        return made


C = TypeVar("C", bound=Config)


@dataclass(frozen=True, slots=True)
class Dimensioned:
    """Marks a field as a quantity, for findings and schemas."""

    dimension: Dimension


@dataclass(frozen=True, slots=True)
class Bound:
    """Limits of a setting beside those of its field, in SI, and what sets them."""

    least: float | None
    most: float | None
    by: str


@dataclass(frozen=True, slots=True)
class Live:
    """Marks a field that may change while the robot runs: `speed: Annotated[Speed, Live()] = 0.3`."""


class Replaceable:
    """Marks a field that `apply` changes while the robot runs; unlike a live one, it is no parameter."""


def is_live(field: FieldInfo) -> bool:
    """Return whether a field may change while the robot runs."""
    return any(isinstance(mark, Live) for mark in field.metadata)


def may_be_applied(field: FieldInfo) -> bool:
    """Return whether `apply` may change a field without a restart."""
    return any(isinstance(mark, Live | Replaceable) for mark in field.metadata)


def leaves(config: Config) -> Iterator[tuple[str, FieldInfo]]:
    """Yield the fields that are no groups of fields themselves, each by its dotted name: `pid.p`."""
    for name, model_field in type(config).model_fields.items():
        if isinstance(value := getattr(config, name), Config):
            yield from ((f"{name}.{below}", field) for below, field in leaves(value))
        else:
            yield name, model_field


def value_at(config: Config, name: str) -> Any:
    """Return the value of a field by its dotted name."""
    return attrgetter(name)(config)


def key_of(config: Config, name: str) -> str:
    """Return what a manifest calls a field, by its dotted name."""
    head, _, below = name.partition(".")
    key = type(config).model_fields[head].alias or head
    return f"{key}.{key_of(getattr(config, head), below)}" if below else key


def with_values(config: C, values: Mapping[str, object]) -> C:
    """Return a configuration with other values of fields by their dotted names; they are not validated."""
    for name, value in values.items():
        head, _, below = name.partition(".")
        inner = with_values(getattr(config, head), {below: value}) if below else value
        config = config.model_copy(update={head: inner})
    for name in config.__dict__.keys() - type(config).model_fields.keys():
        del config.__dict__[name]  # computed from the values before
    return config


def live_names(model: type[Config], above: str = "") -> Iterator[str]:
    """Yield the dotted names of the fields of a model that may change while the robot runs, also within groups."""
    for name, field in model.model_fields.items():
        if is_live(field):
            yield f"{above}{name}"
        for hint in (field.annotation, *get_args(field.annotation)):
            if isinstance(hint, type) and issubclass(hint, Config):
                yield from live_names(hint, f"{above}{name}.")


def _reads(dimension: Dimension) -> pydantic.BeforeValidator:
    def read(value: object) -> float:
        return to_si(value, dimension)

    shape = Annotated[Any, pydantic.WithJsonSchema({"x-dimension": dimension.name})]
    return pydantic.BeforeValidator(read, json_schema_input_type=shape)


Length = Annotated[float, _reads(units.LENGTH), Dimensioned(units.LENGTH)]
Mass = Annotated[float, _reads(units.MASS), Dimensioned(units.MASS)]
Time = Annotated[float, _reads(units.TIME), Dimensioned(units.TIME)]
Speed = Annotated[float, _reads(units.SPEED), Dimensioned(units.SPEED)]
Acceleration = Annotated[float, _reads(units.ACCELERATION), Dimensioned(units.ACCELERATION)]
Angle = Annotated[float, _reads(units.ANGLE), Dimensioned(units.ANGLE)]
AngularSpeed = Annotated[float, _reads(units.ANGULAR_SPEED), Dimensioned(units.ANGULAR_SPEED)]
AngularAcceleration = Annotated[float, _reads(units.ANGULAR_ACCELERATION), Dimensioned(units.ANGULAR_ACCELERATION)]
Jerk = Annotated[float, _reads(units.JERK), Dimensioned(units.JERK)]
AngularJerk = Annotated[float, _reads(units.ANGULAR_JERK), Dimensioned(units.ANGULAR_JERK)]
Frequency = Annotated[float, _reads(units.FREQUENCY), Dimensioned(units.FREQUENCY)]
Temperature = Annotated[float, _reads(units.TEMPERATURE), Dimensioned(units.TEMPERATURE)]
BitRate = Annotated[float, _reads(units.BIT_RATE), Dimensioned(units.BIT_RATE)]
Ratio = Annotated[float, _reads(units.RATIO), Dimensioned(units.RATIO)]

Name = Annotated[str, pydantic.StringConstraints(pattern=r"^[a-z][a-z0-9_]*$", max_length=60)]


@dataclass(frozen=True, slots=True)
class Place:
    """A named pose in `map` [m, m, rad], and how viewers draw it."""

    name: str
    x: float
    y: float
    heading: float
    colour: str = ""


class Secret:
    """Text that is never shown: it prints and dumps as `***`. `reveal()` returns it.

    `name` is its name in the manifest: `${secret.NAME}`.
    """

    __slots__ = ("_text", "name")

    def __init__(self, text: str, name: str = "") -> None:
        self._text = text
        self.name = name

    def reveal(self) -> str:
        """Return the text, to pass it to the device or service that needs it."""
        return self._text

    def __str__(self) -> str:
        return HIDDEN

    __repr__ = __str__

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Secret) and other._text == self._text

    def __hash__(self) -> int:
        return hash(self._text)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: pydantic.GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            _secret,
            serialization=core_schema.plain_serializer_function_ser_schema(str, when_used="json"),
            json_schema_input_schema=core_schema.str_schema(),
        )


HIDDEN = "***"


def _secret(value: object) -> Secret:
    if not isinstance(value, Secret):
        help_text = "write '${secret.NAME}', and put it into the file 'secrets/NAME'"
        raise PydanticCustomError("secret", "a secret does not belong in a manifest", {"help": help_text})
    return value


FOLDER, CONTENTS = "folder", "contents"
"""By which validators of a component know the folder of the manifest's file, and the contents of its sections."""


def in_folder(value: object, info: pydantic.ValidationInfo) -> object:
    """Return a path relative to the folder of the manifest's file as a whole one."""
    there = (info.context or {}).get(FOLDER)
    return os.path.normpath(os.path.join(str(there), value)) if there and isinstance(value, str) and value else value


def bundle_path(path: str, info: pydantic.ValidationInfo) -> str:
    """Let a file, or all that is in a folder, travel to other hosts with the manifest; return the path.

    What is not there, or not in the project, is expected on the host.
    """
    if there := (info.context or {}).get(FOLDER):
        need(str(there), os.path.relpath(path, str(there)))
    return path


LocalPath = Annotated[str, pydantic.BeforeValidator(in_folder)]
"""A field that names a file or a folder, relative to that of the manifest's file; it holds the whole path."""
LocalFiles = Annotated[LocalPath, pydantic.AfterValidator(bundle_path)]
"""The same, for a file that travels to other hosts with the manifest, or a folder with all that is in it."""
PlaceName = Annotated[Place, Refers(PLACE)]
"""A field that names one of the robot's `places` and holds the place itself."""
LinkName = Annotated[str, Refers(LINK)]
"""A field that names a link of the robot's body."""
JointName = Annotated[str, Refers(JOINT)]
"""A field that names a joint of the robot's body."""


When = Literal["on_failure", "always", "never"]


class Restart(Config):
    """When a failed component is restarted."""

    when: When = "on_failure"
    """`on_failure` ends the robot after `max` failures, `always` keeps trying, `never` leaves it failed."""
    max: int = pydantic.Field(5, ge=1, le=100)
    """Number of failures within `within` after which it is not restarted again."""
    within: Time = pydantic.Field(60.0, gt=0)
    """The time in which failures are counted."""
    backoff: Time = pydantic.Field(0.1, ge=0)
    """The pause before the first try; each failure in a row doubles it."""


DEFAULT = Restart()
"""The policy if a manifest gives none."""


def require_possible(host: str) -> str:
    """Return a name or an address of a machine as it is.

    Raises:
        ValueError: if it looks like an address and is none, such as 10.42.0.300.
    """
    if re.fullmatch(r"[0-9.]+|[0-9A-Fa-f:.]*:[0-9A-Fa-f:.]*", host):  # it can be no name
        import ipaddress  # most robots name no machine

        try:
            ipaddress.ip_address(host)
        except ValueError as error:
            raise ValueError(
                f"'{host}' is no address: it has four numbers from 0 to 255, such as 10.42.0.2, or is one of IPv6"
            ) from error
    return host
