import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.msgs.definitions import (
    INTERFACES,
    PRIMITIVES,
    DefinitionError,
    FieldShape,
    FieldType,
    interface_names,
    parse,
    parse_type,
    read,
)
from tests.loops import for_all
from tests.msgs.samples import JAZZY, STRUCTURES, description

SHARED = sorted(set(JAZZY.fielddefs) & set(interface_names("msg")))


@for_all("name", SHARED)
def test_our_text_has_the_fields_and_constants_of_jazzy(name: str) -> None:
    constants, fields = JAZZY.fielddefs[name][:2]
    (ours,) = read(name)
    expected = [(field, kind) for field, kind in fields if field != "structure_needs_at_least_one_member"]
    assert [(field.name, description(field.type)) for field in ours.fields] == expected
    assert {constant.name: constant.value for constant in ours.constants} == {
        name: value for name, _, value in constants
    }


def test_most_of_our_messages_can_be_compared_with_jazzy() -> None:
    theirs = ("control_msgs/", "moveit_msgs/", "object_recognition_msgs/", "octomap_msgs/", "vision_msgs/")
    rare = (*theirs, "people_msgs/", "rbxcompose_msgs/", "rbxcompose_parameters/")
    others = {name for name in interface_names("msg") if name.startswith(rare)} | {"nav_msgs/msg/Goals"}  # newer
    assert set(interface_names("msg")) - set(SHARED) == others


types = st.builds(
    FieldType,
    st.sampled_from([base for base in PRIMITIVES if base != "string"] + ["std_msgs/msg/Header"]),
    st.just(FieldShape.SINGLE) | st.just(FieldShape.UNBOUNDED),
) | st.builds(
    FieldType,
    st.just("string"),
    st.just(FieldShape.ARRAY) | st.just(FieldShape.BOUNDED),
    st.integers(1, 99),
    st.integers(0, 99),
)


@given(types)
def test_a_type_is_read_as_it_is_written(type_: FieldType) -> None:
    assert parse_type(str(type_)) == type_


def test_a_bare_name_is_a_message_of_the_same_package() -> None:
    assert parse_type("Point[2]", "geometry_msgs") == FieldType("geometry_msgs/msg/Point", FieldShape.ARRAY, 2)


def test_comments_and_quotes_do_not_disturb_each_other() -> None:
    (structure,) = parse("a/msg/B", "# What it is.\nstring x 'a # b'  # don't\nint8 y -3\nstring Z=\"q\"\n")
    assert structure.comment == "What it is."
    assert [(field.default, field.comment) for field in structure.fields] == [("a # b", "don't"), (-3, "")]
    assert [(constant.name, constant.value) for constant in structure.constants] == [("Z", "q")]


@for_all(
    "line, why",
    [
        ("flaot32 x", "no such type: 'flaot32'"),
        ("wstring x", "'wstring' is not supported: use 'string', which is UTF-8"),
        ("wchar x", "no such type: 'wchar'"),
        ("int8<=3 x", "no such type: 'int8<=3'"),
        ("int8[<=] x", "a bound without a number: 'int8[<=]'"),
        ("int8", "neither a field nor a constant: 'int8'"),
        ("int8 X=1.5", "invalid literal"),
        ("bool x maybe", "not a truth value: 'maybe'"),
        ("int8[2] x 3", "the default of int8[2] is a list in brackets"),
        ("int8[2] x [3]", "1 values where int8[2] is expected"),
        ("Point x 3", "a/msg/Point cannot have a value here"),
        ("string x 'abc", "a quote is not closed"),
    ],
)
def test_a_wrong_line_is_named(line: str, why: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse("a/msg/B", f"int8 good\n{line}\n")
    assert str(caught.value).startswith(f"a/msg/B, line 2: {why}")


def test_an_interface_with_a_part_too_few_is_refused() -> None:
    with pytest.raises(DefinitionError, match=r"a/srv/B: a \.srv file has 2 parts with '---' between them, not 1"):
        parse("a/srv/B", "int8 x\n")


def test_every_message_that_a_text_names_has_a_text() -> None:
    used = {field.type.base for structure in STRUCTURES.values() for field in structure.fields if field.type.is_message}
    assert used <= set(STRUCTURES)


def test_interface_texts_lie_in_the_folder_of_their_kind() -> None:
    found = {path.relative_to(INTERFACES).as_posix() for path in INTERFACES.rglob("*.*")}
    assert all(path.split("/")[1] == path.rsplit(".", 1)[1] for path in found)
