"""Conversion of the core's results to the types of the protocol."""

from collections.abc import Callable
from pathlib import Path

from lsprotocol import types
from pygls.uris import from_fs_path, to_fs_path
from pygls.workspace import PositionCodec
from pygls.workspace.position_codec import ServerTextPosition

from rbxcompose.base.findings import Finding, Severity, Span
from rbxcompose.tools.lsp.answers import OutlineEntry
from rbxcompose.tools.lsp.completion import CompletionItem
from rbxcompose.tools.lsp.mentions import Mention
from rbxcompose.tools.lsp.project_files import ScalarPlaces
from rbxcompose.tools.lsp.rename import CodeAction, Renamed, TextChange

SOURCE = "rbxcompose"
_SEVERITIES = {Severity.ERROR: types.DiagnosticSeverity.Error, Severity.WARNING: types.DiagnosticSeverity.Warning}
_SORTS = {
    "key": types.CompletionItemKind.Property,
    "name": types.CompletionItemKind.Reference,
    "word": types.CompletionItemKind.EnumMember,
    "unit": types.CompletionItemKind.Unit,
    "variable": types.CompletionItemKind.Variable,
}
_OUTLINED = {
    "section": types.SymbolKind.Namespace,
    "name": types.SymbolKind.Object,
    "step": types.SymbolKind.Event,
    "state": types.SymbolKind.Class,
    "value": types.SymbolKind.Property,
}


def real_path(uri: str) -> Path | None:
    """Return the real path of a document, None if it is not a file."""
    written = to_fs_path(uri)
    return None if not written or "\0" in written else Path(written).resolve()


class Converter:
    """Knows the units in which the editor counts, and its names for files."""

    def __init__(self, text: Callable[[Path], str], codec: PositionCodec) -> None:
        self.text = text
        self.codec = codec
        self._uris: dict[Path, str] = {}

    def path(self, uri: str) -> Path | None:
        """Return the real path of a document, None if it is not a file; its name is remembered for the answers."""
        if (path := real_path(uri)) is not None:
            self._uris[path] = uri
        return path

    def uri(self, path: Path) -> str:
        """Return the editor's name for a file."""
        return self._uris.get(path) or from_fs_path(str(self._as_opened(path))) or ""

    def _as_opened(self, path: Path) -> Path:
        """Return a file below the folder that the editor has opened, which may be a link to where it really is."""
        for real, uri in self._uris.items():
            written = Path(to_fs_path(uri) or "")
            beside = zip(real.parents, written.parents, strict=False)
            named = next((link / path.relative_to(above) for above, link in beside if path.is_relative_to(above)), path)
            if named.resolve() == path:
                return named
        return path

    def position(self, text: str, position: types.Position) -> tuple[int, int]:
        """Return the line and character, counted from 0."""
        found = self.codec.position_from_client_units(text.split("\n"), position)
        return found.line, found.character

    def range(self, text: str, start: tuple[int, int], end: tuple[int, int]) -> types.Range:
        """Return the range of a text between two of our positions."""
        lines = text.split("\n")
        first, last = (self.codec.position_to_client_units(lines, ServerTextPosition(*pair)) for pair in (start, end))
        return types.Range(first, last)

    def location(self, span: Span) -> types.Location:
        """Return a place in a file."""
        path = Path(span.file).resolve()
        return types.Location(self.uri(path), self._span(self.text(path), span))

    def _span(self, text: str, span: Span) -> types.Range:
        return self.range(text, (span.line - 1, span.column - 1), (span.end_line - 1, span.end_column - 1))

    def diagnostic(self, path: Path, finding: Finding) -> types.Diagnostic:
        """Return a finding as a diagnostic; its help follows below the message."""
        words = f"{finding.message} ({finding.label})" if finding.label else finding.message
        related = [types.DiagnosticRelatedInformation(self.location(one.span), one.message) for one in finding.related]
        span = finding.span or Span("", 1, 1, 1, 1)
        return types.Diagnostic(
            range=self._span(self.text(path), span),
            message=f"{words}\n{finding.help}" if finding.help else words,
            severity=_SEVERITIES[finding.severity],
            code=finding.code,
            source=SOURCE,
            related_information=related,
        )

    def item(self, text: str, place: tuple[int, int], number: int, item: CompletionItem) -> types.CompletionItem:
        """Return a proposal at a place of a text; `number` is its rank."""
        line, column = place
        edit = types.TextEdit(self.range(text, (line, column - item.replaces), place), item.text)
        about = types.MarkupContent(types.MarkupKind.Markdown, item.about) if item.about else None
        return types.CompletionItem(
            label=item.label,
            kind=_SORTS[item.sort],
            detail=item.detail or None,
            documentation=about,
            sort_text=f"{number:04}",
            text_edit=edit,
        )

    def action(self, action: CodeAction) -> types.CodeAction:
        """Return a fix."""
        changes = {self.uri(path): [self._edit(self.text(path), change)] for path, change in action.changes.items()}
        path = Path(action.finding.span.file).resolve() if action.finding.span else None
        return types.CodeAction(
            title=action.title,
            kind=types.CodeActionKind.QuickFix,
            diagnostics=[self.diagnostic(path, action.finding)] if path else None,
            is_preferred=action.is_safe,
            edit=types.WorkspaceEdit(changes=changes),
        )

    def _edit(self, text: str, change: TextChange) -> types.TextEdit:
        return types.TextEdit(self.range(text, change.start, change.end), change.text)

    def mention(self, text: str, mention: Mention) -> types.Location:
        """Return the place of a name in the text of its file."""
        places = ScalarPlaces(text)
        start, end = places.position(mention.start), places.position(mention.end)
        return types.Location(self.uri(mention.file), self.range(text, start, end))

    def renamed(self, renamed: Renamed, text: Callable[[Path], str]) -> types.WorkspaceEdit:
        """Return the changes of a rename in the texts that it was made for."""
        found = renamed.changes.items()
        return types.WorkspaceEdit(
            {self.uri(path): [self._edit(text(path), one) for one in ones] for path, ones in found}
        )

    def outlined(self, text: str, entry: OutlineEntry) -> types.DocumentSymbol:
        """Return a line of an outline, with those below it."""
        return types.DocumentSymbol(
            name=entry.name or "''",
            kind=_OUTLINED[entry.sort],
            range=self._span(text, entry.span),
            selection_range=self._span(text, entry.key),
            detail=entry.detail or None,
            children=[self.outlined(text, below) for below in entry.below],
        )
