"""The language server: passes requests of an editor to the core, over stdin and stdout."""

import logging
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from lsprotocol import types
from pygls.capabilities import get_capability
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer
from pygls.protocol import json_rpc

import rbxcompose
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.tools.lsp.answers import define, describe, outline
from rbxcompose.tools.lsp.completion import complete
from rbxcompose.tools.lsp.convert import Converter, real_path
from rbxcompose.tools.lsp.document import Document
from rbxcompose.tools.lsp.mentions import SymbolIndex, symbol_index_references
from rbxcompose.tools.lsp.project import PAUSE, FoundByFile, Newest, Project
from rbxcompose.tools.lsp.project_files import ProjectFiles
from rbxcompose.tools.lsp.rename import CannotRenameError, actions, compiler, prepare, rename

P = TypeVar("P")
R = TypeVar("R")
SWITCH = 0.001  # [s] that an answer waits for the other thread, which may be compiling
TRIGGERS = (" ", ":", "$", "{", ".", "-", "[", ",")
_MADE_OF = ("yaml", "yml", "urdf", "xacro", "srdf", "msg", "srv", "action", "pgm", "png")  # endings of a robot's files
_ON_DISK = types.WORKSPACE_DID_CHANGE_WATCHED_FILES
_REGISTERS = "workspace.did_change_watched_files.dynamic_registration"


_Notice = types.DidOpenTextDocumentParams | types.DidSaveTextDocumentParams | types.DidChangeTextDocumentParams


class RefusedRenameError(JsonRpcException):
    """Raised to answer a rename that is refused with the reason, which editors show."""

    CODE = types.LSPErrorCodes.RequestFailed.value


class Session:
    """One editor's session."""

    def __init__(self, server: LanguageServer, environment: Mapping[str, str]) -> None:
        self.server = server
        self.newest = Newest(Project(environment), self._publish)
        self._converter: Converter | None = None

    @property
    def project(self) -> Project:
        """Return the project as last compiled."""
        return self.newest.project

    @property
    def convert(self) -> Converter:
        """Return the converter, which needs the settings negotiated at the start."""
        if self._converter is None:
            self._converter = Converter(lambda path: self.project.text(path), self.server.workspace.position_codec)
        return self._converter

    def opened(self, params: _Notice, pause: float = 0.0) -> None:
        """Check a document."""
        path, text = self._read(params.text_document.uri)
        if path is not None and (self.newest.has(path) or self.project.has(path, text)):
            self.newest.change(path, text, pause)

    def changed(self, params: types.DidChangeTextDocumentParams) -> None:
        """Check a document after a short pause in typing."""
        self.opened(params, PAUSE)

    def closed(self, params: types.DidCloseTextDocumentParams) -> None:
        """Use the saved text again."""
        path = self.convert.path(params.text_document.uri)
        if path is not None and self.newest.has(path):
            self.newest.change(path, None)

    def changed_on_disk(self, params: types.DidChangeWatchedFilesParams) -> None:
        """Check everything again, unless the editor has the texts of all these files."""
        paths = (real_path(change.uri) for change in params.changes)
        if not all(path is None or self.newest.has(path) for path in paths):
            self.newest.compile_again(PAUSE)

    def begun(self, _: object) -> None:
        """Prepare for the first request, and ask for news of files that change on disk."""
        self.newest.prepare()
        if get_capability(self.server.client_capabilities, _REGISTERS, False):
            watchers = [types.FileSystemWatcher(f"**/*.{ending}") for ending in _MADE_OF]
            options = types.DidChangeWatchedFilesRegistrationOptions(watchers)
            wanted = types.RegistrationParams([types.Registration(_ON_DISK, _ON_DISK, options)])
            self.server.client_register_capability(wanted)

    def ended(self, _: object) -> None:
        """Stop the thread."""
        self.newest.close()

    def _publish(self, found: FoundByFile) -> None:
        for file, findings in found.items():
            shown = [self.convert.diagnostic(file, finding) for finding in findings]
            uri = self.convert.uri(file)
            self.server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, shown))

    def _read(self, uri: str) -> tuple[Path | None, str]:
        """Return the path and the newest text of a document; no path if it is no file, or can be read no more."""
        path = self.convert.path(uri)
        try:
            text = self.server.workspace.get_text_document(uri).source if path else ""
        except (OSError, UnicodeError):  # editors also ask about files that are gone or renamed
            return None, ""
        return path, text.replace("\r\n", "\n")

    def document(self, uri: str) -> Document | None:
        """Return a document with its newest text, None if it is not one of ours."""
        path, text = self._read(uri)
        if path is None or (text.strip() and not self.project.has(path, text)):
            return None
        return Document(path, text, self.project.robot_of(path))

    def completion(self, params: types.CompletionParams) -> types.CompletionList:
        """Propose what can be written."""
        document = self.document(params.text_document.uri)
        if document is None:
            return types.CompletionList(is_incomplete=False, items=[])
        place = self.convert.position(document.text, params.position)
        found = enumerate(complete(document, *place))
        return types.CompletionList(
            is_incomplete=False, items=[self.convert.item(document.text, place, turn, one) for turn, one in found]
        )

    def definition(self, params: types.DefinitionParams) -> types.Location | None:
        """Return the place where something is defined."""
        document = self.document(params.text_document.uri)
        span = define(document, *self.convert.position(document.text, params.position)) if document else None
        return self.convert.location(span) if span else None

    def hover(self, params: types.HoverParams) -> types.Hover | None:
        """Describe what is at a position."""
        document = self.document(params.text_document.uri)
        text = describe(document, *self.convert.position(document.text, params.position)) if document else ""
        return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, text)) if text else None

    def document_symbol(self, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        """Return the outline of a document."""
        document = self.document(params.text_document.uri)
        if document is None:
            return []
        return [self.convert.outlined(document.text, entry) for entry in outline(document.text)]

    def references(self, params: types.ReferenceParams) -> list[types.Location]:
        """Return where the name at a position is written."""
        document = self.document(params.text_document.uri)
        if document is None:
            return []
        index, place = self._index(document), self.convert.position(document.text, params.position)
        is_whole = params.context.include_declaration
        found = symbol_index_references(index, document.path, *place, with_definitions=is_whole)
        return [self.convert.mention(index.files.text(reference.file), reference) for reference in found]

    def prepare_rename(self, params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder | None:
        """Return the range of the name at a position, if it can be renamed."""
        document = self.document(params.text_document.uri)
        if document is None:
            return None
        index, place = self._index(document), self.convert.position(document.text, params.position)
        try:
            found = prepare(index, document.path, *place)
        except CannotRenameError as error:
            raise RefusedRenameError(str(error)) from None
        return types.PrepareRenamePlaceholder(self.convert.mention(document.text, found).range, found.symbol.name)

    def rename(self, params: types.RenameParams) -> types.WorkspaceEdit | None:
        """Rename what is at a position, in all files of the project."""
        document = self.document(params.text_document.uri)
        if document is None:
            return None
        index, place = self._index(document), self.convert.position(document.text, params.position)
        compiled = compiler(self.project.environment, self.newest.unsaved)
        try:
            made = rename(index, document.path, *place, params.new_name, compiled)
        except CannotRenameError as error:
            raise RefusedRenameError(str(error)) from None
        return self.convert.renamed(made, index.files.text)

    def _index(self, document: Document) -> SymbolIndex:
        """Return all names of the project around a document."""
        compiled = compiler(self.project.environment, self.newest.unsaved)

        def robot_of(path: Path) -> Robot | None:
            return self.project.robot_of(path) or compiled(path, {}).robot

        def text(path: Path) -> str:
            return document.text if path == document.path else self.newest.text(path)

        return SymbolIndex(ProjectFiles(document.path, text), robot_of)

    def code_action(self, params: types.CodeActionParams) -> list[types.CodeAction]:
        """Offer the fixes of the findings here."""
        path, text = self._read(params.text_document.uri)
        if path is None or not self.newest.is_compiled(path, text):
            return []  # the places of an older text would be wrong
        findings = self.project.findings(path)
        lines = params.range.start.line, params.range.end.line
        return [self.convert.action(action) for action in actions(self.project, findings, *lines)]


def make_server(environment: Mapping[str, str]) -> LanguageServer:
    """Return a server; `environment` is what `${env.NAME}` sees."""
    sys.setswitchinterval(SWITCH)
    logging.getLogger(json_rpc.__name__).addFilter(_is_no_refusal)
    server = LanguageServer("rbxcompose", rbxcompose.__version__)
    session = Session(server, environment)

    handlers: Mapping[str, Callable[[Any], object]] = {
        types.TEXT_DOCUMENT_DID_OPEN: session.opened,
        types.TEXT_DOCUMENT_DID_SAVE: session.opened,
        types.TEXT_DOCUMENT_DID_CHANGE: session.changed,
        types.TEXT_DOCUMENT_DID_CLOSE: session.closed,
        _ON_DISK: session.changed_on_disk,
        types.INITIALIZED: session.begun,
        types.SHUTDOWN: session.ended,
        types.TEXT_DOCUMENT_COMPLETION: session.completion,
        types.TEXT_DOCUMENT_DEFINITION: session.definition,
        types.TEXT_DOCUMENT_HOVER: session.hover,
        types.TEXT_DOCUMENT_DOCUMENT_SYMBOL: session.document_symbol,
        types.TEXT_DOCUMENT_REFERENCES: session.references,
        types.TEXT_DOCUMENT_PREPARE_RENAME: session.prepare_rename,
        types.TEXT_DOCUMENT_RENAME: session.rename,
        types.TEXT_DOCUMENT_CODE_ACTION: session.code_action,
    }
    options = {
        types.TEXT_DOCUMENT_COMPLETION: types.CompletionOptions(trigger_characters=list(TRIGGERS)),
        types.TEXT_DOCUMENT_RENAME: types.RenameOptions(prepare_provider=True),
        types.TEXT_DOCUMENT_CODE_ACTION: types.CodeActionOptions([types.CodeActionKind.QuickFix]),
    }
    for feature, handle in handlers.items():
        server.feature(feature, options.get(feature))(_function(handle))
    return server


def _is_no_refusal(record: logging.LogRecord) -> bool:
    """Return whether a line belongs in the log: pygls takes every refusal for an exception of ours."""
    return not (record.exc_info and isinstance(record.exc_info[1], RefusedRenameError))


def _function(method: Callable[[P], R]) -> Callable[[P], R]:
    """Return a method as a plain function: pygls marks what it registers, and a bound method cannot be marked."""
    return lambda params: method(params)
