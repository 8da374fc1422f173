"""Shared by the tests of messages: every message class, values for each, and rosbags as an independent oracle."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from rbxcompose.msgs.arrays import holds_numbers
from rbxcompose.msgs.classes import make_class
from rbxcompose.msgs.definitions import OCTETS, FieldShape, FieldType, attribute, parse, parse_type, parts
from rbxcompose.msgs.generate import all_structures
from rbxcompose.msgs.types import Message, declared

SAMPLES = {  # every kind of field, and a keyword as a name
    "rbx_samples/msg/Nothing": "",
    "rbx_samples/msg/Small": "uint8 flag\nfloat64 value\nstring text",
    "rbx_samples/msg/Everything": """
        bool yes true
        byte octet
        char letter
        int8 a -1
        uint16 b
        int64 c
        float32 d 0.5
        string e "with # in it"
        string<=5 short
        Nothing nothing
        uint8 from
        uint8[3] rgb
        byte[] data
        bool[] flags
        bool[2] switches
        int16[] shorts
        uint8 between
        float64[3] vector
        uint32[<=4] few
        string[] words
        string<=3[<=2] codes
        string[2] pair
        Small[] smalls
        Small[2] two
        int16[<=3] some [1, -2]
        uint8[2] octets [1, 255]
        string[] names ["a", 'b, c', d]
        bool[2] bits [true, False]
        Nothing[] nothings
    """,
    "rbx_samples/action/Fibonacci": "int32 order\n---\nint32[] sequence\n---\nint32[] sequence",
}
STRUCTURES = all_structures()
for _name, _text in SAMPLES.items():
    STRUCTURES |= parts(_name, parse(_name, _text))


def _messages() -> list[type[Message]]:
    """Return all messages of our interfaces and of the samples, parts of services and actions as well."""
    for name in STRUCTURES:
        if "_" not in name.split("/")[2]:
            make_class(name, STRUCTURES, "tests.msgs" if name.startswith("rbx_samples/") else "rbxcompose.msgs")
    return [found for name, found in sorted(declared.items()) if name in STRUCTURES and issubclass(found, Message)]


MESSAGES = _messages()
EVERYTHING: Any = declared["rbx_samples/msg/Everything"]
INTEGERS = {
    "byte": (0, 127),  # rosbags takes it for signed
    "char": (0, 255),
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
}


def instances(message: type[Message]) -> st.SearchStrategy[Any]:
    """Return a strategy for messages of a class with any values."""
    fields = {attribute(name): _values(parse_type(text)) for name, text in message.FIELDS.items()}
    return st.builds(message, **fields)


def any_message() -> st.SearchStrategy[Any]:
    """Return a strategy for messages of any class."""
    return st.sampled_from(MESSAGES).flatmap(instances)


def _values(type_: FieldType) -> st.SearchStrategy[Any]:
    strategy = _one(type_)
    if type_.shape is FieldShape.SINGLE:
        return strategy
    least = type_.length if type_.shape is FieldShape.ARRAY else 0
    most = 4 if type_.shape is FieldShape.UNBOUNDED else type_.length
    if holds_numbers(type_):
        return st.lists(strategy, min_size=least, max_size=most).map(lambda values: np.array(values, type_.base))
    if type_.base in OCTETS:
        return st.binary(min_size=least, max_size=most)
    return st.lists(strategy, min_size=least, max_size=most).map(tuple)


def _one(type_: FieldType) -> st.SearchStrategy[Any]:
    if type_.is_message:
        return instances(declared[type_.base])
    if type_.base in INTEGERS:
        return st.integers(*INTEGERS[type_.base])
    if type_.base == "bool":
        return st.booleans()
    if type_.base == "string":
        codec = "ascii" if type_.text_limit else "utf-8"  # the limit counts bytes
        return st.text(st.characters(codec=codec), max_size=type_.text_limit or 6)
    return st.floats(width=32 if type_.base == "float32" else 64, allow_nan=False)


def description(type_: FieldType) -> Any:
    pair = (Nodetype.NAME, type_.base) if type_.is_message else (Nodetype.BASE, (type_.base, type_.text_limit))
    if type_.shape is FieldShape.SINGLE:
        return pair
    return (Nodetype.ARRAY if type_.shape is FieldShape.ARRAY else Nodetype.SEQUENCE, (pair, type_.length))


def _oracle() -> Typestore:
    store = get_typestore(Stores.EMPTY)
    nothing: Any = [("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0)))]
    for message in MESSAGES:
        fields = [(name, description(parse_type(text))) for name, text in message.FIELDS.items()]
        store.register({message.TYPE: ([], fields or nothing)})
    return store


ORACLE = _oracle()
JAZZY = get_typestore(Stores.ROS2_JAZZY)


def oracle_encode(message: Message) -> bytes:
    """Return what rosbags writes for a message."""
    return bytes(ORACLE.serialize_cdr(_foreign(message), message.TYPE, little_endian=True))


def _foreign(message: Message) -> Any:
    values = [_foreign_value(getattr(message, attribute(n)), parse_type(t)) for n, t in message.FIELDS.items()]
    return ORACLE.types[message.TYPE](*(values or [0]))


def _foreign_value(value: Any, type_: FieldType) -> Any:
    if type_.shape is FieldShape.SINGLE:
        return _foreign(value) if type_.is_message else value
    if type_.base in OCTETS:
        return np.frombuffer(value, np.uint8)
    if type_.base == "bool":
        return np.array(value, bool)
    return [_foreign(element) for element in value] if type_.is_message else value
