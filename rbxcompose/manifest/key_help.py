"""What to do about a key that is missing, or that stands one level too high."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, get_args, get_origin

from rbxcompose.expressions.tokens import CURLY_QUOTES
from rbxcompose.findings import DID_YOU_MEAN, Finding, replacement
from rbxcompose.manifest.shapes import alternatives, field_types, keys_at, models_at
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, TreeNode, at
from rbxcompose.printable import plain


def about_key(model: Any, loc: KeyPath) -> str:
    """Return what the key at `loc` below a model is for, as words that follow its name; empty if that is not known."""
    from rbxcompose.field_docs import field_docs  # reads source files

    docs = (field_docs(one).get(str(loc[-1]), "") for one in models_at(model, loc[:-1]))
    about = next((text.partition(";")[0].partition(". ")[0].rstrip(".") for text in docs if text), "")
    return f": {about[:1].lower()}{about[1:]}".replace("`", "'") if about else ""


def _key_above(model: Any, loc: KeyPath, node: TreeNode | None) -> str:
    """Return the key whose named entries the map `node`, at the unknown key `loc`, looks like one of; else nothing."""
    if not isinstance(node, MappingNode) or not node.entries:
        return ""
    fields = (pair for one in models_at(model, loc[:-1]) for pair in field_types(one).items())
    maps = ((name, one) for name, hint in fields for one in alternatives(hint) if get_origin(one) is dict)
    return next((name for name, one in maps if node.entries.keys() & {*keys_at(get_args(one)[1], ())}), "")


def with_cure(
    finding: Finding, model: Any, loc: KeyPath, node: TreeNode | None, absent: Sequence[str]
) -> tuple[Finding, str]:
    """Return the finding about an unknown key at `loc` with what to do, and the key that was meant instead, if any.

    `absent` are keys that its map needs and does not have.
    """
    if above := _key_above(model, loc, node):
        return replace(finding, help=f"write it below '{above}:', one level deeper", fix=None), above
    if len(absent) == 1 and not finding.help.startswith(DID_YOU_MEAN):
        about = about_key(model, (*loc[:-1], absent[0]))
        return replace(finding, help=f"write '{absent[0]}: ...' instead, which is needed{about}", fix=None), absent[0]
    return finding, ""


def written_deeper(node: TreeNode, loc: KeyPath) -> set[KeyPath]:
    """Return where the keys below the unknown key at `loc` would be one level higher."""
    below = at(node, loc)
    return {(*loc[:-1], key) for key in below.entries} if isinstance(below, MappingNode) else set()


def in_straight_quotes(finding: Finding, node: TreeNode | None) -> Finding:
    """Return the finding about a refused value; if it is in the quotes of books, with how to write those of YAML."""
    text = node.text if isinstance(node, ScalarNode) and node.plain else ""
    if len(text) < len("''") or text[0] not in CURLY_QUOTES or text[-1] not in CURLY_QUOTES:
        return finding
    right = f'"{text.strip(CURLY_QUOTES)}"'
    return replace(
        finding,
        help=f"quotes are straight: write '{plain(right, 60)}'",
        fix=replacement(finding.span, text, right) if finding.span else None,
    )
