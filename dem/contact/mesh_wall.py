"""Walls of triangles: the nearest point of a mesh, found through a grid, without counting an edge or a corner twice.

A mesh is cut into *pieces* along its sharp edges (fold above ``SHARP``); each piece is one wall and touches a grain at
its nearest point, so a grain that rolls over the edges inside a piece keeps one contact and its springs, and one that
lies in a corner of a box touches three pieces. A grain lies on the side of the facets' normals. Where the nearest
point of a piece is on an edge or a corner of it, it counts only

* if no facet of the mesh that meets there comes nearer: never in a hollow fold, on a ridge only in the wedge between
  both facets;
* for one of the pieces that share it (the first).

The free edge of an open mesh is felt from all around. A piece is assumed to curve on a scale larger than a grain: a
tube narrower than a grain's diameter is felt on one side only.

Nearest point of a triangle: by the seven regions of its plane (Ericson 2005, Real-Time Collision Detection, section
5.1.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from matter.compilation.jit import kernel, law
from matter.errors import InputError

SHARP = math.radians(30.0)
"""Fold angle above which an edge is sharp and parts two pieces."""
MOST_PIECES = 48
_MOST_CELLS = 400_000

# a facet's record: corners (9), normal (3); of edge e (corner e to e + 1) four: rule, and the direction from it into
# the other facet; of corner c three: rule, first and number of the directions that leave it in other pieces
_NORMAL, _EDGE, _CORNER, _RECORD = 9, 12, 24, 33
_EDGE_WIDTH, _CORNER_WIDTH = 4, 3
NEVER, SMOOTH, FREE, RIDGE = 0.0, 1.0, 2.0, 3.0

# header of a mesh's row: kind of the wall, low corner of the grid (3), cells per metre, cells along each axis (3),
# then where cells' starts, their facets, facets' records and corners' directions begin
_KIND, _LOW, _PER_METRE, _CELLS, _STARTS, _LISTED, _RECORDS, _DIRECTIONS, _HEADER = 0, 1, 4, 5, 8, 9, 10, 11, 12


@dataclass(frozen=True)
class Piece:
    """A smooth part of a mesh: ``facets`` (f, 33) records and ``directions`` (k, 3) along the mesh's edges out of
    shared corners."""

    facets: np.ndarray
    directions: np.ndarray


def read(source: Any) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) and faces (f, 3) of an STL or PLY file or a ``trimesh.Trimesh``, without facets of no area;
    ``InputError`` where that leaves none."""
    import trimesh

    mesh: Any
    if isinstance(source, trimesh.Trimesh):
        mesh = source.copy()
    else:
        try:
            mesh = trimesh.load(str(source), force="mesh")
        except Exception as reason:  # trimesh raises whatever its readers do
            raise InputError(f"cannot read the mesh {source}: {reason}") from None
    if len(mesh.faces) == 0:
        raise InputError(f"the mesh {source} holds no facets")
    mesh.merge_vertices()
    vertices, faces = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64)
    area = np.linalg.norm(
        np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]), axis=1
    )
    faces = faces[area > 1e-14 * np.ptp(vertices, axis=0).max() ** 2]
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise InputError(f"the mesh {source} holds no facet of finite area")
    return vertices, faces


def pieces(vertices: np.ndarray, faces: np.ndarray) -> list[Piece]:
    """Cut a mesh, ``vertices`` (v, 3) [m] and ``faces`` (f, 3) turning left about their normals, into its smooth
    pieces."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    corner = vertices[faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    sides: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for f, face in enumerate(faces.tolist()):
        for e in range(3):
            a, b = face[e], face[(e + 1) % 3]
            sides.setdefault((min(a, b), max(a, b)), []).append((f, e))
    rule = np.full((len(faces), 3), FREE)
    other = np.full((len(faces), 3), -1)
    joined = []
    for (a, b), users in sides.items():
        if len(users) != 2:
            continue  # the free edge of a sheet, or where three sheets meet: felt from all around
        (f, e), (g, h) = users
        middle = 0.5 * (vertices[a] + vertices[b])
        fold = math.acos(float(np.clip(normal[f] @ normal[g], -1.0, 1.0)))
        if fold <= SHARP:
            joined.append((f, g))
            rule[f, e] = rule[g, h] = SMOOTH
        else:
            hollow = normal[f] @ (corner[g].mean(axis=0) - middle) > 0.0
            rule[f, e] = rule[g, h] = NEVER if hollow else RIDGE
        other[f, e], other[g, h] = g, f
    pairs = np.array(joined).reshape(-1, 2)
    count, piece = connected_components(
        coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(faces),) * 2), directed=False
    )
    if count > MOST_PIECES:
        raise InputError(
            f"the mesh has {count} smooth pieces (most: {MOST_PIECES}): its facets meet at more than "
            f"{math.degrees(SHARP):.0f} degrees nearly everywhere. "
            "Refine the mesh, or check that its facets are oriented alike"
        )
    return [_piece(k, vertices, faces, corner, normal, rule, other, piece) for k in range(count)]


def _piece(k, vertices, faces, corner, normal, rule, other, piece) -> Piece:
    """The records of piece ``k``."""
    around: dict[int, set[int]] = {}
    users: dict[int, set[int]] = {}
    border: set[int] = set()
    for f, face in enumerate(faces.tolist()):
        for e in range(3):
            a, b = face[e], face[(e + 1) % 3]
            around.setdefault(a, set()).add(b)
            around.setdefault(b, set()).add(a)
            users.setdefault(a, set()).add(int(piece[f]))
            if rule[f, e] != SMOOTH:
                border.update((a, b))
    mine = np.flatnonzero(piece == k)
    records = np.zeros((len(mine), _RECORD))
    directions: list[np.ndarray] = []
    place: dict[int, tuple[int, int]] = {}
    for row, f in zip(records, mine.tolist()):
        row[:_NORMAL], row[_NORMAL:_EDGE] = corner[f].ravel(), normal[f]
        for e in range(3):
            edge, end = _EDGE + _EDGE_WIDTH * e, _CORNER + _CORNER_WIDTH * e
            row[edge] = rule[f, e]
            g = int(other[f, e])
            if rule[f, e] == RIDGE:
                along = corner[f, (e + 1) % 3] - corner[f, e]
                inward = np.cross(normal[g], -along)  # in the other facet, across the edge
                row[edge + 1 : edge + _EDGE_WIDTH] = inward / np.linalg.norm(inward)
                if piece[g] < k:
                    row[edge] = NEVER
            v = int(faces[f, e])
            if v not in border:
                row[end] = SMOOTH
            elif min(users[v]) < k:
                row[end] = NEVER
            else:
                if v not in place:
                    out = [vertices[u] - vertices[v] for u in sorted(around[v])]
                    place[v] = (len(directions), len(out))
                    directions.extend(out)
                row[end] = RIDGE
                row[end + 1], row[end + 2] = place[v]
    return Piece(records, np.array(directions).reshape(-1, 3))


def row(piece: Piece, reach: float, kind: int) -> np.ndarray:
    """The piece as a wall's row: header, then each cell's first facet, the cells' facets, the records and the
    directions.

    A cell of the grid lists the facets that come within ``reach`` [m] of it.
    """
    points = piece.facets[:, :_NORMAL].reshape(-1, 3)
    low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
    size = max(2.0 * reach, 1e-3 * float((high - low).max()))
    shape = np.maximum(1, np.ceil((high - low) / size)).astype(np.int64)
    while np.prod(shape.astype(float)) > _MOST_CELLS:
        size *= 1.2
        shape = np.maximum(1, np.ceil((high - low) / size)).astype(np.int64)
    start = np.zeros(int(np.prod(shape)) + 1, dtype=np.int64)
    listed = np.zeros(0, dtype=np.int64)
    _list(piece.facets, low, size, shape, reach, start, listed)
    start = np.concatenate([[0], np.cumsum(start[:-1])])
    listed = np.zeros(int(start[-1]), dtype=np.int64)
    _list(piece.facets, low, size, shape, reach, start, listed)
    start = np.concatenate([[0], start[:-1]])  # filling moved every start to its end
    parts = [start.astype(float), listed.astype(float), piece.facets.ravel(), piece.directions.ravel()]
    header = np.zeros(_HEADER)
    header[_KIND], header[_LOW:_PER_METRE], header[_PER_METRE], header[_CELLS:_STARTS] = kind, low, 1.0 / size, shape
    header[_STARTS:_HEADER] = _HEADER + np.concatenate([[0], np.cumsum([len(part) for part in parts[:-1]])])
    return np.concatenate([header, *parts])


@law
def nearest(t, o, x, y, z):
    """Nearest point of the triangle whose corners begin at ``t[o]``: the point and where it lies, 0-2 edge, 3-5
    corner, 6 inside."""
    ax, ay, az = t[o], t[o + 1], t[o + 2]
    bx, by, bz = t[o + 3] - ax, t[o + 4] - ay, t[o + 5] - az
    cx, cy, cz = t[o + 6] - ax, t[o + 7] - ay, t[o + 8] - az
    px, py, pz = x - ax, y - ay, z - az
    d1, d2 = bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
    if d1 <= 0.0 and d2 <= 0.0:
        return ax, ay, az, 3
    qx, qy, qz = px - bx, py - by, pz - bz
    d3, d4 = bx * qx + by * qy + bz * qz, cx * qx + cy * qy + cz * qz
    if d3 >= 0.0 and d4 <= d3:
        return ax + bx, ay + by, az + bz, 4
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s = d1 / (d1 - d3)
        return ax + s * bx, ay + s * by, az + s * bz, 0
    qx, qy, qz = px - cx, py - cy, pz - cz
    d5, d6 = bx * qx + by * qy + bz * qz, cx * qx + cy * qy + cz * qz
    if d6 >= 0.0 and d5 <= d6:
        return ax + cx, ay + cy, az + cz, 5
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s = d2 / (d2 - d6)
        return ax + s * cx, ay + s * cy, az + s * cz, 2
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        s = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return ax + bx + s * (cx - bx), ay + by + s * (cy - by), az + bz + s * (cz - bz), 1
    s, t_ = vb / (va + vb + vc), vc / (va + vb + vc)
    return ax + bx * s + cx * t_, ay + by * s + cy * t_, az + bz * s + cz * t_, 6


@kernel
def _list(facets, low, size, shape, reach, start, listed):
    """Count into ``start`` (an empty ``listed``), or fill ``listed`` from ``start`` on, the facets within ``reach`` of
    each cell."""
    far = reach + 0.8660254037844387 * size
    corner = np.empty(_NORMAL)
    for f in range(facets.shape[0]):
        lo, hi = np.empty(3, np.int64), np.empty(3, np.int64)
        corner[:] = facets[f, :_NORMAL]
        for c in range(3):
            a, b, d = corner[c], corner[3 + c], corner[6 + c]
            lo[c] = max(0, int(np.floor((min(a, b, d) - reach - low[c]) / size)))
            hi[c] = min(shape[c] - 1, int(np.floor((max(a, b, d) + reach - low[c]) / size)))
        for i in range(lo[0], hi[0] + 1):
            for j in range(lo[1], hi[1] + 1):
                for k in range(lo[2], hi[2] + 1):
                    x, y, z = low[0] + (i + 0.5) * size, low[1] + (j + 0.5) * size, low[2] + (k + 0.5) * size
                    qx, qy, qz, _ = nearest(corner, 0, x, y, z)
                    if (qx - x) ** 2 + (qy - y) ** 2 + (qz - z) ** 2 > far * far:
                        continue
                    cell = (i * shape[1] + j) * shape[2] + k
                    if listed.shape[0] == 0:
                        start[cell] += 1
                    else:
                        listed[start[cell]] = f
                        start[cell] += 1


@law
def distance(wall, x, y, z):
    """Distance of a point from the piece [m] (inf out of reach, behind it, or where another piece is to count) and the
    unit vector towards it."""
    scale = wall[_PER_METRE]
    fx, fy, fz = (x - wall[_LOW]) * scale, (y - wall[_LOW + 1]) * scale, (z - wall[_LOW + 2]) * scale
    if fx < 0.0 or fy < 0.0 or fz < 0.0 or fx >= wall[_CELLS] or fy >= wall[_CELLS + 1] or fz >= wall[_CELLS + 2]:
        return np.inf, 0.0, 0.0, 1.0
    cell = int(wall[_STARTS]) + (int(fx) * int(wall[_CELLS + 1]) + int(fy)) * int(wall[_CELLS + 2]) + int(fz)
    first, last = int(wall[cell]), int(wall[cell + 1])
    best, at, where = np.inf, -1, -1
    bx, by, bz = 0.0, 0.0, 0.0
    for e in range(first, last):
        o = int(wall[_RECORDS]) + _RECORD * int(wall[int(wall[_LISTED]) + e])
        qx, qy, qz, region = nearest(wall, o, x, y, z)
        d2 = (qx - x) ** 2 + (qy - y) ** 2 + (qz - z) ** 2
        if d2 < best:
            best, at, where = d2, o, region
            bx, by, bz = qx - x, qy - y, qz - z
    if at < 0 or best == 0.0:
        return np.inf, 0.0, 0.0, 1.0
    d = math.sqrt(best)
    front = -(bx * wall[at + _NORMAL] + by * wall[at + _NORMAL + 1] + bz * wall[at + _NORMAL + 2])
    if where == 6:
        if front <= 0.0:
            return np.inf, 0.0, 0.0, 1.0
        return d, bx / d, by / d, bz / d
    if where < 3:
        k = at + _EDGE + _EDGE_WIDTH * where
        rule = wall[k]
        nearer = rule == RIDGE and -(bx * wall[k + 1] + by * wall[k + 2] + bz * wall[k + 3]) > 1e-12 * d
    else:
        k = at + _CORNER + _CORNER_WIDTH * (where - 3)
        rule = wall[k]
        nearer = False
        if rule == RIDGE:
            for e in range(int(wall[k + 1]), int(wall[k + 1]) + int(wall[k + 2])):
                o = int(wall[_DIRECTIONS]) + 3 * e
                ux, uy, uz = wall[o], wall[o + 1], wall[o + 2]
                if -(bx * ux + by * uy + bz * uz) > 1e-12 * d * math.sqrt(ux * ux + uy * uy + uz * uz):
                    nearer = True
    if rule == NEVER or nearer or (rule == SMOOTH and front <= 0.0):
        return np.inf, 0.0, 0.0, 1.0
    return d, bx / d, by / d, bz / d
