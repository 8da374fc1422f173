import importlib
import pickle
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.definitions import KINDS
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.msgs.types import declared

FINDERS: dict[str, Any] = {"msg": registry.message, "srv": registry.service, "action": registry.action}


def test_a_name_is_found_with_and_without_its_kind() -> None:
    assert registry.message("geometry_msgs/Twist") is registry.message("geometry_msgs/msg/Twist") is Twist
    assert registry.service("std_srvs/SetBool") is registry.service("std_srvs/srv/SetBool") is SetBool
    found = registry.action("nav2_msgs/NavigateToPose")
    assert found is registry.action("nav2_msgs/action/NavigateToPose") is NavigateToPose


def test_the_parts_of_services_and_actions_are_messages() -> None:
    assert registry.message("std_srvs/srv/SetBool_Request") is SetBool.Request
    assert registry.message("nav2_msgs/action/NavigateToPose_FeedbackMessage") is NavigateToPose.FeedbackMessage


@pytest.mark.parametrize("kind", KINDS)
def test_every_name_is_found(kind: str) -> None:
    names = registry.names(kind)
    assert names == sorted(set(names))
    assert [FINDERS[kind](name).TYPE for name in names] == names


@pytest.mark.parametrize(
    "name", ["geometry_msgs/Twits", "Twist", "", "os/path", "no_msgs/A/b/c", "std_srvs/srv/SetBool"]
)
def test_an_unknown_name_lists_the_names_that_there_are(name: str) -> None:
    with pytest.raises(KeyError) as caught:
        registry.message(name)
    assert f"no message {name!r}; there are " in str(caught.value)
    assert ", geometry_msgs/msg/Twist, " in str(caught.value)


def test_classes_are_made_when_asked_for_and_numpy_when_an_array_is_made() -> None:
    script = """
import sys
from rbxcompose.msgs import cdr, registry
from rbxcompose.msgs.types import declared
names = registry.names("msg")
assert not declared
twist = registry.message("geometry_msgs/Twist")
assert cdr.decode(twist, cdr.encode(twist())) == twist()
assert "numpy" not in sys.modules and "rosbags" not in sys.modules
registry.message("nav_msgs/Odometry")()
assert "numpy" in sys.modules
"""
    subprocess.run([sys.executable, "-c", script], check=True, cwd=sys.path[0] or ".")


ONE = {
    "toy_msgs/msg/Ball": "float64 size\nstd_msgs/Header header\nSpot[] spots",
    "toy_msgs/msg/Spot": "uint8 TYPE=3\nuint8 colour",
}
OTHER = {"toy_msgs/msg/Ball": "string name", "toy_msgs/srv/Roll": "Ball ball\n---\nbool ok"}


@pytest.fixture
def _nothing_left() -> Iterator[None]:
    yield
    registry.choose({})


@pytest.mark.usefixtures("_nothing_left")
def test_types_of_a_robot_are_found_by_name_and_in_a_module_like_standard_ones() -> None:
    registry.choose(ONE)
    ball, spot = registry.message("toy_msgs/Ball"), registry.message("toy_msgs/msg/Spot")
    assert "toy_msgs/msg/Ball" in registry.names("msg")
    toy_msgs: Any = importlib.import_module("rbxcompose.msgs.toy_msgs")
    assert (toy_msgs.Ball, toy_msgs.Spot) == (ball, spot)
    assert {"Ball", "Spot"} <= set(dir(toy_msgs))
    made: Any = ball(size=2.0, spots=(spot(colour=1),), header=Header(frame_id="a"))  # type: ignore[call-arg]
    assert decode(ball, encode(made)) == pickle.loads(pickle.dumps(made)) == made
    assert (made.spots[0].TYPE_, spot.TYPE) == (3, "toy_msgs/msg/Spot")
    assert "toy_msgs/msg/Ball" not in declared


@pytest.mark.usefixtures("_nothing_left")
def test_types_of_two_robots_with_the_same_name_exist_side_by_side() -> None:
    registry.choose(ONE)
    one = registry.message("toy_msgs/Ball")
    with registry.choosing(OTHER):
        other = registry.message("toy_msgs/Ball")
        assert list(other.FIELDS) == ["name"]
        assert registry.service("toy_msgs/Roll").Request.FIELDS == {"ball": "toy_msgs/msg/Ball"}
        assert decode(one, encode(one(size=3.0))) == one(size=3.0)  # type: ignore[call-arg]
    assert registry.message("toy_msgs/Ball") is one
    assert one.HASH != other.HASH
    with pytest.raises(KeyError):
        registry.service("toy_msgs/Roll")
    registry.choose({})
    with pytest.raises(ImportError):
        exec("from rbxcompose.msgs.toy_msgs import Ball")


@pytest.mark.usefixtures("_nothing_left")
def test_a_thread_has_the_types_of_the_process_unless_it_has_chosen_others() -> None:
    registry.choose(ONE)
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(lambda: list(registry.message("toy_msgs/Ball").FIELDS)).result() == [
            "size",
            "header",
            "spots",
        ]
        thread.submit(registry.choose, OTHER).result()
        assert thread.submit(lambda: list(registry.message("toy_msgs/Ball").FIELDS)).result() == ["name"]
    assert list(registry.message("toy_msgs/Ball").FIELDS) == ["size", "header", "spots"]
