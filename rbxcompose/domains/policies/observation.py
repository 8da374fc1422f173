"""What a policy observes: numbers of messages, in the order in which they are written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import Any

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from rbxcompose.base.config import Config, JointName, Time
from rbxcompose.manifest.fields import FieldPath, TopicName
from rbxcompose.msgs.fields import NoFieldError, field_type
from rbxcompose.sdk.ports import MessageName

JOINT_STATE = "sensor_msgs/msg/JointState"
OF_JOINTS = ("position", "velocity", "effort")
MOST_NUMBERS = 10_000  # of one field


class NothingObservedError(Exception):
    """Raised when a message does not have the numbers that are observed."""


class ObservationConfig(Config):
    """Numbers of one topic."""

    topic: TopicName
    """Where they come from."""
    message: MessageName = JOINT_STATE
    """The type of the topic."""
    joints: list[JointName] = []
    """The joints, in their order; only of joint states."""
    size: int = Field(1, ge=1, le=MOST_NUMBERS)
    """How many numbers each field has, if it is a list and not of joints."""
    fields: list[FieldPath] = Field(["position"], min_length=1, validate_default=True)
    """The fields in their order, such as `twist.twist.linear.x`: of joints each field of all joints, then the next."""
    timeout: Time = Field(0.5, gt=0)
    """A message that is older counts for nothing, and the policy gives no answer."""

    @field_validator("joints")
    @classmethod
    def _of_joint_states(cls, joints: list[str], info: ValidationInfo) -> list[str]:
        if joints and info.data.get("message", JOINT_STATE) != JOINT_STATE:
            raise ValueError(f"only {JOINT_STATE} has joints")
        if len(set(joints)) < len(joints):
            raise ValueError("a joint is there twice")
        return joints

    @field_validator("fields")
    @classmethod
    def _are_numbers(cls, fields: list[str], info: ValidationInfo) -> list[str]:
        message = info.data.get("message")
        for path in fields if message else ():
            if info.data.get("joints") and path not in OF_JOINTS:
                context = {"name": path, "valid": OF_JOINTS, "what": "fields of joints"}
                raise PydanticCustomError("field", "a joint has no field '{name}'", context)
            _require_numbers(str(message), path)
        return fields

    @property
    def length(self) -> int:
        """Return how many numbers it is."""
        return len(self.fields) * (len(self.joints) or self.size)


def _require_numbers(message: str, path: str) -> None:
    try:
        found = field_type(message, path)
    except NoFieldError as error:
        context = {"name": error.name, "valid": tuple(error.fields), "what": f"'message' is {message}, with the fields"}
        raise PydanticCustomError("field", f"{error.message} has no field '{{name}}'", context) from None
    if found.is_message or found.base in ("string", "wstring"):
        raise PydanticCustomError("field", "'{path}' is a {type}, not numbers", {"path": path, "type": str(found)})


def observed(config: ObservationConfig, message: Any) -> list[float]:
    """Return the numbers of a message.

    Raises:
        NothingObservedError: if it does not have them.
    """
    return list(_of_joints(config, message) if config.joints else _of_fields(config, message))


def _of_joints(config: ObservationConfig, message: Any) -> Iterator[float]:
    places = {name: place for place, name in enumerate(message.name)}
    for field in config.fields:
        values: Sequence[float] = getattr(message, field)
        for joint in config.joints:
            if (place := places.get(joint)) is None or place >= len(values):
                raise NothingObservedError(f"'{config.topic}' has no {field} of '{joint}'")
            yield float(values[place])


def _of_fields(config: ObservationConfig, message: Any) -> Iterator[float]:
    for path in config.fields:
        found = attrgetter(path)(message)
        values = [found] if isinstance(found, int | float) else list(found)
        if len(values) != config.size:
            raise NothingObservedError(f"'{path}' of '{config.topic}' has {len(values)} numbers, and not {config.size}")
        yield from map(float, values)
