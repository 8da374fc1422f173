"""Lists written without their brackets."""

from __future__ import annotations

import re

from rbxcompose.findings import Fix, replacement
from rbxcompose.manifest.tree import ScalarNode, TreeNode

_ITEM = re.compile(r"\s*+([A-Za-z0-9_.$+-]++(?: [A-Za-z0-9_.%/]++)?)\s*+")  # a word, a name, a number with its unit


def without_brackets(node: TreeNode | None) -> list[tuple[str, int]]:
    """Return the items, with their offsets, of a text that lacks only the brackets of a list; none of any other.

    Round brackets in their place are accepted, too.
    """
    if not isinstance(node, ScalarNode) or not node.plain or node.filled is not None or not node.text:
        return []
    start, end = (1, -1) if node.text[0] == "(" and node.text[-1] == ")" else (0, None)
    pieces = node.text[start:end].split(",")
    found = []
    for piece in pieces[:-1] if len(pieces) > 1 and not pieces[-1].strip() else pieces:
        item = _ITEM.fullmatch(piece)
        if item is None:
            return []
        found.append((item[1], start + item.start(1)))
        start += len(piece) + 1
    return found


def bracketed(node: ScalarNode) -> tuple[str, Fix]:
    """Return the help and the fix for a text that lacks the brackets of a list."""
    meant = f"[{', '.join(text for text, _ in without_brackets(node))}]"
    return f"a list needs brackets: write '{meant}'", replacement(node.span, node.text, meant)
