import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rbxcompose.msgs as package
from rbxcompose.msgs.generate import all_structures, modules
from rbxcompose.msgs.geometry_msgs import Pose, PoseStamped, PoseWithCovariance, Quaternion, Twist, Vector3
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.rbxcompose_msgs import Recharge, SetBatteryLevel
from rbxcompose.msgs.rcl_interfaces import Log
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.msgs.types import Action, FeedbackT, GoalT, Message, RequestT, ResponseT, ResultT, Service, declared
from rbxcompose.msgs.unique_identifier_msgs import UUID
from tests.msgs.samples import EVERYTHING, MESSAGES

FOLDER = Path(package.__path__[0])
GENERATED = modules(all_structures())


@pytest.mark.parametrize("name", sorted(GENERATED))
def test_a_module_is_what_its_texts_generate(name: str) -> None:
    assert (FOLDER / f"{name}.py").read_text() == GENERATED[name], "run `python -m rbxcompose.msgs.generate`"


def test_no_generated_module_is_left_over() -> None:
    marked = {path.stem for path in FOLDER.glob("*.py") if "do not edit" in path.read_text()[:400]}
    assert marked - {"generate"} == set(GENERATED)


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: str(message.TYPE))
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


def test_a_keyword_gets_an_underscore_and_keeps_its_name_on_the_wire() -> None:
    assert EVERYTHING(from_=3).from_ == 3
    assert EVERYTHING.FIELDS["from"] == "uint8"


def test_constants_belong_to_their_class() -> None:
    assert (Log.WARN, SetBool.Request.TYPE) == (30, "std_srvs/srv/SetBool_Request")


def test_messages_without_arrays_can_be_keys() -> None:
    assert {UUID(uuid=bytes(16)): 1}[UUID()] == 1


def test_array_messages_compare_their_arrays() -> None:
    one = PoseWithCovariance(covariance=np.eye(6))
    assert one == PoseWithCovariance(covariance=np.eye(6).reshape(-1))
    assert one != PoseWithCovariance()
    assert one != PoseWithCovariance(pose=Pose(orientation=Quaternion(w=0.0)), covariance=np.eye(6))
    assert Odometry(pose=one) == Odometry(pose=PoseWithCovariance(covariance=one.covariance))
    assert one != Pose()


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
