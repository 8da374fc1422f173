"""The language server: hands what an editor asks to the core, over stdin and stdout."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol, TypeVar

from lsprotocol import types
from pygls.lsp.server import LanguageServer

import rbxcompose
from rbxcompose.lsp.completion import complete
from rbxcompose.lsp.convert import Converter
from rbxcompose.lsp.definition import define
from rbxcompose.lsp.document import Document
from rbxcompose.lsp.fixes import actions
from rbxcompose.lsp.hover import describe
from rbxcompose.lsp.project import Project

P = TypeVar("P")
R = TypeVar("R")
PAUSE = 0.1  # [s] without a key stroke before the robot is compiled anew
TRIGGERS = (" ", ":", "$", "{", ".", "-", "[", ",")


class Session:
    """One editor's session."""

    def __init__(self, server: LanguageServer, environment: Mapping[str, str]) -> None:
        self.server = server
        self.project = Project(environment)
        self._converter: Converter | None = None
        self._waiting: dict[str, asyncio.TimerHandle] = {}

    @property
    def convert(self) -> Converter:
        """Return the converter, which needs what was agreed upon at the start."""
        if self._converter is None:
            self._converter = Converter(self.project, self.server.workspace.position_codec)
        return self._converter

    def opened(self, uri: str) -> None:
        """Check a document at once."""
        if handle := self._waiting.pop(uri, None):
            handle.cancel()
        path = self.convert.path(uri)
        text = self._text(uri)
        if path is not None and self.project.has(path, text):
            self._publish(path, text)

    def changed(self, uri: str) -> None:
        """Check a document when nothing has been typed for a moment."""
        if handle := self._waiting.pop(uri, None):
            handle.cancel()
        self._waiting[uri] = asyncio.get_running_loop().call_later(PAUSE, self.opened, uri)

    def closed(self, uri: str) -> None:
        """Take the saved text again."""
        if handle := self._waiting.pop(uri, None):
            handle.cancel()
        path = self.convert.path(uri)
        if path is not None and path in self.project.unsaved:
            self._publish(path, None)

    def _publish(self, path: Path, text: str | None) -> None:
        for file, findings in self.project.change(path, text).items():
            shown = [self.convert.diagnostic(file, finding) for finding in findings]
            uri = self.convert.uri(file)
            self.server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, shown))

    def _text(self, uri: str) -> str:
        return self.server.workspace.get_text_document(uri).source.replace("\r\n", "\n")

    def document(self, uri: str) -> Document | None:
        """Return a document with its newest text, None if it is none of ours."""
        path, text = self.convert.path(uri), self._text(uri)
        if path is None or (text.strip() and not self.project.has(path, text)):
            return None
        return Document(path, text, self.project.robot_of(path))

    def completion(self, params: types.CompletionParams) -> types.CompletionList:
        """Propose what may be written."""
        document = self.document(params.text_document.uri)
        if document is None:
            return types.CompletionList(is_incomplete=False, items=[])
        place = self.convert.position(document.text, params.position)
        found = enumerate(complete(document, *place))
        return types.CompletionList(
            is_incomplete=False, items=[self.convert.item(document.text, place, turn, one) for turn, one in found]
        )

    def definition(self, params: types.DefinitionParams) -> types.Location | None:
        """Tell where something is written."""
        document = self.document(params.text_document.uri)
        span = define(document, *self.convert.position(document.text, params.position)) if document else None
        return self.convert.location(span) if span else None

    def hover(self, params: types.HoverParams) -> types.Hover | None:
        """Tell what something is."""
        document = self.document(params.text_document.uri)
        text = describe(document, *self.convert.position(document.text, params.position)) if document else ""
        return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, text)) if text else None

    def code_action(self, params: types.CodeActionParams) -> list[types.CodeAction]:
        """Offer the fixes of what is wrong here."""
        path = self.convert.path(params.text_document.uri)
        findings = self.project.findings(path) if path else []
        lines = params.range.start.line, params.range.end.line
        return [self.convert.action(one) for one in actions(self.project, findings, *lines)]


def make_server(environment: Mapping[str, str]) -> LanguageServer:
    """Return a server; `environment` is what `${env.NAME}` sees."""
    server = LanguageServer("rbxcompose", rbxcompose.__version__)
    session = Session(server, environment)

    for notice, take in (
        (types.TEXT_DOCUMENT_DID_OPEN, session.opened),
        (types.TEXT_DOCUMENT_DID_SAVE, session.opened),
        (types.TEXT_DOCUMENT_DID_CHANGE, session.changed),
        (types.TEXT_DOCUMENT_DID_CLOSE, session.closed),
    ):
        server.feature(notice)(_of_document(take))
    triggers = types.CompletionOptions(trigger_characters=list(TRIGGERS))
    fixes = types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix])
    server.feature(types.TEXT_DOCUMENT_COMPLETION, triggers)(_function(session.completion))
    server.feature(types.TEXT_DOCUMENT_DEFINITION)(_function(session.definition))
    server.feature(types.TEXT_DOCUMENT_HOVER)(_function(session.hover))
    server.feature(types.TEXT_DOCUMENT_CODE_ACTION, fixes)(_function(session.code_action))
    return server


class _Notice(Protocol):
    """A notification about one document."""

    @property
    def text_document(self) -> types.TextDocumentItem | types.TextDocumentIdentifier: ...


def _of_document(take: Callable[[str], None]) -> Callable[[_Notice], None]:
    """Return a handler that hands on which document a notification is about."""
    return lambda params: take(params.text_document.uri)


def _function(method: Callable[[P], R]) -> Callable[[P], R]:
    """Return a method as a plain function: pygls marks what it registers, and a bound method cannot be marked."""
    return lambda params: method(params)
