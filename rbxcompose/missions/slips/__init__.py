"""The slips of missions, a module for each subject: what is written, what to say, and what to read instead.

Each is a function of a `GrammarPlace` and the node there, under `@slip(PLACES)`; it returns None if there is no slip.
"""

from collections.abc import Callable

from rbxcompose.manifest.slips import Repair, Slips
from rbxcompose.manifest.tree import TreeNode
from rbxcompose.missions.language.grammar import GrammarPlace

slip: Slips[Callable[[GrammarPlace, TreeNode], Repair[TreeNode] | None]] = Slips(__name__)
