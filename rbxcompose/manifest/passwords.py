"""Passwords in the addresses that a manifest contains."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.manifest.scalar_parts import part_span
from rbxcompose.manifest.tree import ScalarNode, TreeNode, children

PASSWORD = kind("RBX1321", Severity.WARNING)

_WITH_PASSWORD = re.compile(r"[A-Za-z][A-Za-z0-9+.-]{0,20}://[^\s/:@]{0,60}:(?P<password>[^\s/@]{1,200})@")
_HIDDEN = re.compile(r"\*+|\$.*|<.*>")  # what stands for a password is none


def passwords(text: str, root: TreeNode) -> Iterator[Finding]:
    """Yield a finding for each password in the values of a file; `text` is that of the whole file."""
    if "://" not in text or not _WITH_PASSWORD.search(text):
        return
    waiting = [root]
    while waiting:
        node = waiting.pop()
        waiting += (child for _, child in children(node))
        if isinstance(node, ScalarNode):
            yield from _within(node)


def _within(scalar: ScalarNode) -> Iterator[Finding]:
    for found in _WITH_PASSWORD.finditer(scalar.text):
        if not _HIDDEN.fullmatch(found["password"]):
            yield PASSWORD.at(
                part_span(scalar, *found.span("password")),
                "this address contains a password, which everybody sees who sees this file",
                help="where a secret is taken, put the whole address into 'secrets/NAME' and write '${secret.NAME}'",
            )
