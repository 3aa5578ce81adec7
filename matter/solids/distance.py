"""How deep inside a solid a point lies: distances to its surface on a grid, exact beside it.

At a point of the grid stands the distance to the nearest triangle. Those beside a triangle get it by trial; the rest
take over the triangle of a neighbour and keep the nearest, in sweeps along the eight diagonals (Zhao 2005, Math. Comp.
74, 603, with triangles passed on instead of times). The sign is the number of surfaces above a point on a line along
z: odd is inside. Between the points of the grid the distance is trilinear: exact beside plane surfaces, off by
cell^2 / (8 R) where they curve with a radius R: two centimetres in a body of a kilometre, a fifth of a spacing that a
small ball needs there. Within a cell of a site it is the distance to the nearest triangle itself; its sign says on
which side of that triangle a point lies (of those that share the nearest point, the one whose plane is farthest off:
Ericson 2005).
"""

from __future__ import annotations

import hashlib
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from matter.compilation.jit import kernel, law
from matter.errors import InputError
from matter.solids.solid import Solid

CELLS = 112
"""Cells along the longest side of the grid."""
_AROUND = 3
_VOLUME = 0.02
"""How much the volume inside by the signs may differ from that of the polyhedron."""
_OFF = (0.3819660112, 0.2360679775)
"""Parts of a cell by which the grid is moved along x and y, so that no line along z meets an edge."""


class Distance(NamedTuple):
    """Depths ``depth`` (nx, ny, nz) [m], positive inside, at ``low`` + index * ``cell``; the ``corners`` (m, 3, 3) of
    the triangles about a ``site`` (3,) [m], none where none was named."""

    low: np.ndarray
    cell: float
    depth: np.ndarray
    site: np.ndarray
    corners: np.ndarray

    def at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depth (n,) [m] of points (n, 3), and its gradient (n, 3), of length one: it points away from the surface
        inside."""
        found, slope = np.empty(len(points)), np.empty((len(points), 3))
        points = np.ascontiguousarray(points)
        _between(points, self.low, self.cell, self.depth, found, slope)
        if len(self.corners):
            _beside_the_site(points, self.site, self.cell, self.corners, found, slope)
        return found, slope / np.maximum(np.linalg.norm(slope, axis=1), 1e-300)[:, None]


class _Content:
    """A solid that is the same as another of the same vertices and triangles."""

    def __init__(self, solid: Solid):
        self.solid = solid
        self.key = hashlib.blake2b(solid.vertices.tobytes() + solid.triangles.tobytes()).digest()

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Content) and self.key == other.key


class _Band(NamedTuple):
    """The grid of a ``Distance`` with what is known beside the surface: ``squared`` distances [m^2], exact within a
    cell of it, and the ``nearest`` triangles, elsewhere inf and -1; and everywhere the ``sign``, 1 inside, else -1."""

    low: np.ndarray
    cell: float
    corners: np.ndarray
    squared: np.ndarray
    nearest: np.ndarray
    sign: np.ndarray


@lru_cache(maxsize=4)
def _band(content: _Content, cells: int) -> _Band:
    solid = content.solid
    least, most = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    cell = float((most - least).max()) / cells
    low = least - (_AROUND + np.array([*_OFF, 0.1])) * cell
    shape = np.ceil((most - low) / cell).astype(np.int64) + _AROUND
    squared = np.full(shape, np.inf)
    nearest = np.full(shape, -1, dtype=np.int64)
    corners = solid.vertices[solid.triangles]
    _beside(corners, low, cell, squared, nearest)
    met = np.zeros(shape, dtype=np.int32)
    _crossings(corners, low, cell, met)
    above = np.cumsum(met[:, :, ::-1], axis=2)[:, :, ::-1]
    if (above[:, :, 0] % 2).any():
        raise InputError("the surface cuts itself: a line through it enters and does not leave")
    sign = np.where(above % 2 == 1, 1.0, -1.0)
    volume = float(np.clip(sign * np.sqrt(squared) / cell + 0.5, 0.0, 1.0).sum()) * cell**3
    if abs(volume / solid.volume - 1.0) > _VOLUME + 2.0 / cells:
        raise InputError(
            f"the surface cuts itself: {volume:.4g} m^3 lie inside it, its triangles enclose {solid.volume:.4g} m^3"
        )
    return _Band(low, cell, corners, squared, nearest, sign)


@lru_cache(maxsize=4)
def _grid(content: _Content, cells: int) -> tuple[np.ndarray, float, np.ndarray]:
    """``low``, ``cell`` and ``depth`` of a ``Distance``: seconds, which all stages of a run need."""
    band = _band(content, cells)
    squared, nearest = band.squared.copy(), band.nearest.copy()
    _passed_on(band.corners, band.low, band.cell, squared, nearest)
    return band.low, band.cell, band.sign * np.sqrt(squared)


def sides(solid: Solid, cells: int = CELLS) -> Distance:
    """On which side of the surface of ``solid`` points lie, in a tenth of the time of ``measured``: depths are those
    beside the surface, and further off no more than that. Raises ``InputError`` as ``measured`` does."""
    band = _band(_Content(solid), cells)
    depth = band.sign * np.sqrt(np.minimum(band.squared, (_AROUND * band.cell) ** 2))
    return Distance(band.low, band.cell, depth, np.zeros(3), np.empty((0, 3, 3)))


def measured(solid: Solid, cells: int = CELLS, site: np.ndarray | None = None) -> Distance:
    """The distances from the surface of ``solid``, exact within a cell of a ``site`` (3,) [m] on it. Raises
    ``InputError`` where lines through it meet an odd number of surfaces: it cuts itself."""
    low, cell, depth = _grid(_Content(solid), cells)
    if site is None:
        return Distance(low, cell, depth, np.zeros(3), np.empty((0, 3, 3)))
    # the foot of a point within a cell of the site is within two of it
    corners = solid.vertices[solid.triangles]
    near = _squared_distances(site, corners) <= (2.0 * cell) ** 2
    return Distance(low, cell, depth, site, corners[near])


@law
def squared_distance(px, py, pz, a, b, c):
    """Square of the distance of a point from the triangle of the corners a, b, c."""
    dx, dy, dz = from_foot(px, py, pz, a, b, c)
    return dx * dx + dy * dy + dz * dz


@law
def from_foot(px, py, pz, a, b, c):
    """The vector to a point from the nearest one of the triangle of the corners a, b, c (Ericson 2005, section
    5.1.5)."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    apx, apy, apz = px - a[0], py - a[1], pz - a[2]
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    bpx, bpy, bpz = px - b[0], py - b[1], pz - b[2]
    d3 = abx * bpx + aby * bpy + abz * bpz
    d4 = acx * bpx + acy * bpy + acz * bpz
    cpx, cpy, cpz = px - c[0], py - c[1], pz - c[2]
    d5 = abx * cpx + aby * cpy + abz * cpz
    d6 = acx * cpx + acy * cpy + acz * cpz
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, w = 0.0, 0.0  # the foot is a + v ab + w ac
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        v = vb / (va + vb + vc)
        w = vc / (va + vb + vc)
    return apx - v * abx - w * acx, apy - v * aby - w * acy, apz - v * abz - w * acz


@kernel
def _squared_distances(point, corners):
    away = np.empty(corners.shape[0])
    for t in range(corners.shape[0]):
        away[t] = squared_distance(point[0], point[1], point[2], corners[t, 0], corners[t, 1], corners[t, 2])
    return away


@kernel
def _beside(corners, low, cell, squared, nearest):
    nx, ny, nz = squared.shape
    for t in range(corners.shape[0]):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        i0 = max(int((min(a[0], b[0], c[0]) - low[0]) / cell) - 1, 0)
        j0 = max(int((min(a[1], b[1], c[1]) - low[1]) / cell) - 1, 0)
        k0 = max(int((min(a[2], b[2], c[2]) - low[2]) / cell) - 1, 0)
        i1 = min(int((max(a[0], b[0], c[0]) - low[0]) / cell) + 2, nx - 1)
        j1 = min(int((max(a[1], b[1], c[1]) - low[1]) / cell) + 2, ny - 1)
        k1 = min(int((max(a[2], b[2], c[2]) - low[2]) / cell) + 2, nz - 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for k in range(k0, k1 + 1):
                    d = squared_distance(low[0] + i * cell, low[1] + j * cell, low[2] + k * cell, a, b, c)
                    if d < squared[i, j, k]:
                        squared[i, j, k] = d
                        nearest[i, j, k] = t


@kernel
def _passed_on(corners, low, cell, squared, nearest):
    nx, ny, nz = squared.shape
    changed = np.full(squared.shape, -1, np.int8)  # in which sweep last
    for sweep in range(8):
        di, dj, dk = 1 - 2 * (sweep & 1), 1 - (sweep & 2), 1 - ((sweep & 4) >> 1)
        for ii in range(1, nx):
            i = ii if di > 0 else nx - 1 - ii
            for jj in range(1, ny):
                j = jj if dj > 0 else ny - 1 - jj
                for kk in range(1, nz):
                    k = kk if dk > 0 else nz - 1 - kk
                    in_all = 0 < i < nx - 1 and 0 < j < ny - 1 and 0 < k < nz - 1  # sweeps leave out their first face
                    for back in range(1, 8):
                        bi, bj, bk = (
                            i - di * (back & 1), j - dj * ((back & 2) >> 1), k - dk * ((back & 4) >> 2),
                        )  # fmt: skip
                        t = nearest[bi, bj, bk]
                        if t < 0 or t == nearest[i, j, k]:
                            continue
                        tried = sweep - 1  # the sweep in which this neighbour was asked before, if any
                        while tried >= 0 and (tried ^ sweep) & back:
                            tried -= 1
                        if in_all and tried >= 0 and changed[bi, bj, bk] <= tried:
                            continue
                        d = squared_distance(
                            low[0] + i * cell, low[1] + j * cell, low[2] + k * cell,
                            corners[t, 0], corners[t, 1], corners[t, 2],
                        )  # fmt: skip
                        if d < squared[i, j, k]:
                            squared[i, j, k] = d
                            nearest[i, j, k] = t
                            changed[i, j, k] = sweep


@kernel
def _crossings(corners, low, cell, met):
    """Count in ``met`` the triangles that lines along z meet between a point of the grid and the next one above."""
    nx, ny, nz = met.shape
    for t in range(corners.shape[0]):
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        double = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if double == 0.0:
            continue
        i0 = max(math.ceil((min(a[0], b[0], c[0]) - low[0]) / cell), 0)
        j0 = max(math.ceil((min(a[1], b[1], c[1]) - low[1]) / cell), 0)
        i1 = min(int((max(a[0], b[0], c[0]) - low[0]) / cell), nx - 1)
        j1 = min(int((max(a[1], b[1], c[1]) - low[1]) / cell), ny - 1)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                x, y = low[0] + i * cell, low[1] + j * cell
                v = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / double
                w = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / double
                if v < 0.0 or w < 0.0 or v + w > 1.0:
                    continue
                z = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
                k = int((z - low[2]) / cell)
                if 0 <= k < nz:
                    met[i, j, k] += 1


@kernel
def _between(points, low, cell, depth, found, slope):
    nx, ny, nz = depth.shape
    for p in range(points.shape[0]):
        x = min(max((points[p, 0] - low[0]) / cell, 0.0), nx - 1.000001)
        y = min(max((points[p, 1] - low[1]) / cell, 0.0), ny - 1.000001)
        z = min(max((points[p, 2] - low[2]) / cell, 0.0), nz - 1.000001)
        i, j, k = int(x), int(y), int(z)
        u, v, w = x - i, y - j, z - k
        value, gx, gy, gz = 0.0, 0.0, 0.0, 0.0
        for corner in range(8):
            a, b, c = corner & 1, (corner & 2) >> 1, (corner & 4) >> 2
            d = depth[i + a, j + b, k + c]
            fx, fy, fz = u if a else 1.0 - u, v if b else 1.0 - v, w if c else 1.0 - w
            value += fx * fy * fz * d
            gx += (2 * a - 1) * fy * fz * d
            gy += (2 * b - 1) * fx * fz * d
            gz += (2 * c - 1) * fx * fy * d
        found[p] = value
        slope[p, 0], slope[p, 1], slope[p, 2] = gx / cell, gy / cell, gz / cell


_TIED = 1e-9
"""Triangles whose distances from a point agree to this fraction of a cell squared share its foot."""


@kernel
def _beside_the_site(points, site, cell, corners, found, slope):
    """Depth and gradient of the points within a ``cell`` of the ``site`` from the ``corners`` of the triangles."""
    for p in range(points.shape[0]):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        if (x - site[0]) ** 2 + (y - site[1]) ** 2 + (z - site[2]) ** 2 > cell * cell:
            continue
        least, farthest = np.inf, 0.0
        for t in range(corners.shape[0]):
            a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
            dx, dy, dz = from_foot(x, y, z, a, b, c)
            squared = dx * dx + dy * dy + dz * dz
            if squared > least + _TIED * cell * cell:
                continue
            ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            long = math.sqrt(nx * nx + ny * ny + nz * nz)
            if long == 0.0:
                continue
            over = (dx * nx + dy * ny + dz * nz) / long  # height over the plane of the triangle
            if squared >= least - _TIED * cell * cell and abs(over) <= abs(farthest):
                continue
            least, farthest = min(squared, least), over
            away = math.sqrt(squared)
            found[p] = -math.copysign(away, over)
            if away > 1e-9 * cell:
                slope[p, 0], slope[p, 1], slope[p, 2] = dx / found[p], dy / found[p], dz / found[p]
            else:
                slope[p, 0], slope[p, 1], slope[p, 2] = -nx / long, -ny / long, -nz / long
