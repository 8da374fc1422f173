"""Lists that were written without their brackets."""

from __future__ import annotations

import re

from rbxcompose.findings import Fix, replacement
from rbxcompose.manifest.tree import Node, Scalar

ITEM = r"[A-Za-z0-9_.$+-]+(?: [A-Za-z0-9_.%/]+)?"  # a word, a name, a number with its unit
_ITEMS = re.compile(rf"\s*{ITEM}\s*(?:,\s*{ITEM}\s*)*,?\s*")


def without_brackets(node: Node | None) -> list[tuple[str, int]]:
    """Return the items, with their offsets, of a text that lacks but the brackets of a list; nothing of any other.

    Round brackets in their place are taken as well.
    """
    if not isinstance(node, Scalar) or not node.plain or node.filled is not None or not node.text:
        return []
    start, end = (1, -1) if node.text[0] == "(" and node.text[-1] == ")" else (0, None)
    inner = node.text[start:end]
    if not _ITEMS.fullmatch(inner):
        return []
    return [(found.group(), start + found.start()) for found in re.finditer(ITEM, inner)]


def bracketed(node: Node | None) -> tuple[str, Fix | None]:
    """Return the help for a text that lacks the brackets of a list, and its fix; nothing for any other node."""
    items = [text for text, _ in without_brackets(node)]
    if not items or not isinstance(node, Scalar):
        return "", None
    meant = f"[{', '.join(items)}]"
    return f"a list has brackets: write '{meant}'", replacement(node.span, node.text, meant)
