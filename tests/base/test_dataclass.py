"""A dataclass made here does what one of the standard library does."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field, fields, is_dataclass, replace
from typing import Any, ClassVar, get_type_hints

import pytest

from rbxcompose.base.dataclass import dataclass

Decorate = Callable[..., Callable[[type], Any]]
OPTIONS: tuple[dict[str, bool], ...] = tuple(
    {"frozen": frozen, "slots": slots, "eq": eq}
    for frozen in (False, True)
    for slots in (False, True)
    for eq in (False, True)
)
both = pytest.mark.parametrize("decorate", [dataclasses.dataclass, dataclass], ids=["standard", "ours"])
each = pytest.mark.parametrize("options", OPTIONS, ids=lambda options: "-".join(key for key in options if options[key]))


def made(decorate: Decorate, **options: bool) -> Any:
    @decorate(**options)
    class Toy:
        """A toy."""

        kind: ClassVar[str] = "toy"
        name: str
        size: float = 1.0
        parts: list[str] = field(default_factory=list, repr=False)
        serial: int = field(default=7, init=False, compare=False)
        seen: dict[str, int] = field(default_factory=dict, init=False, hash=False)
        colour: str = field(default="red", kw_only=True)

        def __post_init__(self) -> None:
            if self.size < 0.0:
                raise ValueError("too small")

    return Toy


@dataclass(frozen=True, slots=True)
class Point:
    """At the top of a module, where pickle finds it."""

    x: float
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class Named(Point):
    """It inherits fields."""

    name: str = ""


@dataclass(frozen=True)
class Empty:
    """It has no field."""


@both
@each
def test_objects_are_created_shown_and_compared_alike(decorate: Decorate, options: dict[str, bool]) -> None:
    toy = made(decorate, **options)
    one = toy("ball", 2.0, ["skin"], colour="blue")
    assert (one.name, one.size, one.parts, one.serial, one.seen, one.colour) == ("ball", 2.0, ["skin"], 7, {}, "blue")
    assert repr(one).endswith("Toy(name='ball', size=2.0, serial=7, seen={}, colour='blue')")
    assert (one == toy("ball", 2.0, ["skin"], colour="blue")) is options["eq"]
    assert one != toy("ball", 2.0, ["skin"])
    assert one != "ball"
    assert toy("a").parts is not toy("a").parts
    assert hasattr(one, "__dict__") is not options["slots"]
    assert toy.__match_args__ == ("name", "size", "parts")


@both
@each
def test_signatures_fields_and_changed_copies_are_alike(decorate: Decorate, options: dict[str, bool]) -> None:
    toy = made(decorate, **options)
    assert [str(parameter) for parameter in inspect.signature(toy).parameters.values()][:2] == [
        "name: 'str'",
        "size: 'float' = 1.0",
    ]
    assert [point_field.name for point_field in fields(toy)] == ["name", "size", "parts", "serial", "seen", "colour"]
    assert replace(toy("ball"), name="cube").name == "cube"
    assert copy.copy(toy("ball", 3.0)).size == copy.deepcopy(toy("ball", 3.0)).size == 3.0
    with pytest.raises(ValueError, match="too small"):
        toy("ball", -1.0)
    with pytest.raises(TypeError, match=r"Toy.__init__\(\) missing 1 required positional argument: 'name'"):
        toy()
    assert is_dataclass(toy)


@both
@pytest.mark.parametrize("slots", [False, True])
def test_what_is_frozen_does_not_change(decorate: Decorate, slots: bool) -> None:
    one = made(decorate, frozen=True, slots=slots)("ball")
    with pytest.raises(FrozenInstanceError, match="cannot assign to field 'size'"):
        one.size = 2.0
    with pytest.raises(FrozenInstanceError, match="cannot delete field 'size'"):
        del one.size


@pytest.mark.parametrize("slots", [False, True])
def test_nothing_can_be_added_to_what_is_frozen(slots: bool) -> None:
    with pytest.raises(FrozenInstanceError, match="unknown"):
        made(dataclass, frozen=True, slots=slots)("ball").unknown = 2.0


@both
def test_only_what_is_frozen_and_compared_by_value_has_a_hash_of_its_values(decorate: Decorate) -> None:
    with pytest.raises(TypeError, match="unhashable"):
        hash(made(decorate)("ball"))
    frozen = made(decorate, frozen=True)
    assert hash(frozen("ball", 1.0, ())) == hash(frozen("ball", 1.0, ()))
    loose = made(decorate, frozen=True, eq=False)
    assert hash(loose("ball")) != hash(loose("ball"))


@both
def test_methods_that_a_class_writes_itself_are_kept(decorate: Decorate) -> None:
    @decorate(frozen=True)
    class Own:
        """A class with methods."""

        name: str

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Own)

        def __repr__(self) -> str:
            return "own"

    assert Own("a") == Own("b")  # type: ignore[call-arg]
    assert repr(Own("a")) == "own"  # type: ignore[call-arg]
    assert hash(Own("a")) == hash(Own("a")) != hash(Own("b"))  # type: ignore[call-arg]


@both
@each
def test_the_standard_library_knows_whether_a_parent_is_frozen(decorate: Decorate, options: dict[str, bool]) -> None:
    class Child(made(decorate, **options)):  # type: ignore[misc]
        weight: float = 0.0

    child = dataclasses.dataclass(frozen=options["frozen"])(Child)
    assert (child("ball").weight, child("ball").size) == (0.0, 1.0)
    with pytest.raises(TypeError, match="frozen"):
        dataclasses.dataclass(frozen=not options["frozen"])(Child)


def test_a_class_that_inherits_fields_has_them_first() -> None:
    assert Named(1.0, 2.0, "home") == Named(1.0, 2.0, "home") != Named(1.0, 2.0, "away")
    assert Named(1.0, 2.0) != Point(1.0, 2.0)
    assert get_type_hints(Named) == {"x": float, "y": float, "name": str}


def test_objects_survive_pickling() -> None:
    for point in (Point(1.0, 2.0), Named(1.0, 2.0, "home"), Empty()):
        assert pickle.loads(pickle.dumps(point)) == point


def test_a_class_without_fields_is_one_value() -> None:
    assert Empty() == Empty()
    assert {Empty(), Empty()} == {Empty()}


def test_an_object_that_holds_itself_can_be_shown() -> None:
    one = made(dataclass)("ball")
    one.seen["me"] = one
    assert "..." in repr(one)


def test_a_value_that_is_not_equal_to_itself_makes_no_object_differ_from_itself() -> None:
    nan = float("nan")
    assert Point(nan) == Point(nan)
    assert Point(nan) != Point(float("nan"))
