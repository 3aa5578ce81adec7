"""Heights of a body's ground along the normals of its surface before the impact, as particles carry it.

As in ``crater.ground.half_level``: the colour field c(x) = sum_j V_j W(x - x_j), with a kernel of two spacings'
support, crosses 1/2, from above, with a spacing of matter above 1/2 under it. Here every column has its own position
and direction.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from crater.ground.cloud import Cloud
from matter.compilation.jit import kernel
from matter.solids.body_shape import Points, Shape

BELOW, ABOVE, STEPS = 6.0, 2.5, 4
"""A column is looked at from so many local spacings below its highest particle to so many above it, in steps of a
spacing over ``STEPS``."""
_WIDER = 1.6
"""How much further apart feet may be than the particle and the column themselves (``shape._BEND``)."""
_AT_ONCE = 4000


@kernel
def _highest(pair, particle, point, normal, position, spacing, top):
    """Raise ``top`` to the highest particle of each column of area spacing^2, plus half a spacing."""
    for n in range(len(pair)):
        i, j = pair[n], particle[n]
        x, y, z = position[j, 0] - point[i, 0], position[j, 1] - point[i, 1], position[j, 2] - point[i, 2]
        t = x * normal[i, 0] + y * normal[i, 1] + z * normal[i, 2]
        if x * x + y * y + z * z - t * t < 0.3183 * spacing[j] ** 2:
            top[i] = max(top[i], t + 0.5 * spacing[j])


@kernel
def _add(pair, particle, point, normal, position, volume, spacing, low, step, colour):
    """Add the kernels of particles to the columns that they reach."""
    for n in range(len(pair)):
        i, j = pair[n], particle[n]
        x, y, z = position[j, 0] - point[i, 0], position[j, 1] - point[i, 1], position[j, 2] - point[i, 2]
        t = x * normal[i, 0] + y * normal[i, 1] + z * normal[i, 2]
        aside = x * x + y * y + z * z - t * t
        h = 2.0 * spacing[j]
        if aside >= h * h:
            continue
        half = np.sqrt(h * h - aside)
        weight = volume[j] * 8.0 / (np.pi * h**3)
        first = max(0, int(np.ceil((t - half - low[i]) / step[i])))
        last = min(colour.shape[1] - 1, int(np.floor((t + half - low[i]) / step[i])))
        for k in range(first, last + 1):
            q = np.sqrt(aside + (low[i] + k * step[i] - t) ** 2) / h
            if q < 0.5:
                colour[i, k] += weight * (1.0 - 6.0 * q * q * (1.0 - q))
            elif q < 1.0:
                colour[i, k] += weight * 2.0 * (1.0 - q) ** 3


@kernel
def _crossed(colour, low, step, steps, height):
    for i in range(len(colour)):
        height[i] = np.nan
        top, solid, gap = -1, 0, 0
        for k in range(colour.shape[1] - 1, -1, -1):
            if colour[i, k] >= 0.5:
                top = k if top < 0 else top
                solid += 1
                gap = 0
            elif top >= 0:
                gap += 1
                if gap >= steps:
                    top, solid = -1, 0
            if top >= 0 and solid >= steps:
                fraction = 0.0
                if top + 1 < colour.shape[1]:
                    fraction = (colour[i, top] - 0.5) / (colour[i, top] - colour[i, top + 1])
                height[i] = low[i] + step[i] * (top + fraction)
                break


def local_spacing(cloud: Cloud, point: np.ndarray) -> np.ndarray:
    """Spacing (n,) [m] of the particle nearest to each of some positions (n, 3)."""
    return np.asarray(cloud.spacing[cKDTree(cloud.position).query(point)[1]])


def heights(shape: Shape, points: Points, cloud: Cloud) -> np.ndarray:
    """Height (n,) [m] of the ground of a ``cloud``, as it would stand about the body of before, over every one of the
    ``points``. Where no column of matter is found the nearest one's stands in."""
    foot = shape.nearest_point(cloud.position)
    spacing = local_spacing(cloud, points.position)
    n = len(points.position)
    columns = cKDTree(points.position)
    top = np.full(n, -np.inf)
    pairs = list(_pairs(columns, foot.position, 0.565 * _WIDER * cloud.spacing))
    for pair, particle in pairs:
        _highest(pair, particle, points.position, points.normal, cloud.position, cloud.spacing, top)
    top = _filled(points, np.where(np.isfinite(top), top, np.nan))
    step = spacing / STEPS
    low = top - BELOW * spacing
    colour = np.zeros((n, int((BELOW + ABOVE) * STEPS) + 1), dtype=np.float32)
    # what lies deep below the ground that its column shows says nothing of it
    nearest = columns.query(foot.position)[1]
    seen = np.flatnonzero(foot.height > low[nearest] - (2.0 + BELOW) * cloud.spacing)
    for pair, particle in _pairs(columns, foot.position[seen], 2.0 * _WIDER * cloud.spacing[seen]):
        rows = seen[particle]
        _add(
            pair, rows, points.position, points.normal, cloud.position, cloud.volume, cloud.spacing, low, step, colour
        )  # fmt: skip
    height = np.empty(n)
    _crossed(colour, low, step, STEPS, height)
    return _filled(points, height)


def _pairs(columns: cKDTree, point: np.ndarray, reach: np.ndarray):
    """Columns and particles whose feet are within the particle's ``reach`` of each other, some at once."""
    for begin in range(0, len(point), _AT_ONCE):
        here = slice(begin, begin + _AT_ONCE)
        lists = columns.query_ball_point(point[here], reach[here], return_sorted=False)
        count = np.array([len(found) for found in lists])
        if count.sum():
            pair = np.concatenate([np.asarray(found, dtype=np.int64) for found in lists if len(found)])
            yield pair, begin + np.repeat(np.arange(len(lists)), count)


def _filled(points: Points, values: np.ndarray) -> np.ndarray:
    known = np.isfinite(values)
    if known.all() or not known.any():
        return np.nan_to_num(values) if not known.any() else values
    nearest = cKDTree(points.position[known]).query(points.position[~known])[1]
    values = values.copy()
    values[~known] = values[known][nearest]
    return values
