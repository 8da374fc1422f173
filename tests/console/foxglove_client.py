"""A client of Foxglove's server."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import websockets
from websockets.asyncio.client import ClientConnection, connect


class Foxglove:
    """A client of Foxglove's protocol, as far as a test needs it."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.offered: dict[str, dict[str, Any]] = {}  # topics and services, by name

    @classmethod
    def at(cls, port: int) -> connect:
        """Return a connection that is to be entered."""
        return connect(f"ws://127.0.0.1:{port}", subprotocols=[websockets.Subprotocol("foxglove.sdk.v1")])

    async def says(self, op: str, **more: Any) -> None:
        await self.socket.send(json.dumps({"op": op, **more}))

    async def gets(self, *ops: str | int) -> Any:
        """Return the next frame of one of these operations: a text, or bytes of the kind."""
        while True:
            frame = await asyncio.wait_for(self.socket.recv(), 10)
            if isinstance(frame, bytes):
                if frame[0] in ops:
                    return frame
                continue
            told = json.loads(frame)
            for each in (*told.get("channels", ()), *told.get("services", ())):
                self.offered[each.get("topic") or each["name"]] = each
            if told["op"] in ops:
                return told

    async def knows(self, *names: str) -> None:
        """Wait until all of these are offered."""
        while not self.offered.keys() >= {*names}:
            await self.gets("advertise", "advertiseServices")
