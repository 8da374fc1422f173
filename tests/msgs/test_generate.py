import copy
import dataclasses
import pickle
import subprocess
import sys
from types import ModuleType
from typing import Any, get_type_hints

import numpy as np
import pytest

from rbxcompose.msgs import control_msgs, geometry_msgs
from rbxcompose.msgs.generate import modules
from rbxcompose.msgs.geometry_msgs import Pose, PoseStamped, PoseWithCovariance, Quaternion, Twist, Vector3
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.rbxcompose_msgs import Recharge, SetBatteryLevel
from rbxcompose.msgs.rcl_interfaces import Log
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.msgs.types import Action, FeedbackT, GoalT, Message, RequestT, ResponseT, ResultT, Service, declared
from rbxcompose.msgs.unique_identifier_msgs import UUID
from tests.loops import for_all
from tests.msgs.samples import EVERYTHING, MESSAGES, STRUCTURES


def test_the_text_of_each_package_has_the_classes_that_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = modules(STRUCTURES)
    made = dict(declared)
    try:
        for text in texts.values():
            module = ModuleType("written")
            monkeypatch.setitem(sys.modules, "written", module)
            exec(text, vars(module))
        written = dict(declared)
    finally:
        declared.update(made)
    assert {name: described(written[name]) for name in STRUCTURES if name in made} == {
        name: described(made[name]) for name in STRUCTURES if name in made
    }


def described(found: Any) -> object:
    constants = {
        name: value for name, value in vars(found).items() if name.isupper() and name not in ("HASH", "ARRAYS")
    }
    fields = dataclasses.fields(found) if issubclass(found, Message) else ()
    return (
        found.__qualname__,
        found.__doc__,
        found.HASH,
        constants,
        [(f.name, str(f.default)) for f in fields],
        repr(found()) if fields else "",
    )


def test_a_class_is_made_once_by_whatever_way_it_is_found() -> None:
    script = """
import sys
from rbxcompose.msgs import geometry_msgs, registry
from rbxcompose.msgs.types import declared
assert not declared
from rbxcompose.msgs.geometry_msgs import TwistStamped
assert TwistStamped is geometry_msgs.TwistStamped is registry.message("geometry_msgs/TwistStamped")
assert set(declared) == {
    f"{name}" for name in (
        "builtin_interfaces/msg/Time", "std_msgs/msg/Header", "geometry_msgs/msg/Vector3", "geometry_msgs/msg/Twist",
        "geometry_msgs/msg/TwistStamped",
    )
}
import rbxcompose.msgs.std_msgs
assert declared["std_msgs/msg/Header"] is rbxcompose.msgs.std_msgs.Header
"""
    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_package_knows_the_names_of_its_classes() -> None:
    assert {"Twist", "Pose"} < set(dir(geometry_msgs))
    assert {"GripperCommand", "GripperCommandMessage"} < set(dir(control_msgs))
    assert control_msgs.GripperCommandMessage.TYPE == "control_msgs/msg/GripperCommand"
    with pytest.raises(AttributeError, match=r"module 'rbxcompose.msgs.geometry_msgs' has no attribute 'Twits'"):
        geometry_msgs.Twits  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(ImportError, match=r"cannot import name 'Twits' from 'rbxcompose.msgs.geometry_msgs'"):
        exec("from rbxcompose.msgs.geometry_msgs import Twits")


@pytest.mark.parametrize("message", [Twist(), NavigateToPose.Goal(behavior_tree="a"), SetBool.Request(True)], ids=str)
def test_a_message_is_pickled_copied_and_has_types(message: Any) -> None:
    assert pickle.loads(pickle.dumps(message)) == copy.deepcopy(message) == message
    assert set(get_type_hints(type(message))) >= {"TYPE", "HASH", "FIELDS", *type(message).FIELDS}


@for_all("message", MESSAGES)
def test_a_message_is_a_frozen_slotted_dataclass_with_defaults(message: Any) -> None:
    made = message()
    assert not hasattr(made, "__dict__")
    assert declared[message.TYPE] is message
    for field in dataclasses.fields(made):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(made, field.name, 1)


def test_fields_start_at_zero_or_at_the_default_of_the_text() -> None:
    assert Twist() == Twist(linear=Vector3(x=0.0, y=0.0, z=0.0), angular=Vector3())
    assert Quaternion() == Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    everything = EVERYTHING()
    assert (everything.yes, everything.a, everything.d, everything.e) == (True, -1, 0.5, "with # in it")
    assert (everything.rgb, everything.switches, everything.pair) == (bytes(3), (False, False), ("", ""))
    assert everything.vector.dtype == np.float64
    assert len(everything.two) == 2
    assert (everything.some.tolist(), everything.some.dtype, everything.octets) == ([1, -2], np.int16, b"\x01\xff")
    assert (everything.names, everything.bits) == (("a", "b, c", "d"), (True, False))


def test_a_keyword_gets_an_underscore_and_keeps_its_name_on_the_wire() -> None:
    assert EVERYTHING(from_=3).from_ == 3
    assert EVERYTHING.FIELDS["from"] == "uint8"


def test_constants_belong_to_their_class() -> None:
    assert (Log.WARN, SetBool.Request.TYPE) == (30, "std_srvs/srv/SetBool_Request")


def test_messages_without_arrays_can_be_keys() -> None:
    assert {UUID(uuid=bytes(16)): 1}[UUID()] == 1


def test_array_messages_compare_their_arrays() -> None:
    odometry = PoseWithCovariance(covariance=np.eye(6))
    assert odometry == PoseWithCovariance(covariance=np.eye(6).reshape(-1))
    assert odometry != PoseWithCovariance()
    assert odometry != PoseWithCovariance(pose=Pose(orientation=Quaternion(w=0.0)), covariance=np.eye(6))
    assert Odometry(pose=odometry) == Odometry(pose=PoseWithCovariance(covariance=odometry.covariance))
    assert odometry != Pose()


def test_an_array_is_copied_unless_nobody_can_write_to_it() -> None:
    mine = np.ones(36)
    message = PoseWithCovariance(covariance=mine)
    mine[0] = 7.0
    assert message.covariance[0] == 1.0
    assert PoseWithCovariance(covariance=message.covariance).covariance is message.covariance


def test_an_array_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(ValueError, match="covariance of geometry_msgs/msg/PoseWithCovariance has 3 values, not 36"):
        PoseWithCovariance(covariance=np.zeros(3))


def call(service: type[Service[RequestT, ResponseT]], request: RequestT) -> ResponseT:
    assert isinstance(request, service.Request)
    return service.Response()


def run(action: type[Action[GoalT, ResultT, FeedbackT]], goal: GoalT) -> tuple[ResultT, Message]:
    return action.Result(), action.SendGoal.Request(goal_id=UUID(), goal=goal)


def test_a_type_checker_knows_the_parts_of_services_and_actions() -> None:
    empty: SetBatteryLevel.Response = call(SetBatteryLevel, SetBatteryLevel.Request(value=80.0))
    done: SetBool.Response = call(SetBool, SetBool.Request(data=True))
    assert (empty, done.success) == (SetBatteryLevel.Response(), False)
    goal = NavigateToPose.Goal(pose=PoseStamped())
    result, request = run(NavigateToPose, goal)
    assert result.error_code == NavigateToPose.Result.NONE
    assert request == NavigateToPose.SendGoal.Request(goal=goal)
    assert Recharge.FeedbackMessage(feedback=Recharge.Feedback(level=0.5)).feedback.level == 0.5
    assert Recharge.GetResult.Response(status=4, result=Recharge.Result(message="full")).result.message == "full"
