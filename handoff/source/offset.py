"""How far outside its outermost particles the surface of a cloud runs.

A particle stands for the volume mass over density around it; the alpha-shape through particle centres leaves the outer
part of that out. The surface is drawn a ``distance`` [m] outside: first one factor of the local spacing, at which the
volume inside the bed's domain is the sum of mass over density of the compact particles there (0.5 would be the half
spacing of a perfect layer, 0.3 is found for disordered ones). Where the surface is sharply bent, at a rim's crest
above all, one factor leaves matter out and makes up for it elsewhere: a cavity comes out too small. So the distance is
then corrected point by point: what each particle lacks,

    d_i = m_i / rho_i - (volume inside the surface that is nearest to i),

is handed to the surface around it, delta(x) = sum_i w(x - x_i) d_i / integral of w dA with a Gaussian w of two
spacings. Inside the solid d_i is the disorder of the particles; it sums to zero over neighbours and drops out.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from handoff.domains.domain import Domain
from handoff.source.cloud_surface import Rules
from matter.geometry.alpha_shape import AlphaShape, OffsetShape
from matter.points import sobol

_RANGE = (0.0, 0.75)
_MOST = 1.25
"""Largest distance after the correction, in spacings."""
_WIDTH, _CUT = 2.0, 3.0
"""Standard deviation of the weight in spacings; it ends at so many of these."""
_ROUNDS = 2
SMOOTHING = 6
"""Passes of a volume-keeping filter over the surface, against the roughness of single particles; more where they are
finer than grains."""


def even_points(domain: Domain) -> np.ndarray:
    """65,536 even points of the domain."""
    return domain.even_points(sobol.stream(2).random_base2(16))


def passes(spacing: np.ndarray, coarse: float) -> np.ndarray:
    """Smoothing passes (n,) of the surface: where particles of ``spacing`` (n,) [m] are finer than ``coarse`` [m],
    what the surface is for, more with the square of the ratio: details that grains cannot take over go."""
    finer = np.clip(np.round(np.log2(np.maximum(coarse / spacing, 1.0))), 0, 4)
    return (SMOOTHING * 4.0**finer).astype(np.int64)


def by_one_factor(
    shape: AlphaShape, spacing: np.ndarray, points: np.ndarray, fraction: float, rules: Rules, coarse: float = 0.0
) -> tuple[OffsetShape, float]:
    """The surface at one factor of the ``spacing`` (n,) [m] of the shape's particles, and that factor:
    ``rules.offset``, or the one at which the solid holds ``fraction`` of the even ``points`` (s, 3)."""
    smooth = passes(spacing, coarse)
    if rules.offset != "auto":
        return shape.offset(rules.offset * spacing, smooth), float(rules.offset)
    deep = shape.contains(points)
    shell = points[~deep]
    factors = np.linspace(*_RANGE, 4)
    held = [
        (deep.sum() + np.count_nonzero(shape.offset(factor * spacing, smooth).contains(shell))) / len(points)
        for factor in factors
    ]
    factor = float(np.interp(fraction, held, factors))
    return shape.offset(factor * spacing, smooth), factor


def point_by_point(
    solid: OffsetShape,
    spacing: np.ndarray,
    position: np.ndarray,
    volume: np.ndarray,
    points: np.ndarray,
    owner: np.ndarray,
    domain: Domain,
) -> OffsetShape:
    """The ``solid`` with its distances corrected where volume and mass over density differ.

    ``spacing`` (n,) of the shape's particles [m]; ``position`` (c, 3) and ``volume`` (c,) of the compact particles:
    mass over density of the part inside the domain [m^3]; ``points`` (s, 3) even in the domain and the nearest compact
    particle ``owner`` (s,) of each.
    """
    shape, distance = solid.shape, solid.distance.copy()
    each = domain.volume / len(points)
    edge = np.unique(shape.triangles)
    edge = edge[domain.cut_depth(shape.points[edge]) > 0.0]
    if len(edge) == 0:
        return solid
    edge_points, width = shape.points[edge], _WIDTH * spacing[edge]
    tree, reach = cKDTree(edge_points), _CUT * float(width.max())
    near = np.flatnonzero(np.isfinite(tree.query(edge_points, distance_upper_bound=reach)[0]))
    towards = _weights(edge_points, cKDTree(edge_points[near]), width)
    among = _weights(edge_points, tree, width)
    inside = shape.contains(points)
    for _ in range(_ROUNDS):
        held = inside.copy()
        held[~inside] = solid.contains(points[~inside])
        lacking = volume - each * np.bincount(owner[held], minlength=len(volume))
        area = _area(solid, len(shape.points))[edge]
        step = (towards @ lacking[near]) / (among @ area)
        step += (lacking.sum() - step @ area) / area.sum()
        distance[edge] = np.clip(distance[edge] + step, 0.0, _MOST * spacing[edge])
        solid = shape.offset(distance, solid.smoothing)
    return solid


def _weights(position: np.ndarray, of: cKDTree, width: np.ndarray) -> csr_matrix:
    """Gaussian weights (points at ``position``, points of ``of``) of the standard deviations ``width`` of the former,
    as a sparse matrix. Each row ends at its own cut: with that of the widest, the ten thousands of fine points about a
    small impact would all be neighbours of each other (10 GB)."""
    found = of.query_ball_point(position, _CUT * width, return_sorted=True)
    count = np.fromiter(map(len, found), dtype=np.int64, count=len(found))
    column = np.fromiter(itertools.chain.from_iterable(found), dtype=np.int64, count=int(count.sum()))
    row = np.repeat(np.arange(len(position)), count)
    away = np.linalg.norm(position[row] - of.data[column], axis=1)
    weight = np.exp(-0.5 * (away / width[row]) ** 2)
    return csr_matrix((weight, column, np.concatenate([[0], np.cumsum(count)])), shape=(len(position), of.n))


def _area(solid: OffsetShape, count: int) -> np.ndarray:
    """Area of the surface that belongs to each of the shape's particles, (count,) [m^2]."""
    faces, particle = solid.shape._manifold
    return np.bincount(particle[faces].ravel(), weights=np.repeat(solid.mesh.area_faces / 3.0, 3), minlength=count)
