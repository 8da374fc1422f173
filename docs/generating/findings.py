"""One page per code of a finding, written by people but for its line of facts, and their index."""

from __future__ import annotations

from itertools import groupby

from rbxcompose.commands.finding_pages import all_kinds, family_of, markdown_of, title_of

INTRODUCTION = """# Findings

What `rbxcompose check` may report, by code. `rbxcompose explain CODE` shows the same pages without a network.
`rbxcompose check --fix` corrects those marked *fix* where the correction is certain.
"""


def pages() -> dict[str, str]:
    """Return file name -> text of all pages, the index included."""
    kinds = all_kinds()
    index = INTRODUCTION
    for family, members in groupby(kinds.values(), family_of):
        index += f"\n## {family.capitalize()}\n"
        for kind in members:
            marks = [kind.severity.value, *(["*fix*"] if kind.is_fixable else [])]
            index += f"- [{kind.code}]({kind.code}.md) ({', '.join(marks)}): {title_of(kind)}\n"
    return {**{f"{code}.md": markdown_of(kind) for code, kind in kinds.items()}, "README.md": index}
