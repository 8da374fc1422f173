"""What is seen again is the same object; what is elsewhere is told; what is not seen any more is gone."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, quaternion_from_yaw
from rbxcompose.domains.arms.components.seen_objects import MOST_OBJECTS, Sighting, Sightings

SIZE = (0.02, 0.02, 0.1)
POINTS = st.tuples(*[st.floats(-1, 1)] * 3)
NOISE = st.tuples(*[st.floats(-0.002, 0.002)] * 3)


def seen(x: float, label: str = "cup", id: str = "", y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> Sighting:
    return Sighting(label, id, SIZE, Transform3((x, y, z), quaternion_from_yaw(yaw)))


def core() -> Sightings:
    return Sightings(near=0.1, still=0.005, forget=5.0)


def names(core: Sightings, now: float, *found: Sighting, held: tuple[str, ...] = ()) -> list[str]:
    return [seen_object.name for seen_object in core.take(now, found, held)]


@given(st.lists(st.tuples(st.integers(-9, 9), st.sampled_from(["cup", "box", ""])), unique=True), st.lists(NOISE))
def test_things_that_stand_are_told_once_however_often_and_noisily_they_are_seen(
    things: list[tuple[int, str]], noise: list[tuple[float, float, float]]
) -> None:
    sightings = core()
    told = names(sightings, 0.0, *(seen(0.2 * at, label) for at, label in things))
    assert len(set(told)) == len(things)
    for step, (x, y, z) in enumerate(noise):
        again = [seen(0.2 * at + x, label, y=y, z=z) for at, label in reversed(things)]
        assert names(sightings, 0.1 * step, *again) == []


def test_what_moves_a_little_keeps_its_name_and_what_appears_far_away_is_another() -> None:
    sightings = core()
    assert names(sightings, 0.0, seen(0.0)) == ["cup_1"]
    assert names(sightings, 0.1, seen(0.05)) == ["cup_1"]
    assert names(sightings, 0.2, seen(0.05, yaw=0.3)) == ["cup_1"]
    assert names(sightings, 0.3, seen(0.05, yaw=0.3), seen(0.5)) == ["cup_2"]
    assert names(sightings, 0.4, seen(0.9, id="mug")) == ["mug"]
    assert names(sightings, 0.5, seen(0.1, id="mug")) == ["mug"]  # a tracker knows better


def test_what_is_not_seen_is_forgotten_and_what_is_held_is_not_nor_is_it_moved() -> None:
    sightings = core()
    names(sightings, 0.0, seen(0.0), seen(0.5))
    assert names(sightings, 4.0, seen(0.04), held=("cup_1",)) == ["cup_3"]  # not what the hand holds
    assert sightings.forgotten(4.9, ("cup_1",)) == []
    assert sightings.forgotten(5.1, ("cup_1",)) == ["cup_2"]
    assert sightings.forgotten(9.2, ("cup_1",)) == ["cup_3"]
    assert list(sightings.objects) == ["cup_1"]


def test_what_somebody_has_put_elsewhere_is_seen_there_under_its_name() -> None:
    sightings = core()
    names(sightings, 0.0, seen(0.0))
    sightings.put("cup_1", Transform3((0.5, 0.0, 0.0)))
    assert names(sightings, 1.0, seen(0.501)) == []
    sightings.put("cup_1", None)
    assert names(sightings, 2.0, seen(0.9)) == ["cup_1"]
    sightings.put("nothing", None)


@given(st.lists(POINTS, min_size=1), POINTS)
def test_the_nearest_and_the_newest_are_among_what_is_there(
    points: list[tuple[float, float, float]], here: tuple[float, float, float]
) -> None:
    sightings = core()
    for step, (x, y, z) in enumerate(points):
        names(sightings, float(step), seen(x, y=y, z=z))
    assert sightings.nearest(here, ()) in sightings.objects
    assert sightings.objects[sightings.newest(())].at == len(points) - 1
    assert sightings.nearest(here, tuple(sightings.objects)) == sightings.newest(tuple(sightings.objects)) == ""


def test_noise_does_not_fill_the_scene() -> None:
    sightings = core()
    assert len(names(sightings, 0.0, *(seen(float(at)) for at in range(2 * MOST_OBJECTS)))) == MOST_OBJECTS
