"""Tetrahedra of a triangulation: circumradius, volume, the pieces that a choice of them falls into, enclosed voids."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from matter.compilation.jit import kernel


def circumradius(vertices: np.ndarray) -> np.ndarray:
    """Circumradius [m] of tetrahedra, ``vertices`` of shape (t, 4, 3); infinite for a flat one.

    With the edges a, b, c from the first vertex: R = | |a|^2 b x c + |b|^2 c x a + |c|^2 a x b | / (2 |a . (b x c)|).
    """
    a, b, c = (vertices[:, k] - vertices[:, 0] for k in (1, 2, 3))
    bc = np.cross(b, c)
    aa, bb, cc = (np.einsum("ij,ij->i", e, e)[:, None] for e in (a, b, c))
    numerator = np.linalg.norm(aa * bc + bb * np.cross(c, a) + cc * np.cross(a, b), axis=1)
    determinant = np.abs(np.einsum("ij,ij->i", a, bc))
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = numerator / (2.0 * determinant)
    return np.where(determinant > 0.0, radius, np.inf)


def tetrahedron_volume(vertices: np.ndarray) -> np.ndarray:
    """Volumes [m^3] of tetrahedra, ``vertices`` of shape (t, 4, 3)."""
    a, b, c = (vertices[:, k] - vertices[:, 0] for k in (1, 2, 3))
    return np.abs(np.einsum("ij,ij->i", a, np.cross(b, c))) / 6.0


def _pieces(neighbours: np.ndarray, chosen: np.ndarray) -> tuple[int, np.ndarray]:
    """Connected pieces, through faces, of the chosen tetrahedra."""
    row, side = np.nonzero(chosen[:, None] & (neighbours >= 0) & chosen[neighbours])
    links = coo_matrix((np.ones(len(row), dtype=np.int8), (row, neighbours[row, side])), shape=(len(chosen),) * 2)
    return connected_components(links, directed=False)


def components(neighbours: np.ndarray, kept: np.ndarray, volume: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number (t,) of the connected piece of each kept tetrahedron by decreasing volume, -1 for the others, and the
    volumes of the pieces [m^3]; ``neighbours`` (t, 4) as of ``scipy.spatial.Delaunay``."""
    number, label = _pieces(neighbours, kept)
    size = np.bincount(label[kept], weights=volume[kept], minlength=number)
    present = np.bincount(label[kept], minlength=number) > 0
    order = np.argsort(-size, kind="stable")
    order = order[present[order]]
    rank = np.full(number, -1)
    rank[order] = np.arange(len(order))
    return np.where(kept, rank[label], -1), size[order]


def fill_voids(neighbours: np.ndarray, kept: np.ndarray, volume: np.ndarray, below: float) -> int:
    """Keep the tetrahedra of every enclosed void smaller than ``below`` (in place); returns how many voids were
    filled."""
    number, label = _pieces(neighbours, ~kept)
    gap = ~kept
    size = np.bincount(label[gap], weights=volume[gap], minlength=number)
    open_ = np.zeros(number, dtype=bool)
    open_[label[gap & np.any(neighbours < 0, axis=1)]] = True
    fill = ~open_ & (size < below) & (np.bincount(label[gap], minlength=number) > 0)
    kept |= gap & fill[label]
    return int(np.count_nonzero(fill))


@kernel
def in_prisms(position, distance, candidates, reach, origin, inverse, hit):
    """Whether each point lies in a tetrahedron of one of its ``candidates`` (m, k), prisms at ``distance`` (m, k).

    ``position`` (m, 3); ``origin`` (p, 3, 3) of each prism's three tetrahedra and ``inverse`` (p, 3, 3, 3) of the
    matrix of their edges; ``reach`` (p + 1,), how far from its centre a prism extends. Fills ``hit`` (m,).
    """
    for p in range(len(position)):
        for column in range(candidates.shape[1]):
            prism = candidates[p, column]
            if distance[p, column] > reach[prism]:
                continue
            for t in range(3):
                x = position[p, 0] - origin[prism, t, 0]
                y = position[p, 1] - origin[prism, t, 1]
                z = position[p, 2] - origin[prism, t, 2]
                edge = inverse[prism, t]
                u = edge[0, 0] * x + edge[0, 1] * y + edge[0, 2] * z
                v = edge[1, 0] * x + edge[1, 1] * y + edge[1, 2] * z
                w = edge[2, 0] * x + edge[2, 1] * y + edge[2, 2] * z
                # a flat tetrahedron is not a number here, and holds nothing
                if u >= -1e-9 and v >= -1e-9 and w >= -1e-9 and u + v + w <= 1.0 + 1e-9:
                    hit[p] = True
            if hit[p]:
                break
