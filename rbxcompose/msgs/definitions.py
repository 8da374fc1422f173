"""Interface definitions: the ROS 2 text of a message, service or action as data, and its type hash."""

import hashlib
import json
import keyword
import re
from collections.abc import Iterator, Mapping
from dataclasses import field as dataclass_field
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rbxcompose.base.dataclass import dataclass

INTERFACES = Path(__file__).with_name("interfaces")  # <package>/<kind>/<Name>.<kind>
KINDS = ("msg", "srv", "action")
INTEGERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
FLOATS = ("float32", "float64")
OCTETS = ("uint8", "byte", "char")  # arrays of these are bytes in Python
RANGES = {
    **dict.fromkeys(OCTETS, (0, 255)),
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
}
PRIMITIVES = ("bool", "byte", "char", *INTEGERS, *FLOATS, "string")

_TYPE = re.compile(r"(?P<base>[A-Za-z][\w/]*)(?:<=(?P<limit>\d+))?(?P<array>\[(?P<most><=)?(?P<length>\d*)\])?")
_CONSTANT = re.compile(r"(?P<type>\S+)\s+(?P<name>[A-Z][A-Z0-9_]*)\s*=\s*(?P<value>.+)")
_FIELD = re.compile(r"(?P<type>\S+)\s+(?P<name>[a-z][a-z0-9_]*)(?:\s+(?P<default>\S.*))?")
_CODE_AND_COMMENT = re.compile(r"""(?P<code>(?:"[^"]*"|'[^']*'|[^#"'])*)(?:#\s?(?P<comment>.*))?""")
_ITEM = re.compile(r"""(?:"[^"]*+"|'[^']*+'|[^,\s"'][^,"']*+)""")  # of a list of defaults
_DOUBTFUL = re.compile(r"__|_$")  # what ROS has in no name
_TAKEN = ("self", "TYPE", "HASH", "FIELDS", "ARRAYS", "CLASSES")
_TRUTH = {"true": True, "1": True, "false": False, "0": False}

Value = bool | int | float | str
Default = Value | tuple[Value, ...]


class DefinitionError(ValueError):
    """Raised when an interface text is not valid ROS 2, in a line if `line` is not 0; `problem` is what is wrong."""

    def __init__(self, problem: str, name: str = "", line: int = 0) -> None:
        where = f"{name}, line {line}: " if line else f"{name}: " if name else ""
        super().__init__(f"{where}{problem}")
        self.problem, self.line = problem, line


class FieldShape(Enum):
    """How many values a field holds."""

    SINGLE = "one"
    ARRAY = "exactly `length`"
    BOUNDED = "at most `length`"
    UNBOUNDED = "any number"


@dataclass(frozen=True, slots=True)
class FieldType:
    """The type of a field: `base` is a primitive or the full name of a message."""

    base: str
    shape: FieldShape = FieldShape.SINGLE
    length: int = 0  # of an array or bounded sequence
    text_limit: int = 0  # maximum bytes of a string, 0: any number

    @property
    def is_message(self) -> bool:
        """Return whether the values are messages."""
        return self.base not in PRIMITIVES

    def __str__(self) -> str:
        limit = f"<={self.text_limit}" if self.text_limit else ""
        most = {
            FieldShape.ARRAY: f"[{self.length}]",
            FieldShape.BOUNDED: f"[<={self.length}]",
            FieldShape.UNBOUNDED: "[]",
        }
        return f"{self.base}{limit}{most.get(self.shape, '')}"


@dataclass(frozen=True, slots=True)
class Constant:
    """A named value of a structure."""

    name: str
    value: Value
    comment: str = ""


@dataclass(frozen=True, slots=True)
class FieldDefinition:
    """A field of a structure; without a default of its own, it is zero, empty or false."""

    name: str
    type: FieldType
    default: Default | None = None
    comment: str = ""
    line: int = dataclass_field(default=0, compare=False)  # where its text has it


@dataclass(frozen=True, slots=True)
class Structure:
    """A unit that CDR writes: a message, or one part of a service or an action."""

    name: str  # such as "geometry_msgs/msg/Twist" or "std_srvs/srv/SetBool_Request"
    fields: tuple[FieldDefinition, ...] = ()
    constants: tuple[Constant, ...] = ()
    comment: str = ""


def attribute(field: str) -> str:
    """Return the Python name of a field or constant: the same, with an underscore appended to a word that is taken."""
    return f"{field}_" if keyword.iskeyword(field) or field in _TAKEN else field


def parse_type(text: str, package: str = "") -> FieldType:
    """Read a type such as `float64[36]`, `string<=8[]` or `Point`; a bare message name belongs to `package`.

    Raises:
        DefinitionError: if there is no such type.
    """
    found = _TYPE.fullmatch(text)
    base = found["base"] if found else ""
    if base == "wstring":
        raise DefinitionError("'wstring' is not supported: use 'string', which is UTF-8")
    if not found or (found["limit"] and base != "string"):
        raise DefinitionError(f"no such type: {text!r}")
    if found["most"] and not found["length"]:
        raise DefinitionError(f"a bound without a number: {text!r}")
    shape = FieldShape.SINGLE
    if found["array"]:
        shape = FieldShape.BOUNDED if found["most"] else FieldShape.ARRAY if found["length"] else FieldShape.UNBOUNDED
    full = base if base in PRIMITIVES else _full_name(base, package)
    return FieldType(full, shape, int(found["length"] or 0), int(found["limit"] or 0))


def _full_name(name: str, package: str) -> str:
    match name.split("/"):
        case [bare] if package and bare[0].isupper():
            return f"{package}/msg/{bare}"
        case [owner, bare]:
            return f"{owner}/msg/{bare}"
        case [_, _, _]:
            return name
    raise DefinitionError(f"no such type: {name!r}")


def parse(name: str, text: str) -> tuple[Structure, ...]:
    """Read an interface text: one structure for a message, two for a service, three for an action.

    Raises:
        DefinitionError: names the interface and the line.
    """
    kind = name.split("/")[1]
    endings = {"msg": ("",), "srv": ("_Request", "_Response"), "action": ("_Goal", "_Result", "_Feedback")}[kind]
    sections: list[list[tuple[int, str]]] = [[]]
    for number, line in enumerate(text.split("\n"), 1):
        if line.rstrip() == "---":
            sections.append([])
        else:
            sections[-1].append((number, line))
    if len(sections) != len(endings):
        words = f"a .{kind} file has {len(endings)} parts with '---' between them, not {len(sections)}"
        raise DefinitionError(words if len(endings) > 1 else "a .msg file has no '---'", name)
    return tuple(_structure(name + ending, lines) for ending, lines in zip(endings, sections, strict=True))


def _structure(name: str, lines: list[tuple[int, str]]) -> Structure:
    heading: list[str] = []
    members: dict[str, Constant | FieldDefinition] = {}
    for number, line in lines:
        try:
            code, comment = _split(line)
            if code:
                member = _member(code, comment, name.split("/")[0], number)
                if members.setdefault(member.name, member) is not member:
                    raise DefinitionError(f"there is a second '{member.name}'")
            elif comment and not members:
                heading.append(comment)
        except ValueError as error:
            raise DefinitionError(str(error), name, number) from error
    fields = tuple(member for member in members.values() if isinstance(member, FieldDefinition))
    constants = tuple(member for member in members.values() if isinstance(member, Constant))
    return Structure(name, fields, constants, " ".join(heading))


def code_of(line: str) -> str:
    """Return what stands in a line before a comment; empty if that cannot be told."""
    found = _CODE_AND_COMMENT.fullmatch(line)
    return found["code"].strip() if found else ""


def _split(line: str) -> tuple[str, str]:
    found = _CODE_AND_COMMENT.fullmatch(line)
    if not found:
        raise DefinitionError("a quote is not closed")
    return found["code"].strip(), (found["comment"] or "").strip()


def _member(code: str, comment: str, package: str, line: int) -> Constant | FieldDefinition:
    if constant := _CONSTANT.fullmatch(code):
        return Constant(constant["name"], _value(parse_type(constant["type"]), constant["value"]), comment)
    field = _FIELD.fullmatch(code)
    if field and not _DOUBTFUL.search(field["name"]):
        type_ = parse_type(field["type"], package)
        default = _default(type_, field["default"]) if field["default"] else None
        return FieldDefinition(field["name"], type_, default, comment, line)
    raise DefinitionError(f"neither a field nor a constant: {code!r}")


def _default(type_: FieldType, text: str) -> Default:
    """Return the default of a field: of several values, they stand in brackets."""
    if type_.shape is FieldShape.SINGLE or type_.is_message:
        return _value(type_, text)
    if text[0] != "[" or text[-1] != "]":
        raise DefinitionError(f"the default of {type_} is a list in brackets")
    values = tuple(_value(FieldType(type_.base), found.group().strip()) for found in _ITEM.finditer(text[1:-1]))
    if type_.length and (
        len(values) > type_.length or (type_.shape is FieldShape.ARRAY and len(values) < type_.length)
    ):
        raise DefinitionError(f"{len(values)} values where {type_} is expected")
    return values


def _value(type_: FieldType, text: str) -> Value:
    if type_.shape is not FieldShape.SINGLE or type_.is_message:
        raise DefinitionError(f"{type_} cannot have a value here")
    if type_.base == "string":
        return text[1:-1] if text[0] == text[-1] and text[0] in "\"'" and len(text) > 1 else text
    if type_.base == "bool":
        if text.lower() not in _TRUTH:
            raise DefinitionError(f"not a truth value: {text!r}")
        return _TRUTH[text.lower()]
    if type_.base in FLOATS:
        return float(text)
    number, (low, high) = int(text, 0), RANGES[type_.base]
    if not low <= number <= high:
        raise DefinitionError(f"{number} is no {type_}")
    return number


def parts(name: str, written: tuple[Structure, ...]) -> dict[str, Structure]:
    """Return all structures of an interface by name: the `written` ones, and those that ROS derives."""
    kind = name.split("/")[1]
    derived = {"msg": _no_more, "srv": _service, "action": _action}[kind](name)
    return {structure.name: structure for structure in (*written, *derived)}


def _no_more(_name: str) -> Iterator[Structure]:
    return iter(())


def _service(name: str) -> Iterator[Structure]:
    request, response = f"{name}_Request", f"{name}_Response"
    yield _of(
        f"{name}_Event", info="service_msgs/ServiceEventInfo", request=f"{request}[<=1]", response=f"{response}[<=1]"
    )
    yield _of(name, request_message=request, response_message=response, event_message=f"{name}_Event")


def _action(name: str) -> Iterator[Structure]:
    goal, result, feedback, identity = (
        f"{name}_Goal",
        f"{name}_Result",
        f"{name}_Feedback",
        "unique_identifier_msgs/UUID",
    )
    send_goal, get_result, message = f"{name}_SendGoal", f"{name}_GetResult", f"{name}_FeedbackMessage"
    yield _of(f"{send_goal}_Request", goal_id=identity, goal=goal)
    yield _of(f"{send_goal}_Response", accepted="bool", stamp="builtin_interfaces/Time")
    yield from _service(send_goal)
    yield _of(f"{get_result}_Request", goal_id=identity)
    yield _of(f"{get_result}_Response", status="int8", result=result)
    yield from _service(get_result)
    yield _of(message, goal_id=identity, feedback=feedback)
    yield _of(
        name,
        goal=goal,
        result=result,
        feedback=feedback,
        send_goal_service=send_goal,
        get_result_service=get_result,
        feedback_message=message,
    )


def _of(structure: str, **types: str) -> Structure:
    return Structure(structure, tuple(FieldDefinition(name, parse_type(text)) for name, text in types.items()))


def interface_names(kind: str, root: Path = INTERFACES) -> list[str]:
    """Return the sorted names of all interfaces of a kind whose text lies below `root`."""
    return sorted(f"{path.parts[-3]}/{kind}/{path.stem}" for path in root.glob(f"*/{kind}/*.{kind}"))


def read(name: str, root: Path = INTERFACES) -> tuple[Structure, ...]:
    """Read the structures written in the text of an interface."""
    package, kind, bare = name.split("/")
    return parse(name, (root / package / kind / f"{bare}.{kind}").read_text(encoding="utf-8"))


class Structures(dict[str, Structure]):
    """Every structure of the standard interfaces, and of `own` texts; a text is read when one of it is asked for."""

    def __init__(self, own: Mapping[str, str] = MappingProxyType({})) -> None:
        super().__init__()
        self._own = own

    def __missing__(self, name: str) -> Structure:
        interface = interface_of(name)
        own = self._own.get(interface)
        try:
            found = parts(interface, read(interface) if own is None else parse(interface, own))
        except OSError as error:
            raise KeyError(name) from error
        self.update(found)
        return found[name]

    def __contains__(self, name: object) -> bool:
        try:
            return bool(self[str(name)])
        except KeyError:
            return False


def interface_of(structure: str) -> str:
    """Return the interface of which a structure is a part."""
    package, kind, bare = structure.split("/")
    return f"{package}/{kind}/{bare.split('_')[0]}"


_MESSAGE = 1
_BOUNDED_TEXT = 21
_IDS = {
    "int8": 2,
    "uint8": 3,
    "char": 3,  # an unsigned byte in ROS 2, unlike the CHAR (13) of the type description
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
}
_OFFSETS = {FieldShape.SINGLE: 0, FieldShape.ARRAY: 48, FieldShape.BOUNDED: 96, FieldShape.UNBOUNDED: 144}
# An empty structure would take no room on the wire, so ROS gives it one byte.
_PLACEHOLDER = ("structure_needs_at_least_one_member", FieldType("uint8"))


def type_hash(name: str, structures: Mapping[str, Structure]) -> str:
    """Return the hash of the structure `name`, `RIHS01_` and 64 hexadecimal digits.

    Raises:
        KeyError: if `structures` lacks it or one inside it.
    """
    described = {used: _describe(structures[used]) for used in sorted(_uses(name, structures))}
    own = described.pop(name)
    text = json.dumps({"type_description": own, "referenced_type_descriptions": list(described.values())})
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


def _uses(name: str, structures: Mapping[str, Structure]) -> set[str]:
    used: set[str] = set()
    left = [name]
    while left:
        found = left.pop()
        if found not in used:
            used.add(found)
            left += [field.type.base for field in structures[found].fields if field.type.is_message]
    return used


def _describe(structure: Structure) -> dict[str, Any]:
    fields = [(field.name, field.type) for field in structure.fields] or [_PLACEHOLDER]
    return {
        "type_name": structure.name,
        "fields": [{"name": name, "type": _describe_type(type_)} for name, type_ in fields],
    }


def _describe_type(type_: FieldType) -> dict[str, Any]:
    base = _MESSAGE if type_.is_message else _BOUNDED_TEXT if type_.text_limit else _IDS[type_.base]
    return {
        "type_id": base + _OFFSETS[type_.shape],
        "capacity": type_.length,
        "string_capacity": type_.text_limit,
        "nested_type_name": type_.base if type_.is_message else "",
    }
