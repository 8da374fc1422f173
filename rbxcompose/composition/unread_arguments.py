"""Arguments that nothing reads."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.manifest.tree import MappingNode, ScalarNode, TreeNode, children

UNREAD_ARGUMENT = kind("RBX1209", Severity.WARNING)
_NAME = re.compile(r"\bargs\.([a-z][a-z0-9_]*)")


def unread_arguments(root: MappingNode) -> Iterator[Finding]:
    """Yield a finding for each argument of a robot's or part's file that no other text of it has."""
    declared = root.get("args")
    if not isinstance(declared, MappingNode):
        return
    read = frozenset(_read(root))
    for name, entry in declared.entries.items():
        if name not in read and isinstance(entry.value, MappingNode):
            help_text = f"write '${{args.{name}}}' where its value belongs, or remove it"
            yield UNREAD_ARGUMENT.at(entry.key.span, f"nothing reads the argument '{name}'", help=help_text)


def _read(node: TreeNode) -> Iterator[str]:
    if isinstance(node, ScalarNode):
        yield from _NAME.findall(node.text) if "args." in node.text else ()
    for _, below in children(node):
        yield from _read(below)
