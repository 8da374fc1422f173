"""The server: passes calls of a client to the tools, over stdin and stdout, and writes each into the log."""

from __future__ import annotations

import asyncio
import json
import time
import traceback
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mcp import types
from mcp.server.context import ServerRequestContext
from mcp.server.lowlevel.server import Server
from mcp.server.stdio import stdio_server
from mcp.shared.exceptions import MCPError
from pydantic import ValidationError

import rbxcompose
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular, state_folder
from rbxcompose.base.findings import suggest
from rbxcompose.base.printable import plain
from rbxcompose.base.requests import Refused
from rbxcompose.domains.console.access import Role
from rbxcompose.manifest.files import library_root
from rbxcompose.manifest.tree import FILE_BYTES
from rbxcompose.runtime.log import LogFile
from rbxcompose.tools.mcp.tools import TOOLS, Lane, Lanes, ProjectPaths, ToolContext, VerbTool

CallContext = ServerRequestContext[Any]
LANGUAGE = "rbxcompose://language"
FINDING, MANIFEST = "rbxcompose://findings/", "rbxcompose://project/"
_MARKDOWN, _YAML = "text/markdown", "application/yaml"
_CLIENT = 60  # characters of its name
MOST_CHARACTERS = 40_000  # of a whole answer, as JSON
MOST_ITEMS = 200  # of a list
MOST_TEXT = 20_000  # characters of one text
_DEEPEST = 20
CUT = "left_out"
"""The key under which an answer says what it lacks."""
LOG = "mcp.jsonl"
TEXTS = "unsaved"  # the argument with whole texts
_MOST = 30  # arguments, and entries of one
_WORDS = 200  # characters of a text
_ABOUT = (
    "Robots and missions of the project in the folder where this server was started. Nothing here writes a file: give "
    "changed texts as 'unsaved' to try them."
)


class McpSession:
    """One client's session: which tools its role has, and what it called."""

    def __init__(self, role: Role, deadline: float, log: AuditLog) -> None:
        self.role, self._log = role, log
        self._paths, self._lanes = ProjectPaths(), Lanes(deadline)
        self._threads = ThreadPoolExecutor(Lane.COMPILE.at_once, "paths")

    async def tools(self, context: CallContext, params: types.PaginatedRequestParams | None) -> types.ListToolsResult:
        """List the tools of the role."""
        return types.ListToolsResult(tools=[_declared(tool) for tool in TOOLS.values() if tool.role <= self.role])

    async def call(self, context: CallContext, params: types.CallToolRequestParams) -> types.CallToolResult:
        """Carry out a call; whatever is wrong with it becomes an answer that says so."""
        began, given, result = time.monotonic(), params.arguments or {}, "was cancelled"
        client = _client(context)
        try:
            data = limited(await self._answer(params.name, given, client))
            result = "ok"
            return _result(data)
        except Refused as refusal:
            result = f"refused: {refusal}"
            return _result(limited({"error": str(refusal)}), is_error=True)
        except Exception as error:  # a mistake of ours ends this call only
            traceback.print_exc()
            result = f"failed: {type(error).__name__}"
            return _result({"error": f"the call has failed: {type(error).__name__}"}, is_error=True)
        finally:
            self._log.write(client, params.name, given, result, time.monotonic() - began)

    async def _answer(self, name: str, given: Mapping[str, Any], client: str) -> dict[str, Any]:
        tool = TOOLS.get(name)
        if tool is None:
            known = [tool.name for tool in TOOLS.values() if tool.role <= self.role]
            raise Refused(f"there is no tool '{plain(name)}'; {suggest(name, known, 'tools')}")
        if tool.role > self.role:
            needs = f"'{name}' needs the role '{tool.role.word}', and this server gives '{self.role.word}'"
            raise Refused(f"{needs}: start it with '--{tool.role.word}'")
        try:
            arguments = tool.arguments.model_validate(dict(given))
        except ValidationError as error:
            raise Refused("; ".join(map(_words_of_error, error.errors(include_url=False)))) from error
        async with self._lanes.turn(tool.lane):
            return await tool.do(ToolContext(self._paths, self._threads, client, self.role), arguments)

    # Resources

    async def resources(
        self, context: CallContext, params: types.PaginatedRequestParams | None
    ) -> types.ListResourcesResult:
        """List the language and the robots of the project."""
        robots = await asyncio.to_thread(self._paths.robots)
        return types.ListResourcesResult(
            resources=[
                types.Resource(name="language", uri=LANGUAGE, mime_type=_MARKDOWN, description="What a user writes."),
                *(types.Resource(name=robot, uri=f"{MANIFEST}{robot}", mime_type=_YAML) for robot in robots),
            ]
        )

    async def templates(
        self, context: CallContext, params: types.PaginatedRequestParams | None
    ) -> types.ListResourceTemplatesResult:
        """List the pages of findings, which are too many for a list."""
        page = types.ResourceTemplate(
            name="finding", uri_template=f"{FINDING}{{code}}", mime_type=_MARKDOWN, description="The page of a code."
        )
        return types.ListResourceTemplatesResult(resource_templates=[page])

    async def read(self, context: CallContext, params: types.ReadResourceRequestParams) -> types.ReadResourceResult:
        """Return the text of a resource."""
        began, result = time.monotonic(), "ok"
        try:
            text, kind = await asyncio.to_thread(self._text, params.uri)
        except (Refused, OSError, UnicodeDecodeError) as error:
            result = f"refused: {error}"
            raise MCPError(types.INVALID_PARAMS, str(error)) from error
        finally:
            self._log.write(_client(context), "resources/read", {"uri": params.uri}, result, time.monotonic() - began)
        contents = types.TextResourceContents(uri=params.uri, mime_type=kind, text=text)
        return types.ReadResourceResult(contents=[contents])

    def _text(self, uri: str) -> tuple[str, str]:
        if uri == LANGUAGE:
            return _page(library_root() / "docs" / "language.md"), _MARKDOWN
        if uri.startswith(FINDING) and (code := uri.removeprefix(FINDING)).isalnum():
            return _page(library_root() / "docs" / "findings" / f"{code.upper()}.md"), _MARKDOWN
        if uri.startswith(MANIFEST) and (robot := uri.removeprefix(MANIFEST)) in self._paths.robots():
            return _page(Path(robot)), _YAML
        raise Refused(f"there is no resource '{plain(uri)}'")


def _page(path: Path) -> str:
    return read_regular(path, FILE_BYTES).decode("utf-8")


def _client(context: CallContext) -> str:
    """Return what logs call the client; it says itself who it is."""
    known = context.session.client_params
    return f"mcp, {plain(known.client_info.name, _CLIENT)}" if known is not None else "mcp"


def _words_of_error(error: Any) -> str:
    place = ".".join(map(str, error["loc"]))
    return f"{place}: {error['msg']}" if place else str(error["msg"])


def _declared(tool: VerbTool) -> types.Tool:
    is_safe = tool.role <= Role.VIEW
    hints = types.ToolAnnotations(read_only_hint=is_safe, destructive_hint=not is_safe, open_world_hint=not is_safe)
    schema = tool.arguments.model_json_schema()
    return types.Tool(name=tool.name, description=tool.about, input_schema=schema, annotations=hints)


def _result(data: dict[str, Any], *, is_error: bool = False) -> types.CallToolResult:
    text = types.TextContent(type="text", text=json.dumps(data, ensure_ascii=False))
    return types.CallToolResult(content=[text], structured_content=data, is_error=is_error)


async def serve(role: Role, deadline: float, log: AuditLog) -> None:
    """Serve one client until it closes the connection."""
    session = McpSession(role, deadline, log)
    server: Server[Any] = Server(
        "rbxcompose",
        version=rbxcompose.__version__,
        instructions=_ABOUT,
        on_list_tools=session.tools,
        on_call_tool=session.call,
        on_list_resources=session.resources,
        on_list_resource_templates=session.templates,
        on_read_resource=session.read,
    )
    async with stdio_server() as (there, back):
        await server.run(there, back, server.create_initialization_options())


# Answers of a limited size, which say what was left out


def limited(data: dict[str, Any], most: int = MOST_CHARACTERS) -> dict[str, Any]:
    """Return an answer that has at most `most` characters as JSON: lists lose their ends, texts what is behind."""
    items, text = MOST_ITEMS, MOST_TEXT
    while True:
        cut: list[str] = []
        shown = _cut(data, "", items, text, cut, _DEEPEST)
        shown = {**shown, CUT: cut[:MOST_ITEMS]} if cut else shown
        if len(json.dumps(shown, ensure_ascii=False)) <= most:
            return dict(shown)
        if items == 1 and text == 1:
            return {CUT: [f"the answer has more than {most:,} characters"]}
        items, text = max(1, items // 2), max(1, text // 2)


def _cut(value: Any, name: str, items: int, text: int, cut: list[str], depth: int) -> Any:
    match value:
        case str() if len(value) > text:
            cut.append(f"{name}: {len(value) - text:,} of {len(value):,} characters")
            return value[:text]
        case dict() | list() if not depth:
            cut.append(f"{name}: what is nested deeper")
            return None
        case dict():
            if len(value) > items:
                cut.append(f"{name}: {len(value) - items:,} of {len(value):,} entries")
            some = list(value.items())[:items]
            return {key: _cut(entry, f"{name}.{key}".lstrip("."), items, text, cut, depth - 1) for key, entry in some}
        case list():
            if len(value) > items:
                cut.append(f"{name}: {len(value) - items:,} of {len(value):,} items")
            some = value[:items]
            return [_cut(item, f"{name}.{index}", items, text, cut, depth - 1) for index, item in enumerate(some)]
    return value


# The log of all that clients have called: one line of JSON for each call, in the state folder


@dataclass(frozen=True, slots=True)
class AuditedCall:
    """A call: when it ended [s since the epoch], how long it took [s], who called what, and what came of it."""

    time: float
    took: float
    client: str
    project: str
    tool: str
    arguments: Mapping[str, Any]
    result: str

    def to_json(self) -> str:
        """Return it as a line; texts of files are left out."""
        when = datetime.fromtimestamp(self.time, UTC).isoformat(timespec="milliseconds")
        fields = {
            "time": when,
            "client": plain(self.client),
            "project": self.project,
            "tool": plain(self.tool),
            "arguments": {plain(key): _brief(key, value) for key, value in list(self.arguments.items())[:_MOST]},
            "result": plain(self.result),
            "took": round(self.took, 3),
        }
        return json.dumps(fields, ensure_ascii=False)


class AuditLog:
    """Writes calls; old ones go to other files, which are deleted in the end, as those of a robot's log are."""

    def __init__(self) -> None:
        """Open it.

        Raises:
            OSError: if it cannot be written.
        """
        self.path = audit_path()
        self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._file = LogFile(self.path)

    def write(self, client: str, tool: str, arguments: Mapping[str, Any], result: str, took: float) -> None:
        """Add a call that has just ended."""
        self._file.write(AuditedCall(time.time(), took, client, str(Path.cwd()), tool, arguments, result))


def audit_path() -> Path:
    """Return the file with the newest calls."""
    return state_folder() / LOG


def _brief(key: str, value: Any) -> Any:
    """Return an argument shortened; of texts of files, how long they are."""
    if key == TEXTS and isinstance(value, dict):
        return {plain(str(path)): f"{len(str(text)):,} characters" for path, text in list(value.items())[:_MOST]}
    if value is None or isinstance(value, bool | int | float):
        return value
    return plain(value if isinstance(value, str) else json.dumps(value, ensure_ascii=False), _WORDS)
