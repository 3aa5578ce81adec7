"""Who may touch whom: cell-sorted grains, a Verlet half list, and the history that moves with it.

The list holds every pair closer than r_i + r_j + skin, once. It stays valid until two grains could have closed the
skin, that is until twice the largest displacement since it was built exceeds it. Grains are kept in the order of their
cells, which makes the force loop three times faster than any other order at 100,000 grains.
"""

from __future__ import annotations

import numpy as np

from dem.contact.columns import RADIUS, TWIST
from matter.compilation.jit import kernel


class Cells:
    """A uniform grid over the grains; ``order`` sorts them by cell, ``start`` (cells + 1) is where each cell
    begins."""

    def __init__(self, position: np.ndarray, size: float):
        count = len(position)
        self.low = position.min(axis=0) if count else np.zeros(3)
        span = (position.max(axis=0) if count else np.zeros(3)) - self.low
        # a few grains far away must not ask for an endless grid: larger cells are always allowed
        while True:
            self.shape = (span / size).astype(np.int64) + 1
            if np.prod(self.shape.astype(float)) <= 64.0 * count + 4096.0:
                break
            size *= 1.25
        self.size = size
        index = ((position - self.low) / size).astype(np.int64)
        np.minimum(index, self.shape - 1, out=index)
        flat = (index[:, 0] * self.shape[1] + index[:, 1]) * self.shape[2] + index[:, 2]
        self.order = np.argsort(flat, kind="stable")
        self.start = np.searchsorted(flat[self.order], np.arange(int(np.prod(self.shape)) + 1)).astype(np.int64)
        self.index = index[self.order]


@kernel
def half_list(X, index, start, shape, skin, row, col):
    """Fill ``row`` (n + 1) and ``col`` with the pairs i < j of cell-sorted grains closer than r_i + r_j + skin.

    Returns the number of pairs; when it exceeds ``len(col)`` the list is incomplete and must be built again with room
    for it.
    """
    n = index.shape[0]
    room = col.shape[0]
    count = 0
    for i in range(n):
        row[i] = count
        x, y, z, reach = X[i, 0], X[i, 1], X[i, 2], X[i, RADIUS] + skin
        cx, cy, cz = index[i, 0], index[i, 1], index[i, 2]
        z0, z1 = max(cz - 1, 0), min(cz + 1, shape[2] - 1)
        for part in range(5):
            # the rest of the own row of cells, then the four rows that come later in the order
            ax, ay = cx, cy
            if part == 1:
                ay = cy + 1
            elif part > 1:
                ax, ay = cx + 1, cy + part - 3
            if ax >= shape[0] or ay < 0 or ay >= shape[1]:
                continue
            base = (ax * shape[1] + ay) * shape[2]
            first = i + 1 if part == 0 else start[base + z0]
            for j in range(first, start[base + z1 + 1]):
                dx, dy, dz = X[j, 0] - x, X[j, 1] - y, X[j, 2] - z
                cut = reach + X[j, RADIUS]
                if dx * dx + dy * dy + dz * dz < cut * cut:
                    if count < room:
                        col[count] = j
                    count += 1
    row[n] = count
    return count


def first_of(row: np.ndarray) -> np.ndarray:
    """The first grain of each entry of a list (the second stands in ``col``)."""
    return np.repeat(np.arange(len(row) - 1, dtype=np.int32), np.diff(row))


@kernel
def carry(first, second, history, row, col, hist):
    """Put the history of the contacts (first, second) into the new list; the sign of vectors follows the order of the
    pair.

    Returns how many contacts found no slot (they have moved apart beyond the skin).
    """
    lost = 0
    for c in range(first.shape[0]):
        a, b = first[c], second[c]
        sign = 1.0
        if a > b:
            a, b = b, a
            sign = -1.0
        slot = -1
        for e in range(row[a], row[a + 1]):
            if col[e] == b:
                slot = e
                break
        if slot < 0:
            lost += 1
            continue
        for k in range(TWIST):
            hist[slot, k] = sign * history[c, k]
        for k in range(TWIST, history.shape[1]):
            hist[slot, k] = history[c, k]
    return lost


def build(X: np.ndarray, cells: Cells, skin: float, room: int) -> tuple[np.ndarray, np.ndarray]:
    """Row starts (n + 1) and partners of the half list of cell-sorted grains ``X`` (n, 4)."""
    row = np.empty(len(X) + 1, dtype=np.int64)
    while True:
        col = np.empty(room, dtype=np.int32)
        count = half_list(X, cells.index, cells.start, cells.shape, skin, row, col)
        if count <= room:
            return row, col[:count].copy()
        room = int(count * 1.1) + 16
