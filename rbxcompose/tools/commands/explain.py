"""Explain the code of a finding and how to correct it; without a code, list all.

Exit codes: 0 fine, 2 there is no such code.
"""

import argparse
import json
from itertools import groupby

from rbxcompose.base.findings import FindingKind, suggest
from rbxcompose.commands.console import emit, misused
from rbxcompose.commands.finding_pages import all_kinds, body_of, family_of, kind_of, text_of, title_of

GROUP = "write"
_PREFIX = "RBX"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("code", nargs="?", metavar="CODE", help="such as RBX1001; without it, list all codes")
    parser.add_argument("--json", action="store_true", help="answer in JSON")


def run(arguments: argparse.Namespace) -> int:
    """Write the page of one code, or the list of all codes."""
    if arguments.code is None:
        kinds = all_kinds()
        emit(_as_json(list(kinds.values())) if arguments.json else _listed(kinds))
        return 0
    written = arguments.code.upper()
    code = _PREFIX + written.removeprefix(_PREFIX)
    found = kind_of(code)
    kinds = {} if found else all_kinds()  # those of other packages, too
    found = found or kinds.get(written)
    if found is None:
        family = [known for known in kinds if known.startswith(code[: len(_PREFIX) + 2])]
        hint = suggest(code, family or kinds, "codes")
        return misused("explain", f"there is no code {arguments.code!r}; {hint}")
    emit(_as_json(found) if arguments.json else text_of(found).rstrip("\n"))
    return 0


def _listed(kinds: dict[str, FindingKind]) -> str:
    lines = []
    for family, each in groupby(kinds.values(), family_of):
        lines += ["", f"{family}:", *(f"  {kind.code}  {title_of(kind)}" for kind in each)]
    return "\n".join(lines[1:])


def _as_json(what: FindingKind | list[FindingKind]) -> str:
    data = [_data(kind) for kind in what] if isinstance(what, list) else _data(what)
    return json.dumps(data, indent=2, ensure_ascii=False)


def _data(kind: FindingKind) -> dict[str, object]:
    return {
        "code": kind.code,
        "title": title_of(kind),
        "severity": kind.severity.value,
        "family": family_of(kind),
        "is_fixable": kind.is_fixable,
        "text": body_of(kind),
    }
