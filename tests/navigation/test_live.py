"""Settings that change while a robot drives: all but those that say what is wired to what, and where it begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from operator import attrgetter
from pathlib import Path
from typing import Any

import pytest

from rbxcompose import sdk
from rbxcompose.base.config import live_names
from rbxcompose.sdk.bound import Outcome
from tests.navigation.test_robot import ROBOT, Room

FIXED = {
    "go_to": {
        "corners": "a list of points is no parameter of ROS",
        "zones": "a list of areas is no parameter of ROS",
        "scan": "a topic is subscribed at the start",
        "scan_frame": "a frame belongs to its topic",
        "trees": "missions are compiled",
    },
    "localisation": {
        "scan": "a topic is subscribed at the start",
        "scan_frame": "a frame belongs to its topic",
        "start": "'initialpose' sets it",
        "anywhere": "'reinitialize_global_localization' does it",
        "seed": "random numbers begin with it",
    },
    "map_server": {"file": "a map is a file that was read"},
}
Reader = Callable[[Any], object]
FOLLOWER = ("speed", "turn_rate", "acceleration", "look_ahead", "tolerance", "heading_tolerance")
USED: Mapping[str, Mapping[str, Reader]] = {  # what a component works with, by the name of the setting
    "go_to": {
        **{name: attrgetter(f"follower.settings.{name}") for name in FOLLOWER},
        **{name: attrgetter(f"costs.settings.{name}") for name in ("radius", "inflation", "unknown_is_free")},
    },
    "localisation": {name: attrgetter(f"filter.settings.{name}") for name in ("least", "most")},
}
LOCALISED = ROBOT + "  localisation: {type: particles}\nmissions: {mine: rbx:missions/recover.yaml}\n"


def another(value: object) -> object:
    """Return another value of the kind."""
    match value:
        case bool():
            return not value
        case int():
            return value + 1
        case float():
            return value * 1.25
    return "mine"


@pytest.mark.parametrize("name", FIXED)
def test_every_setting_changes_while_the_robot_drives_or_it_is_said_why_not(tmp_path: Path, name: str) -> None:
    room = Room(tmp_path, LOCALISED)
    made: Any = room.bench.component(name)
    live = set(live_names(type(made.config)))
    assert live | set(FIXED[name]) == set(type(made.config).model_fields)
    assert not live & set(FIXED[name])
    for setting in sorted(live, reverse=True):  # 'most' before 'least'
        wanted = another(getattr(made.config, setting))
        room.bench.set_live(name, **{setting: wanted})
        assert getattr(made.config, setting) == pytest.approx(wanted)
        read = USED[name].get(setting)
        assert read is None or read(made) == pytest.approx(wanted)
    assert set(USED.get(name, ())) <= live
    assert name != "go_to" or room.go(-1.0, 0.3).outcome is Outcome.SUCCEEDED


def test_settings_that_do_not_fit_together_are_refused_and_change_nothing(tmp_path: Path) -> None:
    corners = "  footprint: [[30 cm, 20 cm], [-30 cm, 20 cm], [-30 cm, -20 cm], [30 cm, -20 cm]]\n"
    room = Room(tmp_path, ROBOT + corners + "  localisation: {type: particles}\n")
    navigator: Any = room.bench.component("go_to")
    for name, settings, said in (
        ("go_to", {"radius": 0.3}, "its 'footprint' has corners"),
        ("go_to", {"recovery": "nothing"}, "'nothing' is no mission of the robot"),
        ("localisation", {"least": 3000}, "'least' is not above 'most'"),
    ):
        before = room.bench.component(name).config
        with pytest.raises(sdk.Refused, match=said):
            room.bench.set_live(name, **settings)
        assert room.bench.component(name).config == before
    assert navigator.costs.settings.radius == pytest.approx(0.2)
