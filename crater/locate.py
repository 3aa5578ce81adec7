"""Find the crater in a cloud: which particles carry the ground, where the axis stands, where the datum lies, how far to look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from crater import cloud as clouds
from crater import surface
from crater.cloud import Cloud
from crater.datum import Datum, fit_plane, fit_sphere, plane, sphere
from crater.radial_profile import Relief, relief, ring_mean
from matter.errors import InputError
from matter.particles import Particles

FAR = 3.0
"""The far field begins at three crater radii."""
HOLLOW = 0.35
"""Depth in spacings below which smoothed ground is no hollow."""


@dataclass(frozen=True)
class Scene:
    """A supported ``body`` in front of a ``datum``, with the undisturbed ground ``before`` where it is known."""

    body: Cloud
    before: surface.Undisturbed | None
    datum: Datum
    reach: float
    within: float = np.inf


def first_datum(cloud: Cloud, kind: str, centre: tuple[float, float, float] | None, radius: float | None) -> Datum:
    """A datum good enough to start from: the plane or sphere through the top of the cloud."""
    p = cloud.position
    if kind == "plane":
        middle = np.median(p[:, :2], axis=0)
        return plane(float(np.quantile(p[:, 2], 0.98)), tuple(middle), source="first guess")
    if kind != "sphere":
        raise InputError(f"datum {kind!r} is not known: take 'plane' or 'sphere'")
    if centre is None and radius is None:
        top = _uppermost(p, cloud.spacing)
        guess = fit_sphere(p[top], float(np.median(cloud.spacing)))
        centre, radius = guess.centre, guess.radius
    elif centre is None:
        top = _uppermost(p, cloud.spacing)
        centre = fit_sphere(p[top], float(np.median(cloud.spacing)), radius=radius).centre
    c = np.asarray(centre)
    r = np.linalg.norm(p - c, axis=1)
    axis = p.mean(axis=0) - c
    if np.linalg.norm(axis) < 0.2 * np.median(r):
        axis = np.array([0.0, 0.0, 1.0])  # a whole body: the impact point is on +z by convention
    return sphere(radius or float(np.quantile(r, 0.98)), centre, axis, "first guess")


def _uppermost(position: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Indices of the highest particle of each column of two spacings in x, y (upper half of a body only)."""
    d = 2.0 * float(np.median(spacing))
    cell = np.floor(position[:, :2] / d).astype(np.int64)
    order = np.lexsort((position[:, 2], cell[:, 1], cell[:, 0]))
    last = np.ones(len(order), dtype=bool)
    last[:-1] = (np.diff(cell[order], axis=0) != 0).any(axis=1)
    return order[last]


def edge_of(cloud: Cloud, datum: Datum) -> float:
    """Distance to which the cloud covers every azimuth [m] (a quarter of the circumference at most on a sphere)."""
    distance, azimuth, _ = datum.polar(cloud.position)
    sector = (azimuth / (2.0 * np.pi) * 16).astype(int) % 16
    far = np.zeros(16)
    np.maximum.at(far, sector, distance)
    edge = float(far.min()) - float(np.median(cloud.spacing))
    return min(edge, 0.5 * np.pi * datum.radius) if datum.is_sphere else edge


def look(scene: Scene, datum: Datum, sectors: int, methods: str = "two", coarse: float = 1.0) -> Relief:
    """The relief of a scene about the axis of ``datum``."""
    columns = surface.make_columns(scene.body, datum, scene.reach, sectors, coarse)
    return relief(surface.measure_heights(scene.body, datum, columns, methods), scene.before)


def depression(ground: Relief, within: float = np.inf) -> tuple[float, float, float]:
    """Shift (along x', y') from the axis to the middle of the deepest hollow (in local spacings), and its radius, all [m]; radius 0 where there is none.

    The hollow is what lies below half of the deepest smoothed height, taken about its centroid; it is looked for ``within`` [m] of the axis.
    """
    columns = ground.columns
    ring = columns.ring
    s, azimuth, h = columns.distance[ring], columns.azimuth, ground.rays
    good = np.isfinite(h)
    area = (np.diff(columns.edges)[ring] * np.maximum(s, 1.0) / columns.count[ring])[good]
    x, y, h = (s * np.cos(azimuth))[good], (s * np.sin(azimuth))[good], h[good]
    smooth = _smooth(x, y, h)
    noise = 1.4826 * float(np.median(np.abs(smooth - np.median(smooth))))
    seen = np.hypot(x, y) <= within
    if not seen.any():
        return 0.0, 0.0, 0.0
    spacing = columns.spacing[ring][good]
    seed = int(np.argmin(np.where(seen, smooth / spacing, np.inf)))
    deepest = float(smooth[seed])
    if deepest > -max(4.0 * noise, HOLLOW * float(spacing[seed])):
        return 0.0, 0.0, 0.0
    hollow = smooth < 0.5 * deepest
    cx, cy = x[seed], y[seed]
    for _ in range(10):
        # grow from the deepest point only, so that a second hollow elsewhere does not pull
        radius = np.sqrt(area[hollow].sum() / np.pi)
        near = hollow & (np.hypot(x - cx, y - cy) < 2.0 * radius)
        if not near.any():
            break
        cx, cy = float(np.average(x[near], weights=area[near])), float(np.average(y[near], weights=area[near]))
    radius = float(np.sqrt(area[near].sum() / np.pi)) if near.any() else 0.0
    return cx, cy, 1.4 * radius


def _smooth(x: np.ndarray, y: np.ndarray, h: np.ndarray) -> np.ndarray:
    tree = cKDTree(np.column_stack([x, y]))
    count = min(9, len(x))
    _, near = tree.query(np.column_stack([x, y]), k=count)
    return np.median(h[near], axis=1)


def far_field(ground: Relief, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Mask of the rings beyond three crater ``radius`` (or the outermost quarter where the cloud ends before), and whether it is far."""
    s = ground.columns.distance
    known = np.isfinite(ring_mean(ground.cell))
    far = known & (s > FAR * radius)
    enough = far.sum() >= 4
    if not enough:
        outer = np.flatnonzero(known)
        far = np.zeros(len(s), dtype=bool)
        far[outer[-max(4, len(outer) // 4) :]] = True
        far &= s > 1.3 * radius
    return far, np.array(enough)


def refit(ground: Relief, datum: Datum, radius: float, centre=None, fixed_radius: float | None = None) -> Datum:
    """The datum fitted to the far field of a relief, less what the ejecta blanket adds there; its axis keeps passing through the crater."""
    far, _ = far_field(ground, radius)
    if far.sum() < 2:
        raise InputError(f"the cloud ends at {ground.columns.edges[-1] / max(radius, 1e-300):.1f} crater radii: no far field to fit a datum to (give it)")
    columns = ground.columns
    thrown = blanket_in_far_field(ground, datum, radius)
    cells = ground.cell[far] - thrown * (radius / columns.distance[far][:, None]) ** BLANKET_EXPONENT
    azimuth = (np.arange(columns.sectors) + 0.5) * 2.0 * np.pi / columns.sectors
    group = np.broadcast_to(np.arange(columns.sectors), cells.shape)
    s = np.broadcast_to(columns.distance[far][:, None], cells.shape)
    a = np.broadcast_to(azimuth, cells.shape)
    weight = np.broadcast_to((datum.area_between(columns.edges[:-1], columns.edges[1:])[far])[:, None], cells.shape)
    good = np.isfinite(cells)
    s, a, h, weight, group = s[good], a[good], cells[good], weight[good], group[good]
    unknown = BLANKET_ERROR * thrown * (radius / float(np.mean(s))) ** BLANKET_EXPONENT
    scale = 0.5 * float(np.median(columns.spacing[far]))
    if datum.is_sphere:
        psi, r = s / datum.radius, datum.radius + h
        local = np.column_stack([r * np.sin(psi) * np.cos(a), r * np.sin(psi) * np.sin(a), r * np.cos(psi)])
        pole = datum.outside(np.array([[0.0, 0.0, datum.radius]]))[0]
        points = datum.outside(local)
        towards = pole - np.asarray(datum.centre)
        found = fit_sphere(points, scale, fixed_radius, centre, weight, (datum.radius, np.asarray(datum.centre)), group, towards)
        return sphere(found.radius, found.centre, pole - np.asarray(found.centre), found.source).raised(0.0, float(np.hypot(found.sigma, unknown)))
    local = np.column_stack([s * np.cos(a), s * np.sin(a), h])
    tilted = fit_plane(local, scale, weight, group)
    level = datum.outside(np.array([[0.0, 0.0, tilted.centre[2]]]))[0]
    normal = np.asarray(tilted.axes)[2] @ np.asarray(datum.axes)
    found = plane(float(level[2]), (float(level[0]), float(level[1])), tuple(normal), tilted.source)
    return found.raised(0.0, float(np.hypot(tilted.sigma, unknown)))


BLANKET_EXPONENT = 3.0
"""Fall of an ejecta blanket with distance (McGetchin et al. 1973), taken where the datum is fitted to ground that still carries some of it."""
BLANKET_ERROR = 0.5
"""Share of the correction for the blanket that is taken for its error."""


def blanket_in_far_field(ground: Relief, datum: Datum, radius: float) -> float:
    """Height t0 [m] of the blanket t0 (r / R)^-3 with R the crater's ``radius``, from the rings between 2 and 3 R; 0 where they lie below the datum."""
    s, mean = ground.columns.distance, ring_mean(ground.cell)
    near = np.isfinite(mean) & (s > 2.0 * radius) & (s < FAR * radius)
    if near.sum() < 3:
        return 0.0
    area = datum.area_between(ground.columns.edges[:-1], ground.columns.edges[1:])[near]
    shape = (radius / s[near]) ** BLANKET_EXPONENT
    return max(0.0, float(np.sum(area * shape * mean[near]) / np.sum(area * shape**2)))


def level_of_far_field(ground: Relief, radius: float) -> tuple[float, float]:
    """Mean height of the far field over the datum and its standard error [m], robust (soft_l1)."""
    far, _ = far_field(ground, radius)
    cells = ground.cell[far]
    if cells.size == 0 or not np.isfinite(cells).any():
        return 0.0, 0.0
    area = ground.datum.area_between(ground.columns.edges[:-1], ground.columns.edges[1:])[far]
    w = np.sqrt(np.broadcast_to(area[:, None], cells.shape)[np.isfinite(cells)] / area.mean())
    h = cells[np.isfinite(cells)]
    scale = max(1.4826 * float(np.median(np.abs(h - np.median(h)))), 1e-3 * float(ground.columns.spacing.min()))
    found = least_squares(lambda p: w * (h - p[0]) / scale, [np.median(h)], loss="soft_l1", x_scale=scale)
    return float(found.x[0]), scale / np.sqrt(len(h))


def level_of_method(ground: Relief, radius: float) -> tuple[float, float]:
    """How far the colour field stands above the column method outside the crater [m], and half of it as an error.

    The column method counts volume and is right on average; the colour field stands low on very irregular clouds (by 0.03 spacings for a
    shaken lattice, 0.2 for independent random points). Which shows only when the datum is given and not fitted by the same method.
    """
    columns = ground.columns
    ring = columns.distance > 1.3 * radius
    difference = (ground.methods["colour"] - ground.methods["column"])[ring]
    if not np.isfinite(difference).any():
        return 0.0, 0.1 * float(columns.spacing.min())
    area = np.broadcast_to(ground.datum.area_between(columns.edges[:-1], columns.edges[1:])[ring][:, None], difference.shape)
    good = np.isfinite(difference) & (np.abs(difference) < 2.0 * columns.spacing[ring][:, None])
    level = float(np.average(difference[good], weights=area[good])) if good.any() else 0.0
    return level, 0.5 * abs(level)


def ground_before(particles: Particles, datum: Datum, reach: float | None = None, sectors: int = 24) -> surface.Undisturbed:
    """The ground of the undisturbed target out to ``reach`` [m] (default: as far as the cloud covers every azimuth)."""
    body = supported_part(clouds.of(particles, "the snapshot before the impact"), datum, None, None, "the snapshot before the impact")
    edge = edge_of(body, datum)
    return surface.undisturbed(body, datum, min(edge, reach) if reach else edge, sectors)


def prepare(
    particles: Particles,
    datum: Datum,
    before: surface.Undisturbed | None = None,
    gravity: float | None = None,
    rise_limit: float | None = None,
    reach: float | None = None,
    what: str = "the snapshot",
    within: float = np.inf,
) -> Scene:
    """The supported part of a snapshot, the ground before the impact, and how far the columns go."""
    body = supported_part(clouds.of(particles, what), datum, gravity, rise_limit, what)
    edge = edge_of(body, datum)
    return Scene(body, before, datum, min(edge, reach) if reach else edge, within)


def supported_part(cloud: Cloud, datum: Datum, gravity: float | None, rise_limit: float | None, what: str) -> Cloud:
    """The particles of ``cloud`` that carry a surface."""
    height = speed = None
    if cloud.velocity is not None and gravity and rise_limit:
        _, _, height = datum.polar(cloud.position)
        speed = datum.vertical(cloud.position, cloud.velocity)
    return cloud.select(clouds.supported(cloud, height, speed, gravity, rise_limit, what))
