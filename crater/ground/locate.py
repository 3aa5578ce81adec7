"""Find the crater in a cloud: which particles carry the ground, where the axis stands, where the datum lies, how far
to look."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from crater.ground import cloud as clouds
from crater.ground import surface, surface_smoothing
from crater.ground.cloud import Cloud
from crater.ground.datum import Datum, fit_sphere, plane, sphere
from crater.ground.radial_profile import Relief, relief
from matter.errors import InputError
from matter.particles import Particles

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


class Search(NamedTuple):
    """How the ground is looked at.

    ``gravity`` [m/s^2] with ``rise_limit`` [m] tells ejecta in flight from ground, the columns go out to ``reach`` [m]
    (None: as far as the cloud does), the crater is looked for ``within`` [m] of the datum's axis; number of
    ``sectors``, ``seed`` of the bootstrap over them.
    """

    gravity: float | None = None
    rise_limit: float | None = None
    reach: float | None = None
    within: float = np.inf
    sectors: int = 24
    seed: int = 1


WIDE_SEARCH = Search()
"""Nothing flies, the columns go as far as the cloud, the crater may be anywhere."""


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


EDGE_SECTORS = 48
"""Sectors that each have to reach the edge: fewer would see the corners of a box and not the middle of its sides."""


def edge_of(cloud: Cloud, datum: Datum) -> float:
    """Distance to which the ground is known at every azimuth [m] (a quarter of the circumference at most on a sphere).

    The kernel's support inside the outermost particles: nearer to the edge the colour field lacks the matter beyond it
    and stands low.
    """
    distance, azimuth, _ = datum.polar(cloud.position)
    sector = (azimuth / (2.0 * np.pi) * EDGE_SECTORS).astype(int) % EDGE_SECTORS
    far = np.zeros(EDGE_SECTORS)
    np.maximum.at(far, sector, distance - surface_smoothing.SUPPORT * cloud.spacing)
    edge = float(far.min())
    return min(edge, 0.5 * np.pi * datum.radius) if datum.is_sphere else edge


def look(scene: Scene, datum: Datum, sectors: int, methods: str = "two", coarse: float = 1.0) -> Relief:
    """The relief of a scene about the axis of ``datum``."""
    columns = surface.make_columns(scene.body, datum, scene.reach, sectors, coarse)
    return relief(surface.measure_heights(scene.body, datum, columns, methods), scene.before)


def depression(ground: Relief, within: float = np.inf) -> tuple[float, float, float]:
    """Shift (along x', y') from the axis to the middle of the deepest hollow (in local spacings), and its radius, all
    [m]; radius 0 where there is none.

    The hollow is what lies below half of the deepest smoothed height, taken about its centroid; it is looked for
    ``within`` [m] of the axis. It is deeper than the noise: that of the undisturbed ground where it is known (what a
    crater throws on the ground, whole layers of a lattice even, is no noise), else that of the ground itself. Raises
    ``InputError`` where no ray meets any ground.
    """
    columns = ground.columns
    ring = columns.ring
    s, azimuth, h = columns.distance[ring], columns.azimuth, ground.rays
    good = np.isfinite(h)
    if not good.any():
        raise InputError("no ray about the site meets any ground: it is gone, or the datum lies elsewhere")
    area = (np.diff(columns.edges)[ring] * np.maximum(s, 1.0) / columns.count[ring])[good]
    x, y, h = (s * np.cos(azimuth))[good], (s * np.sin(azimuth))[good], h[good]
    smooth = _smooth(x, y, h)
    own = 1.4826 * float(np.median(np.abs(smooth - np.median(smooth))))
    seen = np.hypot(x, y) <= within
    if not seen.any():
        return 0.0, 0.0, 0.0
    spacing = columns.spacing[ring][good]
    seed = int(np.argmin(np.where(seen, smooth / spacing, np.inf)))
    deepest = float(smooth[seed])
    noise = own if ground.scatter is None else ground.scatter * float(spacing[seed])
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
    count = min(surface.MEDIAN_OF, len(x))
    _, near = tree.query(np.column_stack([x, y]), k=count)
    return np.median(h[near], axis=1)


def ground_before(
    particles: Particles, datum: Datum, reach: float | None = None, sectors: int = 24
) -> surface.Undisturbed:
    """The ground of the undisturbed target, without the projectile and the headroom above the datum, out to ``reach``
    [m] (default: as far as the cloud covers every azimuth). A loose bed sinks while it comes to rest, and some of its
    headroom falls below the datum, where the carve keeps it."""
    if "layer" in particles:
        particles = particles.select(particles.layer >= 0)
    if "headroom" in particles:
        height = datum.polar(particles.position)[2]
        particles = particles.select((particles.headroom == 0) | (height <= 0.0))
    body = supported_part(
        clouds.particle_cloud(particles, "the snapshot before the impact"),
        datum,
        None,
        None,
        "the snapshot before the impact",
    )
    edge = edge_of(body, datum)
    return surface.undisturbed(body, datum, min(edge, reach) if reach else edge, sectors)


def prepare(
    particles: Particles, datum: Datum, before: surface.Undisturbed | None, search: Search, what: str = "the snapshot"
) -> Scene:
    """The supported part of a snapshot, the ground before the impact, and how far the columns go."""
    body = supported_part(clouds.particle_cloud(particles, what), datum, search.gravity, search.rise_limit, what)
    return scene_of(body, datum, before, search)


def scene_of(body: Cloud, datum: Datum, before: surface.Undisturbed | None, search: Search) -> Scene:
    """A supported ``body`` and how far the columns go: to its edge, or to the search's ``reach`` before."""
    edge = edge_of(body, datum)
    return Scene(body, before, datum, min(edge, search.reach) if search.reach else edge, search.within)


def supported_part(cloud: Cloud, datum: Datum, gravity: float | None, rise_limit: float | None, what: str) -> Cloud:
    """The particles of ``cloud`` that carry a surface."""
    height = speed = None
    if cloud.velocity is not None:
        _, _, height = datum.polar(cloud.position)
        speed = datum.vertical(cloud.position, cloud.velocity)
    return cloud.select(clouds.supported(cloud, height, speed, gravity, rise_limit, what))
