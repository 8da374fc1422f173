"""The slips of manifests, one file each: in their text, and in values that a model refuses.

`@value_slip(ERRORS)` decorates a function of a `RefusedValue` and the node there, which returns the node that was
meant. It counts only if the model accepts that.

`@text_slip(WORDS)` decorates a function of a `Trouble`. It has another shape, since it cannot repair anything: the
parser has stopped, and nobody knows what else is in a text that it cannot read. Both return None for no slip.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from rbxcompose.findings import Finding
from rbxcompose.manifest.parser_error import Trouble
from rbxcompose.manifest.tree import KeyPath, TreeNode
from rbxcompose.slips import Repair, Slips

# Messages of the parser.
COLON = "mapping values are not allowed"
NO_COLON = "could not find expected ':'"
NO_DASH = "did not find expected '-' indicator"
NO_KEY = "did not find expected key"
ANY = ""


class RefusedValue(NamedTuple):
    """A place that a model refuses: its path in the file, and the finding to report if it is not a slip.

    For a key that is missing or unknown, the node is the map around it; `keys` are those that it takes, if unknown.
    """

    path: KeyPath
    finding: Finding
    keys: Sequence[str] = ()


text_slip: Slips[Callable[[Trouble], Finding | None]] = Slips(__name__)
value_slip: Slips[Callable[[RefusedValue, TreeNode], Repair[TreeNode] | None]] = Slips(__name__)
