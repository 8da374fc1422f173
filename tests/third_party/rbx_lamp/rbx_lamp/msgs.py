"""ROS 2 interfaces of `rbx_lamp`.

Generated from the texts of `rbx_lamp`: do not edit.
"""

from __future__ import annotations

from dataclasses import field
from typing import ClassVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs import builtin_interfaces, unique_identifier_msgs
from rbxcompose.msgs.types import Action, Fields, Message, Service


class Blink(Action["Blink.Goal", "Blink.Result", "Blink.Feedback"]):
    """Flash so many times."""

    TYPE: ClassVar[str] = "rbx_lamp/action/Blink"
    HASH: ClassVar[str] = "RIHS01_d2f2e022a407eaa3bead71d0a593c0599c07160a5119204d9ee54b365c19246a"

    @dataclass(frozen=True, slots=True)
    class Goal(Message):
        """Goal of `Blink`."""

        TYPE: ClassVar[str] = "rbx_lamp/action/Blink_Goal"
        HASH: ClassVar[str] = "RIHS01_61812882326d7aa40e1aad9acbd8c52fe6b3b69c98513eda0b2072a032700e00"
        FIELDS: ClassVar[Fields] = {
            "flashes": "uint32",
        }

        flashes: int = 0

    @dataclass(frozen=True, slots=True)
    class Result(Message):
        """Result of `Blink`."""

        TYPE: ClassVar[str] = "rbx_lamp/action/Blink_Result"
        HASH: ClassVar[str] = "RIHS01_05cb3108c2ff0bd66a4241f83cbcee8a947585803bf1358c8ad39ac926091111"
        FIELDS: ClassVar[Fields] = {
            "flashes": "uint32",
        }

        flashes: int = 0

    @dataclass(frozen=True, slots=True)
    class Feedback(Message):
        """Feedback of `Blink`."""

        TYPE: ClassVar[str] = "rbx_lamp/action/Blink_Feedback"
        HASH: ClassVar[str] = "RIHS01_19598dca2ef856706751b44e3ab648da92f4f37981000a3c00641b0a9122a34a"
        FIELDS: ClassVar[Fields] = {
            "flashes": "uint32",
        }

        flashes: int = 0  # so far

    class SendGoal(Service["Blink.SendGoal.Request", "Blink.SendGoal.Response"]):
        """Sends a goal of `Blink`."""

        TYPE: ClassVar[str] = "rbx_lamp/action/Blink_SendGoal"
        HASH: ClassVar[str] = "RIHS01_05acdd59fc3d95568cd1a4e93c95690caaa0ad43d951c79e25f28048a8e83d80"

        @dataclass(frozen=True, slots=True)
        class Request(Message):
            """Request of `Blink.SendGoal`."""

            TYPE: ClassVar[str] = "rbx_lamp/action/Blink_SendGoal_Request"
            HASH: ClassVar[str] = "RIHS01_c2fd5d6b98e4daeba177cc6059cc35bb79815b8a8214b33838804d3af3287705"
            FIELDS: ClassVar[Fields] = {
                "goal_id": "unique_identifier_msgs/msg/UUID",
                "goal": "rbx_lamp/action/Blink_Goal",
            }

            goal_id: unique_identifier_msgs.UUID = field(default_factory=unique_identifier_msgs.UUID)
            goal: Blink.Goal = field(default_factory=lambda: Blink.Goal())

        @dataclass(frozen=True, slots=True)
        class Response(Message):
            """Response of `Blink.SendGoal`."""

            TYPE: ClassVar[str] = "rbx_lamp/action/Blink_SendGoal_Response"
            HASH: ClassVar[str] = "RIHS01_55a2d40e6c0b97a153b8ca00e4b01c3f79b40112df469fe8beebab8e4b3f7349"
            FIELDS: ClassVar[Fields] = {
                "accepted": "bool",
                "stamp": "builtin_interfaces/msg/Time",
            }

            accepted: bool = False
            stamp: builtin_interfaces.Time = field(default_factory=builtin_interfaces.Time)

    class GetResult(Service["Blink.GetResult.Request", "Blink.GetResult.Response"]):
        """Waits for the result of a goal of `Blink`."""

        TYPE: ClassVar[str] = "rbx_lamp/action/Blink_GetResult"
        HASH: ClassVar[str] = "RIHS01_3e99ee0b673c3ac3c18ce21572d5fd37d8880fc64ae3050f614706f2b0f1ef82"

        @dataclass(frozen=True, slots=True)
        class Request(Message):
            """Request of `Blink.GetResult`."""

            TYPE: ClassVar[str] = "rbx_lamp/action/Blink_GetResult_Request"
            HASH: ClassVar[str] = "RIHS01_c7d01fa239efb4c870d3a14e81cf780b570f62da76dd797f05d97d3fff36a5bd"
            FIELDS: ClassVar[Fields] = {
                "goal_id": "unique_identifier_msgs/msg/UUID",
            }

            goal_id: unique_identifier_msgs.UUID = field(default_factory=unique_identifier_msgs.UUID)

        @dataclass(frozen=True, slots=True)
        class Response(Message):
            """Response of `Blink.GetResult`."""

            TYPE: ClassVar[str] = "rbx_lamp/action/Blink_GetResult_Response"
            HASH: ClassVar[str] = "RIHS01_0690f74864a8a7b8139065e9f0ec7a0f22b3b86f1e4b53835598542ee4367114"
            FIELDS: ClassVar[Fields] = {
                "status": "int8",
                "result": "rbx_lamp/action/Blink_Result",
            }

            status: int = 0
            result: Blink.Result = field(default_factory=lambda: Blink.Result())

    @dataclass(frozen=True, slots=True)
    class FeedbackMessage(Message):
        """Feedback of `Blink` and the goal that it is about."""

        TYPE: ClassVar[str] = "rbx_lamp/action/Blink_FeedbackMessage"
        HASH: ClassVar[str] = "RIHS01_655905a0555f7bfe307a14cbb6fe6c7f5d3add69161f1abecf70ac8a1e600f44"
        FIELDS: ClassVar[Fields] = {
            "goal_id": "unique_identifier_msgs/msg/UUID",
            "feedback": "rbx_lamp/action/Blink_Feedback",
        }

        goal_id: unique_identifier_msgs.UUID = field(default_factory=unique_identifier_msgs.UUID)
        feedback: Blink.Feedback = field(default_factory=lambda: Blink.Feedback())


@dataclass(frozen=True, slots=True)
class Dimmed(Message):
    """How an order to dim ended."""

    TYPE: ClassVar[str] = "rbx_lamp/msg/Dimmed"
    HASH: ClassVar[str] = "RIHS01_0b6925d2d7a459dc465ef22262e02fd23eed9dd93eba6533d6389e901a247891"
    FIELDS: ClassVar[Fields] = {
        "success": "bool",
        "message": "string",
        "brightness": "float64",
    }

    success: bool = False
    message: str = ""
    brightness: float = 0.0  # then
