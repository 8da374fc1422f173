"""Which pairs of links need not be watched."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.link_pairs import LinkPair

Array = NDArray[np.float64]
SAMPLES, SEED = 200, 1


def unavoidable_pairs(samples: Array, colliding: Callable[[Array], Collection[LinkPair]]) -> frozenset[LinkPair]:
    """Return the pairs that collide at all of some positions, of shape (count, n): nobody could avoid that."""
    found: frozenset[LinkPair] | None = None
    for values in samples:
        here = frozenset(colliding(values))
        found = here if found is None else found & here
        if not found:
            break
    return found or frozenset()
