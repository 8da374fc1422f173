"""Findings as SARIF 2.1.0, the interchange format of static analysis; code scanning and editors read it."""

import json
from collections.abc import Iterable
from pathlib import Path, PurePath
from urllib.parse import quote

import rbxcompose
from rbxcompose.base.findings import COMMAND_LINE, KINDS, Finding, Fix, Related, Report, Sources, Span, exact_fix
from rbxcompose.commands.finding_pages import page_of
from rbxcompose.commands.formats import output_format

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "%SRCROOT%"
_BRACES = str.maketrans({"{": "{{", "}": "}}"})  # single braces are placeholders in a message

Data = dict[str, object]


@output_format("sarif")
def render_sarif(report: Report, sources: Sources, colour: bool = False) -> str:
    """Return one run with all findings, sorted by place, and a rule for each code among them."""
    findings = list(report)
    codes = sorted({finding.code for finding in findings})
    main = next((file for file in sources if not file.startswith(COMMAND_LINE)), None)
    driver = {"name": "rbxcompose", "version": rbxcompose.__version__, "rules": [_rule(code) for code in codes]}
    run: Data = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, codes, sources, main) for finding in findings],
    }
    log = {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}
    return json.dumps(log, indent=2, ensure_ascii=False) + "\n"


def _rule(code: str) -> Data:
    kind = KINDS.get(code)
    if kind is None:
        return {"id": code}
    title, body = page_of(kind)
    summary = body.partition("\n\n")[0] or title
    return {
        "id": code,
        "shortDescription": _message(title),
        "fullDescription": _message(summary.replace("\n", " ")),
        "help": {**_message(f"{title}\n\n{body}"), "markdown": f"# {title}\n\n{body}"},
        "defaultConfiguration": {"level": kind.severity.value},
    }


def _message(*lines: str) -> Data:
    return {"text": "\n".join(line for line in lines if line).translate(_BRACES)}


def _result(finding: Finding, codes: list[str], sources: Sources, main: str | None) -> Data:
    """Return a finding; one without a file is placed at the file that was compiled, `main`."""
    span, note = finding.span, ""
    if span is not None and span.file.startswith(COMMAND_LINE):
        span, note = None, f"at {span}"
    place = _place(span) if span else {"physicalLocation": {"artifactLocation": _artifact(main)}} if main else None
    help_text = f"help: {finding.help}" if finding.help else ""
    result: Data = {
        "ruleId": finding.code,
        "ruleIndex": codes.index(finding.code),
        "level": finding.severity.value,
        "message": _message(finding.message, note, finding.label, help_text),
        "locations": [place] if place else [],
    }
    related = dict.fromkeys(one for one in finding.related if not one.span.file.startswith(COMMAND_LINE))
    if related:
        result["relatedLocations"] = [_related(number, one) for number, one in enumerate(related, 1)]
    fix = exact_fix(finding.fix, sources)
    if fix and not any(edit.span.file.startswith(COMMAND_LINE) for edit in fix.edits):
        result["fixes"] = [_fix(fix)]
    return result


def _related(number: int, related: Related) -> Data:
    return {"id": number, **_place(related.span), "message": _message(related.message)}


def _place(span: Span) -> Data:
    return {"physicalLocation": {"artifactLocation": _artifact(span.file), "region": _region(span)}}


def _artifact(file: str) -> Data:
    if PurePath(file).is_absolute():
        return {"uri": Path(file).as_uri()}
    return {"uri": quote(PurePath(file).as_posix()), "uriBaseId": ROOT}


def _region(span: Span) -> Data:
    return {"startLine": span.line, "startColumn": span.column, "endLine": span.end_line, "endColumn": span.end_column}


def _fix(fix: Fix) -> Data:
    files = dict.fromkeys(edit.span.file for edit in fix.edits)
    changes = [{"artifactLocation": _artifact(file), "replacements": list(_replacements(fix, file))} for file in files]
    return {"description": _message(fix.title), "artifactChanges": changes}


def _replacements(fix: Fix, file: str) -> Iterable[Data]:
    for edit in fix.edits:
        if edit.span.file == file and edit.text != edit.old:
            yield {"deletedRegion": _region(edit.span), "insertedContent": {"text": edit.text}}
