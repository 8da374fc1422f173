"""The official client of the Model Context Protocol, with our server as its child process."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from anyio.from_thread import BlockingPortal, start_blocking_portal

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
