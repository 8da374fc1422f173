"""Names in missions: which texts are valid, and what to write instead of an invalid one."""

from __future__ import annotations

import re

from rbxcompose.base.findings import Finding, Fix
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions import codes

NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
NAME_HELP = "names start with a lower-case letter; lower-case letters, digits and underscores follow"
_BETWEEN = re.compile(r"[\s-]+")


def cure(text: str) -> str:
    """Return the name that a text was meant to be, `go_home` for `Go home`; empty if that is not clear."""
    meant = _BETWEEN.sub("_", text.strip()).lower()
    return meant if NAME.fullmatch(meant) else ""


def no_name(scalar: ScalarNode, fix: Fix | None = None) -> Finding:
    """Return the finding on a text that is not a valid name."""
    meant = cure(scalar.text)
    help_text = f"write '{meant}': names have lower-case letters, digits and underscores" if meant else NAME_HELP
    return codes.WRONG_SHAPE.at(scalar.span, f"'{scalar.text}' is not a valid name", help=help_text, fix=fix)
