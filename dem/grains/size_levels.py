"""The half list of grains of very different sizes: one grid of cells for each class of size.

With one grid its cells must be as wide as two of the largest grains, and hold hundreds of the smallest. Here class k
holds the radii between r_max / 2^(k+1) and r_max / 2^k and has its own grid; a grain meets its own class in half of
the cells around it, and all of every smaller class in the cells that it can reach. Every pair is found once, from its
larger class. Rows are sorted, so the list does not depend on the search.

Source: Ogarko & Luding 2012, Comput. Phys. Commun. 183, 931 (hierarchical grids for polydisperse packings).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dem.contact.columns import RADIUS
from dem.grains.pair_list import Cells, first_of
from matter.compilation.jit import kernel

WORTH_IT = 3.0
"""Largest over mean radius from which on classes are cheaper (20,000 grains: 6 ms alike; 15.5 against 13.2 ms at 3.4,
44 against 9.7 ms at 6.6)."""


def several(radius: np.ndarray) -> bool:
    """Whether grains of these radii are better searched in classes."""
    return len(radius) > 0 and float(radius.max()) > WORTH_IT * float(radius.mean())


def classes(radius: np.ndarray) -> np.ndarray:
    """Class of each grain: 0 for the largest; each class spans a factor of two."""
    return np.floor(np.log2(radius.max() / radius)).astype(np.int64)


class Grid(NamedTuple):
    """Grains of one class in the order of their cells: numbers ``members`` (k,), their ``cell`` (k,); where each cell
    begins ``start``; ``low`` corner (3,) [m], ``size`` of a cell [m], ``shape`` (3,)."""

    members: np.ndarray
    cell: np.ndarray
    start: np.ndarray
    low: np.ndarray
    size: float
    shape: np.ndarray


@kernel
def _own(X, grid, skin, count, first, second):
    """Pairs within one class; returns how many there are with the ``count`` that came before (beyond the room they are
    only counted)."""
    members, flat, start, shape = grid.members, grid.cell, grid.start, grid.shape
    room = first.shape[0]
    for a in range(members.shape[0]):
        i = members[a]
        x, y, z, reach = X[i, 0], X[i, 1], X[i, 2], X[i, RADIUS] + skin
        cx, cy, cz = flat[a] // (shape[1] * shape[2]), flat[a] // shape[2] % shape[1], flat[a] % shape[2]
        z0, z1 = max(cz - 1, 0), min(cz + 1, shape[2] - 1)
        for part in range(5):
            ax, ay = cx, cy
            if part == 1:
                ay = cy + 1
            elif part > 1:
                ax, ay = cx + 1, cy + part - 3
            if ax >= shape[0] or ay < 0 or ay >= shape[1]:
                continue
            base = (ax * shape[1] + ay) * shape[2]
            begin = a + 1 if part == 0 else start[base + z0]
            for b in range(begin, start[base + z1 + 1]):
                j = members[b]
                dx, dy, dz = X[j, 0] - x, X[j, 1] - y, X[j, 2] - z
                cut = reach + X[j, RADIUS]
                if dx * dx + dy * dy + dz * dz < cut * cut:
                    if count < room:
                        first[count], second[count] = min(i, j), max(i, j)
                    count += 1
    return count


@kernel
def _across(X, large, grid, skin, count, first, second):
    """Pairs of the grains ``large`` (their numbers) with those of a smaller class, sorted into ``grid``; returns as
    ``_own``."""
    small, start, low, size, shape = grid.members, grid.start, grid.low, grid.size, grid.shape
    room = first.shape[0]
    lo, hi = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for a in range(large.shape[0]):
        i = large[a]
        x, y, z, reach = X[i, 0], X[i, 1], X[i, 2], X[i, RADIUS] + skin
        # cells are two of the smaller class' largest radii and a skin wide
        wide = reach + 0.5 * size
        for c in range(3):
            lo[c] = max(int(np.floor((X[i, c] - wide - low[c]) / size)), 0)
            hi[c] = min(int(np.floor((X[i, c] + wide - low[c]) / size)), shape[c] - 1)
        for ax in range(lo[0], hi[0] + 1):
            for ay in range(lo[1], hi[1] + 1):
                if lo[2] > hi[2]:
                    continue
                base = (ax * shape[1] + ay) * shape[2]
                for b in range(start[base + lo[2]], start[base + hi[2] + 1]):
                    j = small[b]
                    dx, dy, dz = X[j, 0] - x, X[j, 1] - y, X[j, 2] - z
                    cut = reach + X[j, RADIUS]
                    if dx * dx + dy * dy + dz * dz < cut * cut:
                        if count < room:
                            first[count], second[count] = min(i, j), max(i, j)
                        count += 1
    return count


@kernel
def _rows(first, second, count, row, col):
    """Row starts and sorted partners of unordered pairs (two stable counting sorts)."""
    n = row.shape[0] - 1
    cursor = np.zeros(n + 1, dtype=np.int64)
    for e in range(count):
        cursor[second[e] + 1] += 1
    for i in range(n):
        cursor[i + 1] += cursor[i]
    by_second = np.empty(count, dtype=np.int64)
    for e in range(count):
        by_second[cursor[second[e]]] = e
        cursor[second[e]] += 1
    row[:] = 0
    for e in range(count):
        row[first[e] + 1] += 1
    for i in range(n):
        row[i + 1] += row[i]
    cursor[:] = row
    for k in range(count):
        e = by_second[k]
        col[cursor[first[e]]] = second[e]
        cursor[first[e]] += 1


def build(X: np.ndarray, skin: float, room: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row starts (n + 1), first grains and partners of the half list of grains ``X`` (n, 4) [m], the same as
    ``pair_list.build``."""
    of = classes(X[:, RADIUS])
    grids = []
    for k in range(int(of.max()) + 1):
        members = np.flatnonzero(of == k)
        if len(members):
            cells = Cells(X[members], 2.0 * float(X[members, RADIUS].max()) + skin)
            grids.append(Grid(members[cells.order], cells.flat, cells.start, cells.low, cells.size, cells.shape))
    while True:
        first, second = np.empty(room, dtype=np.int32), np.empty(room, dtype=np.int32)
        count = 0
        for k, grid in enumerate(grids):
            count = _own(X, grid, skin, count, first, second)
            for finer in grids[k + 1 :]:
                count = _across(X, grid.members, finer, skin, count, first, second)
        if count <= room:
            break
        room = int(count * 1.1) + 16
    row, col = np.empty(len(X) + 1, dtype=np.int64), np.empty(count, dtype=np.int32)
    _rows(first, second, count, row, col)
    return row, first_of(row), col
