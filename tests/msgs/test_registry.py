import subprocess
import sys
from typing import Any

import pytest

from rbxcompose.msgs import registry
from rbxcompose.msgs.definitions import KINDS
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_srvs import SetBool

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
