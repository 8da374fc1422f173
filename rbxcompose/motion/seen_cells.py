"""Cells of space in which a sensor has seen something, until it has not seen that for a while."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Keys = NDArray[np.int64]
_BITS = 21  # of the number of a cell along each axis
_HALF, _MASK = 1 << (_BITS - 1), (1 << _BITS) - 1


class SeenCells:
    """Cells with sides of `side` [m]; each is forgotten `forget` [s] after it was seen last."""

    def __init__(self, side: float, forget: float) -> None:
        self.side, self.forget = side, forget
        self._keys: Keys = np.empty(0, dtype=np.int64)  # sorted
        self._seen: Array = np.empty(0)

    def __len__(self) -> int:
        return len(self._keys)

    def found(self, points: Array, least: int = 1) -> Array:
        """Return the middles of the cells with at least so many of the points, of shape (n, 3); all in [m]."""
        keys, counts = np.unique(self._key(points), return_counts=True)
        return self._middles(keys[counts >= least])

    def see(self, middles: Array, now: float) -> bool:
        """Note that cells are seen at a time [s], and forget old ones; return whether others are there than before."""
        new, before = np.unique(self._key(middles)), self._keys
        is_kept = (self._seen > now - self.forget) & (self._seen <= now) & ~np.isin(before, new, assume_unique=True)
        keys = np.concatenate((before[is_kept], new))
        order = np.argsort(keys)
        self._keys = keys[order]
        self._seen = np.concatenate((self._seen[is_kept], np.full(len(new), now)))[order]
        return not np.array_equal(before, self._keys)

    def middles(self) -> Array:
        """Return the middles of all cells [m], of shape (n, 3)."""
        return self._middles(self._keys)

    def _key(self, points: Array) -> Keys:
        cells = np.floor(points / self.side).astype(np.int64) + _HALF
        cells = cells[np.all((cells >= 0) & (cells <= _MASK), axis=1)]
        return np.asarray(cells[:, 0] << 2 * _BITS | cells[:, 1] << _BITS | cells[:, 2])

    def _middles(self, keys: Keys) -> Array:
        cells = np.stack([keys >> 2 * _BITS, keys >> _BITS & _MASK, keys & _MASK], axis=1)
        return (cells - _HALF + 0.5) * self.side
