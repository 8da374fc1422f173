"""When a misspelt name may be corrected without asking, and when that would be a guess."""

from __future__ import annotations

from rbxcompose.base.findings import FindingKind, Span, correction
from tests.loops import for_all

PLACE = Span("f", 1, 4, 1, 8)


def meant(name: str, *valid: str) -> str:
    fix = correction(name, valid, PLACE)
    return fix.edits[0].text if fix else ""


@for_all(
    "name, valid, right",
    [
        ("restrat", ("restart", "process"), "restart"),
        ("dok", ("dock", "corner"), "dock"),
        ("corner3", ("corner_1", "corner_2", "corner_3"), "corner_3"),
        ("goto", ("go_to", "charger"), "go_to"),
        ("patrol.yml", ("patrol.yaml", "tour.yaml"), "patrol.yaml"),
        ("Robto", ("Robot",), "Robot"),
        ("form", ("from", "priority", "timeout", "max_rate"), "from"),
        ("sapce", ("space", "rate"), "space"),
    ],
)
def test_a_slip_of_the_hand_is_corrected(name: str, valid: tuple[str, ...], right: str) -> None:
    assert meant(name, *valid) == right


@for_all(
    "name, valid, why",
    [
        ("fort", ("from",), "too far"),
        ("corner_12", ("corner_21",), "another number, though two digits have changed places"),
        ("corner_5", ("corner_1", "corner_2"), "two are as near"),
        ("corner_2", ("corner_1",), "another number"),
        ("min_turn_speed", ("max_turn_speed",), "another word"),
        ("door_a", ("door_b",), "another letter alone"),
        ("battery", ("battery_sim",), "a word less"),
        ("camera", (), "there is none"),
    ],
)
def test_a_guess_is_not(name: str, valid: tuple[str, ...], why: str) -> None:
    assert meant(name, *valid) == "", why


def test_a_name_that_is_used_there_already_is_not_written_again() -> None:
    assert correction("max_sped", ["max_speed"], PLACE, taken=["max_speed"]) is None


def test_without_a_place_there_is_nothing_to_correct() -> None:
    assert correction("dok", ["dock"], None) is None


def test_a_part_of_a_text_is_corrected_within_it() -> None:
    fix = correction("batery", ["battery"], PLACE, within="batery.battery_level")
    assert fix
    assert (fix.title, fix.edits[0].text) == (
        "'batery.battery_level' -> 'battery.battery_level'",
        "battery.battery_level",
    )


def test_a_misspelt_name_brings_help_and_fix() -> None:
    finding = FindingKind("RBX0009").misspelt(PLACE, "unknown", "dok", ["dock"])
    assert finding.help == "did you mean 'dock'?"
    assert finding.fix
    assert finding.fix.is_safe
    far = FindingKind("RBX0009").misspelt(PLACE, "unknown", "x", ["dock", "corner"], "places")
    assert (far.help, far.fix) == ("places: dock, corner", None)
