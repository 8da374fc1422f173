"""Findings as JSON, with all that is known of each."""

import json

from rbxcompose.base.findings import Finding, Fix, Report, Sources, Span, exact_fix
from rbxcompose.commands.formats import output_format


@output_format("json")
def render_json(report: Report, sources: Sources, colour: bool = False) -> str:
    """Return all findings as a JSON list, sorted by place."""
    return json.dumps([as_data(finding, sources) for finding in report], indent=2, ensure_ascii=False) + "\n"


def as_data(finding: Finding, sources: Sources) -> dict[str, object]:
    """Return all that is known of a finding."""
    fix = exact_fix(finding.fix, sources)
    return {
        "code": finding.code,
        "severity": finding.severity,
        "message": finding.message,
        **_place(finding.span),
        "label": finding.label,
        "help": finding.help,
        "related": [{**_place(related.span), "message": related.message} for related in finding.related],
        "fix": _fix(fix) if fix else None,
    }


def _fix(fix: Fix) -> dict[str, object]:
    edits = [{**_place(edit.span), "old": edit.old, "text": edit.text} for edit in fix.edits]
    return {"title": fix.title, "is_safe": fix.is_safe, "edits": edits}


def _place(span: Span | None) -> dict[str, object]:
    return dict.fromkeys(Span._fields) if span is None else span._asdict()
