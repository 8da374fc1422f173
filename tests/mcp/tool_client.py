"""The official client of the Model Context Protocol, with our server as its child process, or in this process."""

from __future__ import annotations

import io
import json
import os
import sys
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, chdir, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest import mock

from anyio import create_task_group
from anyio.from_thread import BlockingPortal, start_blocking_portal

from tests.commands import command
from tests.conftest import ROOT

if TYPE_CHECKING:  # importing it takes a second, and each worker collects these tests
    from mcp.client import Client


class ToolClient:
    """A client; it counts its calls."""

    def __init__(self, portal: BlockingPortal, client: Client) -> None:
        self._portal, self._client = portal, client
        self.called: list[str] = []

    def tools(self) -> dict[str, dict[str, Any]]:
        """Return the schemas of the tools that there are."""
        return {tool.name: tool.input_schema for tool in self._portal.call(self._client.list_tools).tools}

    def told(self, tool: str, **given: Any) -> dict[str, Any]:
        """Return the answer of a tool."""
        data, is_error = self._call(tool, given)
        assert not is_error, data
        return data

    def refusal(self, tool: str, **given: Any) -> str:
        """Return why a tool refuses."""
        data, is_error = self._call(tool, given)
        assert is_error, data
        return str(data["error"])

    def _call(self, tool: str, given: Mapping[str, Any]) -> tuple[dict[str, Any], bool]:
        self.called.append(tool)
        result: Any = self._portal.call(self._client.call_tool, tool, dict(given))
        assert json.loads(result.content[0].text) == result.structured_content
        return result.structured_content, result.is_error

    def at_once(self, number: int, tool: str, **given: Any) -> list[bool]:
        """Call a tool many times at the same time, and return which calls were refused."""
        self.called += [tool] * number
        calls = [self._portal.start_task_soon(partial(self._client.call_tool, tool, given)) for _ in range(number)]
        return [bool(call.result(60.0).is_error) for call in calls]

    def gives_up(self, tool: str, **given: Any) -> str:
        """Call a tool, cancel the call at once, and return what the client says of that."""
        from mcp.shared.exceptions import MCPError

        self.called.append(tool)
        call = partial(self._client.call_tool, tool, given, read_timeout_seconds=0.1)
        try:
            self._portal.call(call)
        except MCPError as error:
            return error.message
        return "it was answered in time"

    def resources(self) -> list[str]:
        """Return the addresses of the resources."""
        return [each.uri for each in self._portal.call(self._client.list_resources).resources]

    def read(self, uri: str) -> str:
        """Return the text of a resource, or why there is none."""
        from mcp.shared.exceptions import MCPError

        self.called.append("resources/read")
        try:
            contents: Any = self._portal.call(self._client.read_resource, uri).contents
        except MCPError as error:
            return error.message
        return str(contents[0].text)


@contextmanager
def served(folder: Path, environment: Mapping[str, str], *options: str) -> Iterator[ToolClient]:
    """Start a server for a project, and connect a client."""
    from mcp.client import Client
    from mcp.client.stdio import StdioServerParameters

    whole = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    words = ["-m", "rbxcompose", "mcp", *options]
    server = StdioServerParameters(command=sys.executable, args=words, cwd=folder, env=whole)
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(Client(server)) as client:
        yield ToolClient(portal, client)


@contextmanager
def connected(folder: Path, environment: Mapping[str, str], *, operates: bool = False) -> Iterator[ToolClient]:
    """Connect a client to a server in this process, in which verbs run as well: a start of Python for each is saved."""
    variables, verbs = mock.patch.dict(os.environ, environment), mock.patch("rbxcompose.tools.mcp.tools.run_verb", _run)
    with chdir(folder), variables, verbs, start_blocking_portal() as portal:
        served_here = portal.wrap_async_context_manager(_in_memory(operates))
        with served_here as client:
            yield ToolClient(portal, client)


@asynccontextmanager
async def _in_memory(operates: bool) -> AsyncIterator[Client]:
    from mcp.client import Client
    from mcp.shared.memory import create_client_server_memory_streams

    from rbxcompose.domains.console.access import Role
    from rbxcompose.tools.mcp import server
    from rbxcompose.tools.mcp.server import AuditLog

    role = Role.OPERATE if operates else Role.VIEW
    async with create_client_server_memory_streams() as (ours, theirs):
        with mock.patch.object(server, "stdio_server", return_value=nullcontext(theirs)):
            async with create_task_group() as tasks:
                tasks.start_soon(server.serve, role, 60.0, AuditLog())
                async with Client(nullcontext(ours)) as client:
                    yield client
                await ours[1].aclose()  # as a client that closes the connection


async def _run(*words: str, folder: Path = Path("/"), unsaved: Mapping[str, str] | None = None) -> Any:
    from rbxcompose.tools.mcp.verb_process import VerbOutput

    with mock.patch("sys.stdin", io.TextIOWrapper(io.BytesIO(json.dumps(unsaved or {}).encode()))):
        done = command(*words, *(("--unsaved", "-") if unsaved else ()), environment={}, folder=folder)
    return VerbOutput(done.returncode, done.stdout, done.stderr)
