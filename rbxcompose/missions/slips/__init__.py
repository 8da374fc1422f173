"""The slips of missions, by what they repair: what is written at a place of the grammar, what to say, and how to read it."""

Each is a function of a `GrammarPlace` and the node there, under `@slip(PLACES)`; it returns None if there is no slip.
"""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.manifest.tree import TreeNode
from rbxcompose.missions.language.grammar import GrammarPlace
from rbxcompose.slips import Repair, Slips

slip: Slips[Callable[[GrammarPlace, TreeNode], Repair[TreeNode] | None]] = Slips(__name__)
