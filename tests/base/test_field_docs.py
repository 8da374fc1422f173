"""The docstring of a field is found where it stands, and only there."""

from __future__ import annotations

from rbxcompose.base.config import Config, field_docs


class Lamp(Config):
    """A lamp."""

    colour: str = "white"
    """What it shines in,
    by name."""
    silent: str = ""
    bright: float = 1.0
    """How bright."""

    class Inner(Config):
        """Its own fields."""

        colour: str = ""
        """Of what is inside."""


class RedLamp(Lamp):
    """A lamp that is red."""

    colour: str = "red"
    size: float = 0.1
    """How large."""


def test_a_docstring_below_a_field_is_its_own() -> None:
    assert field_docs(Lamp) == {"colour": "What it shines in, by name.", "bright": "How bright."}
    assert field_docs(Lamp.Inner) == {"colour": "Of what is inside."}


def test_fields_are_inherited_with_their_docstrings_and_those_that_are_written_again_are_not() -> None:
    assert field_docs(RedLamp) == {"bright": "How bright.", "size": "How large."}


def test_a_class_in_a_function_has_its_own() -> None:
    class Lamp(Config):
        """Another one."""

        colour: str = ""
        """Here."""

    assert field_docs(Lamp) == {"colour": "Here."}


def test_a_class_without_source_has_none() -> None:
    scope: dict[str, type] = {}
    exec("class Bare:\n    colour: str\n    'Nowhere.'\n", {"__name__": "nowhere"}, scope)
    assert field_docs(scope["Bare"]) == {}


def test_schemas_tell_the_docstrings() -> None:
    properties = Lamp.model_json_schema()["properties"]
    assert [property_.get("description") for property_ in properties.values()] == [
        "What it shines in, by name.",
        None,
        "How bright.",
    ]
