"""Type hashes: the RIHS01 value that ROS 2 compares to check that two sides agree on a type (REP 2016).

It is the SHA-256 of a JSON text that lists the fields of a structure and of all structures inside it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from rbxcompose.msgs.definitions import FieldShape, FieldType, Structure

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
