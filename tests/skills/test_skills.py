"""What every skill in Python keeps, ours and those of others; and how one is declared."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, Literal

import pytest

from rbxcompose.base.expressions.types import COUNT, FLAG, PLACE, TEXT, TYPES, choice_of
from rbxcompose.sdk import Activity, Place, Speed, skill
from rbxcompose.sdk.registry import SKILL_PLUGINS, skill_names, skill_type
from rbxcompose.testing import clock_uses

all_skills = pytest.mark.parametrize("name", sorted(SKILL_PLUGINS.names()))


@all_skills
def test_it_says_what_it_does(name: str) -> None:
    text = inspect.cleandoc(skill_type(name).make.__doc__ or "")
    assert text.splitlines()[0].endswith(".")


@all_skills
def test_it_never_asks_for_time_itself(name: str) -> None:
    assert clock_uses(Path(inspect.getfile(skill_type(name).make))) == []


@all_skills
def test_one_that_can_pause_knows_how(name: str) -> None:
    declared = skill_type(name)
    methods = [getattr(declared.make, text, None) for text in ("pause", "resume")]
    own = [method for method in methods if method not in (Activity.pause, Activity.resume)]
    assert bool(own) is declared.pausable


def test_arguments_have_the_types_of_their_annotations() -> None:
    @skill("toy_all", outcomes={"lost": "failure"})
    def all_types(
        speed: Speed, place: Place, words: str, often: int, loud: bool, way: Literal["up", "down"] = "up"
    ) -> bool:
        """Take one of each."""
        return True

    declared = skill_type("toy_all")
    assert declared.arguments == {
        "speed": TYPES["speed"],
        "place": PLACE,
        "words": TEXT,
        "often": COUNT,
        "loud": FLAG,
        "way": choice_of("up", "down"),
    }
    assert declared.required == {"speed", "place", "words", "often", "loud"}
    assert declared.main == "speed"
    assert "toy_all" in skill_names()


def untyped(what) -> bool:  # type: ignore[no-untyped-def]
    """Take anything."""
    return True


def listed(what: list[int]) -> bool:
    """Take a list."""
    return True


def starred(*what: str) -> bool:
    """Take many."""
    return True


class NoActivity:
    """Is none."""


class NoStart(Activity):
    """Cannot start."""


@pytest.mark.parametrize("made", [untyped, listed, starred, NoActivity, NoStart])
def test_what_no_mission_could_write_is_refused(made: Any) -> None:
    with pytest.raises(TypeError):
        skill("toy_wrong")(made)


def test_an_outcome_counts_as_success_or_failure() -> None:
    with pytest.raises(ValueError, match="counts as success or failure"):
        skill("toy_wrong", outcomes={"lost": "maybe"})(listed)


def another() -> bool:
    """Be another one."""
    return True


def test_two_skills_of_one_name_are_refused() -> None:
    assert skill_type("say").claims == "voice"
    with pytest.raises(ValueError, match="two skills are named 'say'"):
        skill("say")(another)
