"""Who may touch whom: cell-sorted grains, a Verlet half list, and the history that moves with it.

The list holds every pair closer than r_i + r_j + skin, once. It stays valid until two grains could have closed the
skin, that is until twice the largest displacement since it was built exceeds it. Grains are kept in the order of their
cells, which makes the force loop three times faster than any other order at 100,000 grains.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dem.contact.columns import OFFSET, RADIUS, TOUCHING, TWIST, USUAL
from matter.compilation.jit import kernel

Spread = Callable[[int, Callable[[int, int], Any]], list[Any]]
"""``spread(count, work)``: what ``work(lo, hi)`` returns for shares of range(count), in their order, on threads."""


def alone(count: int, work: Callable[[int, int], Any]) -> list[Any]:
    """All on this thread."""
    return [work(0, count)]


class Cells:
    """A uniform grid over the grains; ``order`` sorts them by cell, ``start`` (cells + 1) is where each cell begins,
    ``flat`` the cell of each sorted grain: (x shape[1] + y) shape[2] + z."""

    def __init__(self, position: np.ndarray, size: float, spread: Spread = alone):
        count = len(position)
        self.low, high = np.zeros(3), np.zeros(3)
        if count:
            ends = spread(count, lambda lo, hi: _ends(position, lo, hi))
            self.low = np.min([low for low, _ in ends], axis=0)
            high = np.max([high for _, high in ends], axis=0)
        span = high - self.low
        # a few grains far away must not ask for an endless grid: larger cells are always allowed
        while True:
            self.shape = (span / size).astype(np.int64) + 1
            if np.prod(self.shape.astype(float)) <= 64.0 * count + 4096.0:
                break
            size *= 1.25
        self.size = float(size)
        cells = int(np.prod(self.shape))
        key, self.flat, self.order = (np.empty(count, dtype=np.int64) for _ in range(3))
        self.start = np.full(cells + 1, count, dtype=np.int64)
        spread(count, lambda lo, hi: _keys(position, self.low, self.size, self.shape, lo, hi, key))
        spread(cells, lambda lo, hi: _sort(key, lo, hi, self.start, self.order, self.flat))


@kernel
def _ends(position, lo, hi):
    """Smallest and largest coordinates of the points lo to hi; infinite of none."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(lo, hi):
        for c in range(3):
            low[c], high[c] = min(low[c], position[i, c]), max(high[c], position[i, c])
    return low, high


@kernel
def _keys(position, low, size, shape, lo, hi, key):
    """The cell ``key`` of the points lo to hi."""
    for i in range(lo, hi):
        flat = 0
        for c in range(3):
            flat = flat * shape[c] + max(min(int((position[i, c] - low[c]) / size), shape[c] - 1), 0)
        key[i] = flat


@kernel
def _sort(key, lo, hi, start, order, flat):
    """Counting sort, stable, of the grains in the cells lo to hi."""
    cursor = np.zeros(hi - lo + 1, dtype=np.int64)
    before = 0
    for i in range(key.shape[0]):
        if key[i] < lo:
            before += 1
        elif key[i] < hi:
            cursor[key[i] - lo + 1] += 1
    cursor[0] = before
    for c in range(hi - lo):
        start[lo + c] = cursor[c]
        cursor[c + 1] += cursor[c]
    for i in range(key.shape[0]):
        if lo <= key[i] < hi:
            at = cursor[key[i] - lo]
            order[at], flat[at] = i, key[i]
            cursor[key[i] - lo] += 1


@kernel
def half_list(X, flat, start, shape, skin, lo, hi, row, first, col):
    """The pairs i < j of cell-sorted grains closer than r_i + r_j + skin, of the rows lo <= i < hi: their partners in
    ``col``, i itself in ``first``, the end of each in ``row`` (n + 1).

    Returns the number of pairs, or -1 where ``col`` has no room for all that come into question.
    """
    count = 0
    for i in range(lo, hi):
        begin = count
        x, y, z, reach = X[i, 0], X[i, 1], X[i, 2], X[i, RADIUS] + skin
        cx, cy, cz = flat[i] // (shape[1] * shape[2]), flat[i] // shape[2] % shape[1], flat[i] % shape[2]
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
            next_one, last = i + 1 if part == 0 else start[base + z0], start[base + z1 + 1]
            if count + last - next_one > col.shape[0]:
                return -1
            for j in range(next_one, last):
                # every candidate is written, and stays where it is near: no branch to guess wrongly
                u = np.uintp(j)
                dx, dy, dz, cut = X[u, 0] - x, X[u, 1] - y, X[u, 2] - z, reach + X[u, RADIUS]
                col[np.uintp(count)] = j
                count += dx * dx + dy * dy + dz * dz < cut * cut
        for e in range(begin, count):
            first[e] = i
        row[i + 1] = count
    return count


def first_of(row: np.ndarray) -> np.ndarray:
    """The first grain of each entry of a list (the second stands in ``col``)."""
    return np.repeat(np.arange(len(row) - 1, dtype=np.int32), np.diff(row))


@kernel
def carry(begin, end, old, new_index, row, col, hist, known):
    """Put the history of the contacts ``begin`` to ``end`` of an old list into the new one, where both grains have a
    row; the sign of vectors follows the order of the pair.

    ``old``: first and second grain (m,), 0 in (m,) where the history is surely empty, history (m, columns);
    ``new_index`` (n,) where each grain now stands; new list ``row`` and ``col``. Out: ``hist``, and 1 in ``known`` for
    entries with a history (those in contact and, where there are offsets, open ones that remember one). Contacts that
    have moved apart beyond the skin are dropped.
    """
    first, second, filled, history = old
    n = row.shape[0] - 1
    for c in range(begin, end):
        if filled[c] == 0:
            continue
        if history[c, TOUCHING] == 0.0 and (history.shape[1] <= USUAL or history[c, OFFSET] == 0.0):
            continue
        a, b = new_index[first[c]], new_index[second[c]]
        sign = 1.0
        if a > b:
            a, b = b, a
            sign = -1.0
        if b >= n:
            continue
        for e in range(row[a], row[a + 1]):
            if col[e] == b:
                for k in range(TWIST):
                    hist[e, k] = sign * history[c, k]
                for k in range(TWIST, history.shape[1]):
                    hist[e, k] = history[c, k]
                known[e] = 1
                break


def build(
    X: np.ndarray, cells: Cells, skin: float, room: int, spread: Spread = alone
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row starts (n + 1), first grains and partners of the half list of cell-sorted grains ``X`` (n, 4); ``room`` is
    a guess of its length."""
    n = len(X)
    row = np.zeros(n + 1, dtype=np.int64)

    def rows(lo: int, hi: int) -> tuple[int, int, np.ndarray, np.ndarray]:
        size = int(1.1 * room * (hi - lo) / max(n, 1)) + 1024
        while True:
            first, col = (np.empty(size, dtype=np.int32) for _ in range(2))
            count = half_list(X, cells.flat, cells.start, cells.shape, skin, lo, hi, row, first, col)
            if count >= 0:
                return lo, hi, first[:count], col[:count]
            size *= 2

    parts = spread(n, rows)
    ends = np.cumsum([0, *(len(part) for *_, part in parts)])
    first, col = (np.empty(ends[-1], dtype=np.int32) for _ in range(2))

    def join(begin: int, end: int) -> None:
        for k in range(begin, end):
            lo, hi, first[ends[k] : ends[k + 1]], col[ends[k] : ends[k + 1]] = parts[k]
            row[lo + 1 : hi + 1] += ends[k]

    spread(len(parts), join)
    return row, first, col
