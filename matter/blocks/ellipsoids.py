"""Whether ellipsoids with parallel axes overlap (Perram & Wertheim 1985).

    F = max over 0 < l < 1 of   l (1 - l) sum_k R_k^2 / ((1 - l) a_k^2 + l b_k^2)

R the way from one centre to the other, a and b the half axes; they overlap where F < 1. Of two balls that is R^2 < (a
+ b)^2. The greatest of F's values at 31 places of l stands for the maximum: it is never above it, so that a pair that
touches counts as overlapping, never the other way.
"""

from matter.compilation.jit import kernel, law

SOURCES = ("PerramWertheim1985",)
_PLACES = 31


@law
def overlap(x, y, z, ax, ay, az, bx, by, bz):
    """Whether ellipsoids of half axes a and b [m] overlap whose centres are (x, y, z) [m] apart."""
    if ax == ay and ay == az and bx == by and by == bz:
        return x * x + y * y + z * z < (ax + bx) * (ax + bx)
    for i in range(1, _PLACES + 1):
        l = i / (_PLACES + 1.0)
        k = 1.0 - l
        f = x * x / (k * ax * ax + l * bx * bx) + y * y / (k * ay * ay + l * by * by)
        if k * l * (f + z * z / (k * az * az + l * bz * bz)) >= 1.0:
            return False
    return True


@kernel
def first_free(trials, half, centres, halves, head, entry_next, entry_block, low, cell):
    """Index of the first of ``trials`` (m, 3) [m] where an ellipsoid of half axes ``half`` (3,) meets none of the
    blocks (``centres``, ``halves``) listed in the cells, -1 where there is none; cells as ``register``."""
    nx, ny, nz = head.shape
    for t in range(trials.shape[0]):
        free = True
        i0, i1 = _cells(trials[t, 0], half[0], low[0], cell, nx)
        j0, j1 = _cells(trials[t, 1], half[1], low[1], cell, ny)
        k0, k1 = _cells(trials[t, 2], half[2], low[2], cell, nz)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for k in range(k0, k1 + 1):
                    e = head[i, j, k]
                    while e >= 0 and free:
                        b = entry_block[e]
                        free = not overlap(
                            trials[t, 0] - centres[b, 0], trials[t, 1] - centres[b, 1], trials[t, 2] - centres[b, 2],
                            half[0], half[1], half[2], halves[b, 0], halves[b, 1], halves[b, 2],
                        )  # fmt: skip
                        e = entry_next[e]
                    if not free:
                        break
                if not free:
                    break
            if not free:
                break
        if free:
            return t
    return -1


@kernel
def register(block, centre, half, head, entry_next, entry_block, used, low, cell):
    """List a block in all cells that its box meets: ``head`` (nx, ny, nz) the first entry of each cell of the edge
    ``cell`` [m] from ``low`` (3,) on, ``entry_next`` and ``entry_block`` (e,) the one after it and whose it is.
    Returns how many entries are used; where that is more than there are, nothing is listed."""
    nx, ny, nz = head.shape
    i0, i1 = _cells(centre[0], half[0], low[0], cell, nx)
    j0, j1 = _cells(centre[1], half[1], low[1], cell, ny)
    k0, k1 = _cells(centre[2], half[2], low[2], cell, nz)
    after = used + (i1 - i0 + 1) * (j1 - j0 + 1) * (k1 - k0 + 1)
    if after > len(entry_next):
        return after
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            for k in range(k0, k1 + 1):
                entry_next[used], entry_block[used] = head[i, j, k], block
                head[i, j, k] = used
                used += 1
    return used


@law
def _cells(at, half, low, cell, count):
    """First and last cell along one axis that [at - half, at + half] meets."""
    first, last = int((at - half - low) / cell), int((at + half - low) / cell)
    return min(max(first, 0), count - 1), min(max(last, 0), count - 1)
