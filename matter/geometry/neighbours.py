"""Neighbour lists on cell grids, for supports that differ from particle to particle.

Two particles are neighbours when |x_i - x_j| < reach (h_i + h_j) / 2. Particles are binned by h into levels a factor
of two apart; every level has its own grid, so that a few fine particles on a coarse body cost what they are worth.
``order`` sorts particles by level and cell: arrays in that order make the list, and every pair loop over it, run on
contiguous memory (measured 4x on 300,000 particles).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from matter.compilation.gather import LANES, WIDE, append_passed, reserve
from matter.compilation.jit import inner_kernel, kernel, parallel_kernel, prange


class Grid(NamedTuple):
    """Cell grids of all levels over particles already sorted by ``order``.

    ``largest`` (levels,) the largest h of a level, ``width`` (levels,) cell width, ``origin`` and ``shape`` (levels,
    3), ``offset`` (levels,) where the cells of a level begin in ``start`` (cells + 1,), which holds the first particle
    of every cell.
    """

    largest: np.ndarray
    width: np.ndarray
    origin: np.ndarray
    shape: np.ndarray
    offset: np.ndarray
    start: np.ndarray


class Points(NamedTuple):
    """Sorted particles: positions ``x``, ``y``, ``z`` (n,) [m] and support radii ``h`` (n,) [m]."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    h: np.ndarray


class Occupied(NamedTuple):
    """The ``cells`` (k,) that hold particles, and the ``level`` (k,) of each."""

    cells: np.ndarray
    level: np.ndarray


_CELLS = 4  # at most, per particle of a level
# fraction of a scattered level's particles that may lie beyond its box on each side; they share the outermost cells
_OUTSIDE = 0.02


@kernel
def _cells(position, level, origin, width, shape, offset, cell):
    for i in range(len(position)):
        l = level[i]
        index = 0
        for axis in range(2, -1, -1):
            c = int((position[i, axis] - origin[l, axis]) / width[l])
            index = index * shape[l, axis] + min(max(c, 0), shape[l, axis] - 1)
        cell[i] = offset[l] + index


def sort(position: np.ndarray, h: np.ndarray, half_width: float = np.inf) -> tuple[np.ndarray, Grid]:
    """The order that sorts particles by level and cell, and the grid over the sorted particles.

    Parameters
    ----------
    position : (n, 3) [m];  h : (n,) support radii [m].
    half_width : particles beyond this distance from the origin along an axis share the outermost cells [m], so that a
        few far ones do not blow the grid up; results do not depend on it.

    Returns
    -------
    order : (n,) int64, grid : ``Grid`` for arrays taken in this order.
    """
    octave = h / h.min()
    octave *= 1.0 + 1e-12
    level = np.floor(np.log2(octave, out=octave), out=octave).astype(np.int16)
    del octave
    rank = np.cumsum(np.bincount(level) > 0) - 1  # levels that are there, counted through
    levels = int(rank[-1]) + 1
    level = rank.astype(np.int16)[level]
    largest, width = np.zeros(levels), np.zeros(levels)
    origin, shape = np.zeros((levels, 3)), np.ones((levels, 3), dtype=np.int64)
    for l in range(levels):
        mine = position if levels == 1 else position[level == l]
        largest[l] = h.max() if levels == 1 else h[level == l].max()
        low, high = (
            np.clip(mine.min(axis=0), -half_width, half_width),
            np.clip(mine.max(axis=0), -half_width, half_width),
        )
        budget = float(max(_CELLS * len(mine), len(position)) + 64)
        if (
            np.prod((high - low) / largest[l] + 1.0) > budget
        ):  # a level whose particles have flown apart: the box of most of them
            near, far = np.quantile(np.clip(mine, -half_width, half_width), (_OUTSIDE, 1.0 - _OUTSIDE), axis=0)
            margin = 0.25 * (far - near) + largest[l]
            low, high = np.maximum(low, near - margin), np.minimum(high, far + margin)
        extent = np.maximum(high - low, 1e-9 * largest[l] + 1e-300)
        # never more than a few cells per particle
        width[l] = max(largest[l], float(np.prod(np.maximum(extent, largest[l])) / budget) ** (1.0 / 3.0))
        origin[l] = low
        shape[l] = np.floor(extent / width[l]).astype(np.int64) + 1
    counts = shape.prod(axis=1)
    offset = np.concatenate([[0], np.cumsum(counts)])
    mine = None
    cell = np.empty(len(position), dtype=np.int32 if offset[-1] < 2**31 else np.int64)
    _cells(position, level, origin, width, shape, offset[:-1].copy(), cell)
    del level
    start = np.zeros(int(offset[-1]) + 1, dtype=np.int64)
    np.cumsum(np.bincount(cell, minlength=int(offset[-1])), out=start[1:])
    order = np.argsort(cell, kind="stable")
    return order, Grid(largest, width, origin, shape, offset[:-1].copy(), start)


_BLOCK = 16  # cells that a thread takes at a time


@inner_kernel
def _with_room(candidate, near, many, room):
    """``candidate`` (room,) and ``near`` (4, room) with their first ``many`` values, and room for what is inside."""
    more, wider = np.empty(room, dtype=np.int32), np.empty((4, room))
    for k in range(many):
        more[k] = candidate[k]
        wider[0, k], wider[1, k], wider[2, k], wider[3, k] = near[0, k], near[1, k], near[2, k], near[3, k]
    return more, wider, np.empty(room, dtype=np.int8)


@inner_kernel(fastmath=True)
def _fill_some(block, points, reach, grid, occupied, cursor, index, entry, count):
    """Rows of the particles of one ``block`` of the ``occupied`` cells; one fused loop.

    The particles of a cell look through the same cells around it: these are copied together once and tested in whole
    registers. In: ``points`` and ``grid``, in the grid's order, and the ``reach``. Out: the rows in ``index``, where
    they begin in ``entry`` and their lengths in ``count``; ``cursor`` counts the positions taken in ``index`` by all
    threads, beyond its end too (what did not fit is not written).
    """
    x, y, z, h = points.x, points.y, points.z, points.h
    largest, width, origin, shape, offset = grid.largest, grid.width, grid.origin, grid.shape, grid.offset
    start = grid.start
    cells, level = occupied.cells, occupied.level
    lower, upper = block * _BLOCK, min(len(cells), (block + 1) * _BLOCK)
    levels = len(width)
    room = 1024
    candidate = np.empty(room, dtype=np.int32)
    near = np.empty((4, room))
    inside = np.empty(room, dtype=np.int8)
    # the rows of this thread's cells, copied to their reserved together
    own, used = np.empty(8 * room, dtype=np.int32), 0
    for c in range(lower, upper):
        first, end = start[cells[c]], start[cells[c] + 1]
        while first < end:
            # the particles of the cell, or one at a time where they lie further apart than a cell is wide (the
            # outermost cells have no end)
            last = end
            x_low, x_high, y_low, y_high = x[first], x[first], y[first], y[first]
            z_low, z_high = z[first], z[first]
            high = h[first]
            for i in range(first + 1, end):
                x_low, x_high = min(x_low, x[i]), max(x_high, x[i])
                y_low, y_high = min(y_low, y[i]), max(y_high, y[i])
                z_low, z_high = min(z_low, z[i]), max(z_high, z[i])
                high = max(high, h[i])
            if max(x_high - x_low, y_high - y_low, z_high - z_low) > 1.01 * width[level[c]]:
                last = first + 1
                x_low, x_high, y_low, y_high = x[first], x[first], y[first], y[first]
                z_low, z_high = z[first], z[first]
                high = h[first]
            many = np.int64(0)  # no literal, of which what it is given to would be compiled once more
            for l in range(levels):
                radius = 0.5 * reach * (high + largest[l])
                inverse = 1.0 / width[l]
                nx, ny, nz = shape[l, 0], shape[l, 1], shape[l, 2]
                x0 = min(max(int((x_low - radius - origin[l, 0]) * inverse), 0), nx - 1)
                x1 = min(max(int((x_high + radius - origin[l, 0]) * inverse), 0), nx - 1)
                y0 = min(max(int((y_low - radius - origin[l, 1]) * inverse), 0), ny - 1)
                y1 = min(max(int((y_high + radius - origin[l, 1]) * inverse), 0), ny - 1)
                z0 = min(max(int((z_low - radius - origin[l, 2]) * inverse), 0), nz - 1)
                z1 = min(max(int((z_high + radius - origin[l, 2]) * inverse), 0), nz - 1)
                for cz in range(z0, z1 + 1):
                    for cy in range(y0, y1 + 1):
                        row = offset[l] + (cz * ny + cy) * nx
                        begin, piece = start[row + x0], start[row + x1 + 1] - start[row + x0]
                        if many + piece > room:
                            room = 2 * (many + piece)
                            candidate, near, inside = _with_room(candidate, near, many, room)
                        for k in range(piece):
                            candidate[many + k] = begin + k
                        for k in range(piece):
                            near[0, many + k] = x[begin + k]
                            near[1, many + k] = y[begin + k]
                            near[2, many + k] = z[begin + k]
                            near[3, many + k] = h[begin + k]
                        many += piece
            padded = (many + WIDE - 1) // WIDE * WIDE
            if padded > room:
                room = 2 * padded
                candidate, near, inside = _with_room(candidate, near, many, room)
            for i in range(first, last):
                xi, yi, zi, hi = x[i], y[i], z[i], h[i]
                for k in range(many):
                    dx, dy, dz = near[0, k] - xi, near[1, k] - yi, near[2, k] - zi
                    limit = 0.5 * reach * (hi + near[3, k])
                    inside[k] = (limit * limit > dx * dx + dy * dy + dz * dz) & (candidate[k] != i)
                for k in range(many, padded):
                    inside[k] = 0
                if used + padded + 2 * WIDE > len(own):
                    longer = np.empty(2 * (len(own) + padded + 2 * WIDE), dtype=np.int32)
                    for k in range(used):
                        longer[k] = own[k]
                    own = longer
                entry[i] = used
                for k in range(0, padded, WIDE):
                    used += append_passed(candidate, inside, k, own, used)
                count[i] = used - entry[i]
                while (used - entry[i]) % LANES != 0:
                    own[used] = i
                    used += 1
            first = last
    reserved = reserve(cursor, used)
    if reserved + used <= len(index):
        for k in range(used):
            index[reserved + k] = own[k]
    for c in range(lower, upper):
        for i in range(start[cells[c]], start[cells[c] + 1]):
            entry[i] += reserved


@parallel_kernel
def _fill(points, reach, grid, occupied, cursor, index, entry, count):
    for block in prange((len(occupied.cells) + _BLOCK - 1) // _BLOCK):
        # int64 as where its type is first inferred: the loop's own index is unsigned, and would compile it twice
        _fill_some(np.int64(block), points, reach, grid, occupied, cursor, index, entry, count)


@dataclass(frozen=True)
class Neighbours:
    """``index[entry[i] : entry[i] + count[i]]`` are the neighbours of particle i (both directions are listed); up to a
    multiple of ``gather.LANES`` i itself follows. Where a row lies depends on the threads, what it holds does not."""

    index: np.ndarray
    entry: np.ndarray
    count: np.ndarray


def build(
    position: np.ndarray, h: np.ndarray, grid: Grid, reach: float = 1.0, previous: Neighbours | None = None
) -> Neighbours:
    """All neighbours within ``reach`` (h_i + h_j) / 2 of every particle; particles in the order of ``sort``.

    The arrays of ``previous`` are used again; ``index`` grows until every neighbour has a position (nothing is ever
    dropped). Positions in Fortran order are not copied.
    """
    n = len(position)
    x, y, z = (np.ascontiguousarray(position[:, axis]) for axis in range(3))
    points = Points(x, y, z, h)
    if previous is not None and len(previous.entry) == n:
        index, entry, count = previous.index, previous.entry, previous.count
    else:
        index, entry, count = (
            np.empty(48 * n, dtype=np.int32),
            np.empty(n, dtype=np.int64),
            np.empty(n, dtype=np.int32),
        )
    cells = np.flatnonzero(np.diff(grid.start))
    occupied = Occupied(cells, np.searchsorted(grid.offset, cells, side="right") - 1)
    while True:
        cursor = np.zeros(1, dtype=np.int64)
        _fill(points, reach, grid, occupied, cursor, index, entry, count)
        if cursor[0] <= len(index):
            return Neighbours(index, entry, count)
        index.resize(int(1.1 * cursor[0]), refcheck=False)  # in place: the list before it is nobody's any more
