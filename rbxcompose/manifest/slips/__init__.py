"""The slips in the text of manifests, one file each, by the words of the parser that they lead to.

Each is a function of a `Trouble` under `@text_slip(WORDS)`; it returns None for what is no slip. It has no shape in
common with slips of trees, which return a repaired node: the parser has given up, and of a text that it cannot read
nobody knows what else stands in it.
"""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.findings import Finding
from rbxcompose.manifest.trouble import Trouble
from rbxcompose.slips import Slips

# What the parser says, in its words.
COLON = "mapping values are not allowed"
NO_COLON = "could not find expected ':'"
NO_DASH = "did not find expected '-' indicator"
NO_KEY = "did not find expected key"
ANY = ""

text_slip: Slips[Callable[[Trouble], Finding | None]] = Slips(__name__)
