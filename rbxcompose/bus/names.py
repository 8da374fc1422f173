"""Names on the wire, and the attachment of every message: ROS names, types of DDS, Zenoh keys."""

from __future__ import annotations

import re
import struct
from typing import NamedTuple

from rbxcompose.base.dataclass import dataclass
from rbxcompose.sdk.ports import name_problem

TRANSFORMS = ("/tf", "/tf_static")  # topics of transforms
ADMIN = "rbx/"  # prefix of the keys that are not part of ROS 2
EXCHANGE_DOMAIN = 0  # of what robots share
DENIED = "rbx_denied/"  # prefix of keys at which messages of other hosts are denied

_DDS = re.compile(r"(\w+)::(\w+)::dds_::(\w+)_")


def resolve(name: str, namespace: str = "") -> str:
    """Return the full name: `odom` is `/odom`, in namespace `robot1` it is `/robot1/odom`; `/tf` stays `/tf`.

    Raises:
        ValueError: if it is not a ROS name.
    """
    inner = namespace.strip("/")
    full = name if name.startswith("/") or not inner else f"{inner}/{name}"
    if problem := name_problem(full):
        raise ValueError(problem)
    return full if full.startswith("/") else f"/{full}"


def dds_type(ros_type: str) -> str:
    """Return the DDS name of a ROS type: `std_msgs/msg/String` becomes `std_msgs::msg::dds_::String_`."""
    package, kind, name = ros_type.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def ros_type(dds: str) -> str:
    """Return the ROS type with this DDS name; any other text unchanged."""
    found = _DDS.fullmatch(dds)
    return "/".join(found.groups()) if found else dds


def admin_key(robot: str, path: str) -> str:
    """Return the Zenoh key of something that a robot shows to tools, apart from the topics of ROS 2."""
    return f"{ADMIN}{robot}/{path}"


def denied_key(robot: str, host: str) -> str:
    """Return the Zenoh key that no other host may let pass: by it, access control is tried."""
    return f"{DENIED}{robot}/{host}"


def data_key(domain: int, full_name: str, ros_type: str, type_hash: str) -> str:
    """Return the Zenoh key of a topic or a service."""
    return f"{domain}/{full_name.strip('/')}/{dds_type(ros_type)}/{type_hash}"


def topic_pattern(domain: int, full_name: str) -> str:
    """Return the pattern of the Zenoh keys of a topic, whatever its type."""
    return f"{domain}/{full_name.strip('/')}/*/*"


@dataclass(frozen=True, slots=True)
class ActionNames:
    """The names of the three services and two topics that make up an action."""

    send_goal: str
    get_result: str
    cancel_goal: str
    feedback: str
    status: str

    @classmethod
    def of(cls, action: str) -> ActionNames:
        """Return the names for the action named `action`."""
        return cls(*(f"{action}/_action/{part}" for part in cls.__slots__))


_LAYOUT = struct.Struct("<qqB16s")
_READ = struct.Struct("<qqx16s")
_GID_SIZE = 16


class Attachment(NamedTuple):
    """The origin of a message; ROS drops messages without it."""

    sequence: int  # counts from 1 for each publisher or client
    stamp: int  # [ns] time of sending, by the sender's clock
    gid: bytes  # 16 bytes that identify the sender

    def encode(self) -> bytes:
        """Return the 33 bytes that go over the wire."""
        return _LAYOUT.pack(self.sequence, self.stamp, _GID_SIZE, self.gid)


class AttachmentError(ValueError):
    """Raised when bytes are not an attachment."""


def decode_attachment(data: bytes) -> Attachment:
    """Read an attachment.

    Raises:
        AttachmentError: if `data` is not one.
    """
    if len(data) != _LAYOUT.size or data[16] != _GID_SIZE:
        raise AttachmentError(f"expected an attachment of {_LAYOUT.size} bytes, got {len(data)}")
    return Attachment._make(_READ.unpack(data))
