"""What arguments allow: it also bounds a setting that is nothing but such a value while the robot runs."""

from __future__ import annotations

import re
from collections.abc import Mapping

from rbxcompose.config import Bound
from rbxcompose.manifest.arguments import DeclaredArgument, size_of
from rbxcompose.manifest.tree import BROKEN, ScalarNode, TreeNode

_ARGUMENT = re.compile(r"\$\{\s*args\.(\w+)\s*\}")  # a value that is nothing else
ScopedBounds = Mapping[str, Mapping[str, tuple[Bound, ...]]]


def bounds_of(written: TreeNode | None, bounds: ScopedBounds) -> tuple[Bound, ...]:
    """Return what bounds a value as written: that of the argument which it names, if it is nothing else."""
    found = argument_of(written) if isinstance(written, ScalarNode) else None
    return bounds.get(written.scope, {}).get(found, ()) if found and isinstance(written, ScalarNode) else ()


def argument_of(written: ScalarNode) -> str | None:
    """Return the argument that a value is taken from, if it is nothing else: `speed` of `${args.speed}`."""
    found = _ARGUMENT.fullmatch(written.text)
    return found[1] if found else None


def own_bounds(name: str, argument: DeclaredArgument | None, whose: str) -> tuple[Bound, ...]:
    """Return what a declared argument allows; `whose` it is, in words."""
    if argument is None:
        return ()
    least, most = (None if one is None or one is BROKEN else size_of(one) for one in (argument.least, argument.most))
    return (Bound(least, most, f"the argument '{name}' of {whose}"),) if (least, most) != (None, None) else ()
