"""Files of other programs that are given as a manifest: XML."""

from __future__ import annotations

import re
from collections.abc import Mapping

from rbxcompose.findings import Finding, Span, kind

XML = kind("RBX1320")

_ABOVE = re.compile(r"\s*+(?:<\?.*?\?>\s*+|<!--.*?-->\s*+|<!DOCTYPE[^>]*+>\s*+)*+", re.DOTALL)
_ROOT = re.compile(r"<([A-Za-z_][\w.:-]*+)")
_TREE = "a behaviour tree: write it as a mission; 'fallback', 'sequence' and 'parallel' are steps"
_CURES: Mapping[str, str] = {
    "robot": "a URDF: a robot names it by 'body: {urdf: FILE}'",
    "xacro": "a xacro file: a robot names it by 'body: {xacro: FILE}'",
    "launch": "a ROS launch file: write its nodes as 'components'; 'rbxcompose new robot NAME' begins a robot",
    "root": _TREE,
    "BehaviorTree": _TREE,
    "scxml": "a state machine: write it as a mission with 'machine'",
    "sdf": "an SDF file: the body of a robot is a URDF, named by 'body: {urdf: FILE}'",
}


def foreign_text(text: str, file: str) -> Finding | None:
    """Return the finding about a text that is XML, with what its root element tells; None for any other text."""
    if not text[:1000].lstrip().startswith("<"):
        return None
    above = _ABOVE.match(text)
    root = _ROOT.match(text, above.end() if above else 0)
    if root is None:
        return None
    line = text.count("\n", 0, root.start()) + 1
    column = root.start() - text.rfind("\n", 0, root.start())
    span = Span(file, line, column, line, column + len(root[0]))
    known = _CURES.get("xacro" if root[1] == "robot" and "xacro:" in text else root[1], "")
    return XML.at(span, "this is XML; a manifest is YAML", help=f"this is {known}" if known else "")
