"""A TCP proxy in asyncio, in a thread of its own: it stands before a router and does to its links what networks do."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType

CHUNK = 65536  # [B]


@dataclass
class Conditions:
    """What happens to bytes on their way, in both directions."""

    delay: float = 0.0  # [s] of each chunk
    rate: float = 0.0  # [B/s]; 0 is as fast as it goes
    is_frozen: bool = False  # links stay open and carry nothing; those of now never come back


@dataclass
class Proxy:
    """Listens on `port`, a free one, and connects to `target`, both on the loopback interface."""

    target: int
    conditions: Conditions = field(default_factory=Conditions)
    port: int = 0
    links: int = 0  # that were ever opened

    def __enter__(self) -> Proxy:
        self._loop = asyncio.new_event_loop()
        self._writers: list[asyncio.StreamWriter] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._server = self._loop.run_until_complete(asyncio.start_server(self._link, "127.0.0.1", 0))
        self.port = self._server.sockets[0].getsockname()[1]
        self._thread = threading.Thread(target=self._loop.run_forever, name="proxy")
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._do(self._close)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def cut(self) -> None:
        """Reset all links; new ones are taken."""

        async def reset() -> None:
            for writer in self._writers:
                writer.transport.abort()
            self._writers.clear()

        self._do(reset)

    def _do(self, act: Callable[[], object]) -> None:
        asyncio.run_coroutine_threadsafe(act(), self._loop).result(5.0)  # type: ignore[arg-type]

    async def _close(self) -> None:
        self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for writer in self._writers:
            writer.transport.abort()
        await asyncio.sleep(0)  # so that transports are closed before the loop is

    async def _link(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.links += 1
        self._writers.append(writer)
        if self.conditions.is_frozen:
            return
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self.target)
        self._writers.append(far_writer)
        for source, sink in ((reader, far_writer), (far_reader, writer)):
            task = self._loop.create_task(self._pump(source, sink))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _pump(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
        """Carry chunks, each after its delay; a slow link is one that waits after each of them."""
        try:
            while chunk := await source.read(CHUNK):
                if self.conditions.is_frozen:
                    return
                if self.conditions.delay:
                    await asyncio.sleep(self.conditions.delay)
                sink.write(chunk)
                await sink.drain()
                if self.conditions.rate:
                    await asyncio.sleep(len(chunk) / self.conditions.rate)
        except ConnectionError:
            return  # the other direction ends, too
        finally:
            sink.close()
