"""The attachment of every message, request and reply: who sent it, when, and its sequence number."""

from __future__ import annotations

import struct
from typing import NamedTuple

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
