"""The ground as particles carry it: heights on columns about the crater's axis, by independent methods.

``colour``   the colour field c(x) = sum_j V_j W(x - x_j) crosses 1/2 (kernel support two spacings),
``highest``  the highest particle within half a spacing of the column, plus half a spacing,
``column``   the volume standing above a level one to three spacings below the ground, spread over the cell's area:
             linear in the particles, hence without the smoothing that rounds a rim off in the other two,
``alpha``    the alpha-shape's outer surface, where asked for.

Columns stand on rings whose distance follows the local spacing (graded targets), so that no column is finer than what
the particles know. All heights are along the local vertical of the datum, with its sphericity kept.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from crater.ground.cloud import Cloud
from crater.ground.datum import Datum
from crater.ground.half_level import Rings, half_level
from matter.errors import InputError
from matter.geometry.alpha_shape import alpha_shape

RING_PER_SPACING = 0.5
MOST_RINGS = 400
ALPHA = 1.5
"""Alpha in spacings: voids below this stay closed."""
MOST_FOR_ALPHA = 30_000
"""Clouds with more particles near the ground are measured without the alpha-shape (a minute per 100,000)."""


@dataclass(frozen=True)
class Columns:
    """Rings about the crater's axis: ``edges`` (n+1,) and centres ``distance`` (n,) [m], local ``spacing`` (n,) [m].

    ``count`` columns per ring for the ray methods, ``sectors`` cells per ring for the column method.
    """

    edges: np.ndarray
    distance: np.ndarray
    spacing: np.ndarray
    count: np.ndarray
    sectors: int

    @property
    def start(self) -> np.ndarray:
        """Index of the first column of each ring, and the total as last entry."""
        return np.concatenate([[0], np.cumsum(self.count)])

    @property
    def ring(self) -> np.ndarray:
        """Ring of each column."""
        return np.repeat(np.arange(len(self.count)), self.count)

    @property
    def azimuth(self) -> np.ndarray:
        """Azimuth of each column [rad]."""
        within = np.arange(self.count.sum()) - self.start[:-1][self.ring]
        return (within + 0.5) * 2.0 * np.pi / self.count[self.ring]


@dataclass(frozen=True)
class Heights:
    """Heights above ``datum`` [m]: ``cell`` (rings, sectors) of the column method; ``colour``, ``highest`` (columns,)
    of the rays.

    NaN where there is no ground. ``alpha_shape`` is None unless asked for.
    """

    datum: Datum
    columns: Columns
    cell: np.ndarray | None
    colour: np.ndarray
    highest: np.ndarray
    alpha_shape: np.ndarray | None = None

    def cells_of(self, rays: np.ndarray) -> np.ndarray:
        """A ray method averaged into the same (rings, sectors) cells; cells without a ray take the ring's mean."""
        ring, sectors = self.columns.ring, self.columns.sectors
        sector = (self.columns.azimuth / (2.0 * np.pi) * sectors).astype(int) % sectors
        good = np.isfinite(rays)
        index = ring[good] * sectors + sector[good]
        size = len(self.columns.count) * sectors
        number = np.bincount(index, minlength=size)
        total = np.bincount(index, rays[good], minlength=size)
        with np.errstate(invalid="ignore", divide="ignore"):
            cells = (total / number).reshape(-1, sectors)
            mean = total.reshape(-1, sectors).sum(axis=1) / number.reshape(-1, sectors).sum(axis=1)
        # inside the rings with fewer rays than sectors only: elsewhere a cell without ground stays empty
        few = self.columns.count < 2 * sectors
        fill = np.isnan(cells) & few[:, None]
        return np.where(fill, mean[:, None], cells)


def make_columns(cloud: Cloud, datum: Datum, reach: float, sectors: int = 24, coarse: float = 1.0) -> Columns:
    """Columns out to ``reach`` [m] whose rings are half a local spacing wide (``coarse`` times that for a quick look).

    The local spacing at a distance is the median over the uppermost particles there.
    """
    distance, _, height = datum.polar(cloud.position)
    d = cloud.spacing
    smallest = (
        float(np.quantile(d[distance < max(0.3 * reach, 4.0 * np.quantile(d, 0.05))], 0.1))
        if (distance < 0.3 * reach).any()
        else 0.0
    )
    smallest = smallest or float(np.quantile(d, 0.05))
    bins = np.arange(0.0, reach + 2.0 * smallest, 2.0 * smallest)
    which = np.digitize(distance, bins) - 1
    local = np.full(len(bins), np.nan)
    for i in np.unique(which[distance <= bins[-1]]):
        members = np.flatnonzero(which == i)
        top = members[height[members] > np.quantile(height[members], 0.6)] if len(members) > 20 else members
        local[i] = np.median(d[top]) if len(top) else np.nan
    good = np.isfinite(local)
    if not good.any():
        raise InputError("no particles below the columns: the datum or the crater's centre lies outside the cloud")
    ends = [0.0]
    while ends[-1] < reach and len(ends) <= MOST_RINGS:
        here = np.interp(ends[-1], bins[good] + smallest, local[good])
        ends.append(ends[-1] + max(RING_PER_SPACING * coarse * here, reach / MOST_RINGS))
    edges = np.asarray(ends)
    middle = 0.5 * (edges[1:] + edges[:-1])
    spacing = np.interp(middle, bins[good] + smallest, local[good])
    around = datum.radius * np.sin(middle / datum.radius) if datum.is_sphere else middle
    count = np.maximum(6, np.ceil(2.0 * np.pi * np.maximum(around, 0.0) / (coarse * spacing))).astype(np.int64)
    return Columns(edges, middle, spacing, count, sectors)


def measure_heights(cloud: Cloud, datum: Datum, columns: Columns, methods: str = "two") -> Heights:
    """Heights of the supported ``cloud`` above ``datum``.

    ``methods``: ``"two"`` (colour field, highest particle), ``"three"`` (and the column method) or ``"four"`` (and the
    alpha-shape).
    """
    distance, _, height = datum.polar(cloud.position)
    inside = distance < columns.edges[-1] + 2.0 * columns.spacing[-1]
    t_lo, t_hi = _window(distance[inside], height[inside], columns)
    inside &= (height > t_lo - 2.0 * cloud.spacing) & (height < t_hi + 2.0 * cloud.spacing)
    near = cloud.select(inside)
    radius = datum.radius if datum.is_sphere else 1.0
    rings = Rings(
        datum.is_sphere, radius, columns.distance, columns.start[:-1], columns.count, _positions(datum, columns)
    )
    crossing, highest = half_level(near, datum, rings, columns.spacing, t_lo, t_hi)
    result = Heights(datum, columns, None, crossing, highest)
    if methods == "two":
        return result
    cell = column_heights(near, datum, columns, _filled(result.cells_of(crossing)))
    outer = alpha_heights(near, datum, columns, t_hi) if methods == "four" and len(near) <= MOST_FOR_ALPHA else None
    return replace(result, cell=cell, alpha_shape=outer)


def _positions(datum: Datum, columns: Columns) -> np.ndarray:
    """Canonical direction (sphere) or position (plane) of every column, shape (n, 3)."""
    s, a = columns.distance[columns.ring], columns.azimuth
    if datum.is_sphere:
        psi = s / datum.radius
        return np.column_stack([np.sin(psi) * np.cos(a), np.sin(psi) * np.sin(a), np.cos(psi)])
    return np.column_stack([s * np.cos(a), s * np.sin(a), np.zeros(len(s))])


def _window(distance: np.ndarray, height: np.ndarray, columns: Columns) -> tuple[float, float]:
    """Heights between which the ground of every column lies [m]: from four spacings below the lowest ring's top
    upwards."""
    ring = np.digitize(distance, columns.edges) - 1
    good = ring < len(columns.distance)
    top = np.full(len(columns.distance), -np.inf)
    if good.any():
        np.maximum.at(top, ring[good], height[good])
    known = np.isfinite(top)
    if not known.any():
        raise InputError("no particles below the columns: the datum or the crater's centre lies outside the cloud")
    d = columns.spacing[known]
    return float((top[known] - 4.0 * d).min()), float((top[known] + 2.5 * d).max())


def _filled(cells: np.ndarray) -> np.ndarray:
    """Cells smoothed by the median of their eight neighbours and themselves (azimuth wraps)."""
    padded = np.pad(np.hstack([cells[:, -1:], cells, cells[:, :1]]), ((1, 1), (0, 0)), mode="edge")
    rows, columns = cells.shape
    stack = np.stack([padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nanmedian(stack, axis=0)


def column_heights(cloud: Cloud, datum: Datum, columns: Columns, guess: np.ndarray) -> np.ndarray:
    """Height of the ground in each (ring, sector) cell from the volume standing above a level below the ``guess`` [m].

    The level is spread as a ramp from 3 to 1 local spacings below the guess, so that no layer of a lattice is in or
    out as a whole: h = z_mid + sum_j w_j V_j (R / r_j)^2 / A with w the ramp, A the cell's area on the datum.
    """
    distance, azimuth, height = datum.polar(cloud.position)
    ring = np.digitize(distance, columns.edges) - 1
    sector = (azimuth / (2.0 * np.pi) * columns.sectors).astype(int) % columns.sectors
    inside = ring < len(columns.distance)
    ring, sector, height, volume = ring[inside], sector[inside], height[inside], cloud.volume[inside]
    area = datum.area_between(columns.edges[:-1], columns.edges[1:])[:, None] / columns.sectors
    d = columns.spacing[:, None]
    if datum.is_sphere:
        volume = volume / (1.0 + height / datum.radius) ** 2
    low, high = guess - 3.0 * d, guess - 1.0 * d
    here = (ring, sector)
    ramp = np.clip((height - low[here]) / (high[here] - low[here]), 0.0, 1.0)
    ramp[height > guess[here] + 2.0 * d[ring, 0]] = 0.0
    ramp[~np.isfinite(ramp)] = 0.0
    index = ring * columns.sectors + sector
    stands = np.bincount(index, ramp * volume, minlength=guess.size).reshape(guess.shape) / area
    # cells smaller than a few particles cannot say more than their ring
    return 0.5 * (low + high) + np.where(area < 2.0 * d**2, stands.mean(axis=1, keepdims=True), stands)


def alpha_heights(cloud: Cloud, datum: Datum, columns: Columns, above: float) -> np.ndarray:
    """Height at which each column, coming from ``above`` [m], meets the alpha-shape grown by half a spacing; NaN where
    it meets none."""
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    solid = alpha_shape(cloud.position, cloud.spacing, ALPHA).only(1)
    mesh = solid.offset(0.5 * cloud.spacing).mesh
    position = column_points(datum, columns.distance[columns.ring], columns.azimuth)
    up = (
        position - np.asarray(datum.centre)
        if datum.is_sphere
        else np.broadcast_to(np.asarray(datum.axes)[2], position.shape)
    )
    up = up / np.linalg.norm(up, axis=1)[:, None]
    scale = float(np.median(cloud.spacing))  # embree works in single precision: spacings from a near origin
    middle = position.mean(axis=0)
    mesh.apply_translation(-middle)
    mesh.apply_scale(1.0 / scale)
    origin = (position + (above + scale) * up - middle) / scale
    hit, ray, _ = RayMeshIntersector(mesh).intersects_location(origin, -up, multiple_hits=False)
    result = np.full(len(position), np.nan)
    result[ray] = above + scale - np.linalg.norm(hit - origin[ray], axis=1) * scale
    return result


MEDIAN_OF = 9
"""Columns over whose median a hollow is looked for."""
WIDE = 250
"""Columns over which the ground before the impact is averaged where it has been moved: some six spacings around."""


@dataclass(frozen=True)
class Undisturbed:
    """The ground before the impact, measured once: positions in space, ``excess`` over the datum there per method [m],
    local ``spacing`` [m].

    ``wide`` is the excess averaged over some six spacings, ``scatter`` the robust deviation of medians over nine
    columns from it [local spacings].
    """

    tree: cKDTree
    excess: dict[str, np.ndarray]
    spacing: np.ndarray
    wide: dict[str, np.ndarray]
    scatter: float

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The four nearest columns of every one of ``points`` (n, 3), in the frame of the snapshot, and their weights;
        both (n, 4)."""
        distance, near = self.tree.query(points, k=4)
        weight = 1.0 / np.maximum(distance, 1e-3 * np.maximum(distance[:, -1:], 1e-300)) ** 2
        return near, weight / weight.sum(axis=1)[:, None]

    def at(self, method: str, nearest: tuple[np.ndarray, np.ndarray], height: np.ndarray) -> np.ndarray:
        """Excess to be taken from the ``height`` (n,) found where ``nearest`` was asked for.

        Ground that has hardly moved still shows the imprint of its own particles: there the excess is that of the
        nearest columns. Ground that has moved by a spacing is made of other particles, and the old imprint would only
        add its scatter: there it is the mean of the wider surroundings.
        """
        near, weight = nearest
        local = (weight * self.excess[method][near]).sum(axis=1)
        moved = (height - local) / self.spacing[near[:, 0]]
        wide = self.wide[method][near[:, 0]]
        keep = np.exp(-4.0 * np.where(np.isfinite(moved), moved, np.inf) ** 2)
        return wide + keep * (local - wide)


def column_points(datum: Datum, distance: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """Places on the datum, in the frame of the snapshot (n, 3) [m]."""
    if datum.is_sphere:
        psi = distance / datum.radius
        local = datum.radius * np.column_stack(
            [np.sin(psi) * np.cos(azimuth), np.sin(psi) * np.sin(azimuth), np.cos(psi)]
        )
    else:
        local = np.column_stack([distance * np.cos(azimuth), distance * np.sin(azimuth), np.zeros(len(distance))])
    return datum.outside(local)


def undisturbed(cloud: Cloud, datum: Datum, reach: float, sectors: int) -> Undisturbed:
    """Measure the ground before the impact; gaps take the median."""
    columns = make_columns(cloud, datum, reach, sectors)
    heights = measure_heights(cloud, datum, columns, "four")
    ring = columns.ring
    sector = (columns.azimuth / (2.0 * np.pi) * sectors).astype(int) % sectors
    excess = {"colour": heights.colour, "highest": heights.highest}
    if heights.cell is not None:
        excess["column"] = heights.cell[ring, sector]
    if heights.alpha_shape is not None:
        excess["alpha"] = heights.alpha_shape
    tree = cKDTree(column_points(datum, columns.distance[ring], columns.azimuth))
    _, near = tree.query(tree.data, k=min(WIDE, len(tree.data)))
    wide = {}
    for name, values in excess.items():
        middle = float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
        excess[name] = np.where(np.isfinite(values), values, middle)
        wide[name] = excess[name][near].mean(axis=1)
    spacing = columns.spacing[ring]
    deviation = (np.median(excess["colour"][near[:, :MEDIAN_OF]], axis=1) - wide["colour"]) / spacing
    return Undisturbed(tree, excess, spacing, wide, 1.4826 * float(np.median(np.abs(deviation))))
