"""The domain of grains that are a whole body of any shape: no floor, no sides, all matter of the source belongs to it.

The datum is the surface of the undisturbed body (``matter.solids.body_datum``), heights are distances from it along
its own normal. The body turns: its bed lies as it was at the moment of the impact, and a snapshot of the time t is
turned back by omega t (``handoff.domains.turning``) before it is handed over. In these axes, which do not turn
themselves, velocities are still those of the inertial frame; the ground moves with omega x x, and ``flow`` is the
motion against it.

The bed's attribute ``domain`` holds ``shape = "whole"``, ``radius_m`` (ball of the body's volume) and
``angular_velocity_1_s``; the surface itself comes from ``[target]``, or from the file that the handoff leaves
(``datum.ply``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from matter.case.body import Target
from matter.errors import InputError
from matter.points import sobol
from matter.solids import solid as solids
from matter.solids.body_datum import Datum
from matter.solids.solid import Solid

HEADROOM = 2.0
"""Height above the datum, in mean grain radii, up to which ground that has risen counts as ground: the bed has no
grains above its surface, and what has risen goes to those below."""
SURFACE_FILE = "datum.ply"
"""The undisturbed surface, as a handoff leaves it."""
SAME = 1e-3
"""Largest relative difference of the radii of one body in the bed and in ``[target]``."""
_CELLS, _MARGIN = 28, 0.2
# the volume in which both clouds are sampled: cubes, so many along the body's longest side, and how far it reaches
# above the datum, in radii of the body
_DEEP = 0.9
# columns of the surface reach down to this fraction of the greatest depth
_POOL = 8192
_LEAST = 0.01


@lru_cache(maxsize=2)
def _datum(solid: Solid) -> Datum:
    datum = Datum(solid)
    try:
        datum.depths  # noqa: B018  (computed once, kept)
    except InputError as reason:
        raise InputError(f"[target] file: {reason}") from None
    return datum


@dataclass(frozen=True, eq=False)
class WholeBody:
    """All within the ``shape`` and around it; ``top`` [m] above the datum; rotation ``omega`` (3,) [1/s]; ``reach``
    [m]: how far along the datum from the site feet of columns are taken."""

    shape: Datum
    top: float
    omega: np.ndarray
    reach: float = math.inf

    @property
    def frame(self) -> Datum:
        return self.shape

    @property
    def datum(self) -> float:
        """Radius [m] of the ball of the body's volume."""
        return self.shape.radius

    @property
    def arc(self) -> float:
        """Distance along the datum from the site to the edge of what is looked at [m]."""
        return min(self.reach, self.shape.half_round)

    @property
    def span(self) -> tuple[float, float]:
        """Heights above the datum [m] between which a surface is looked for."""
        return -_DEEP * self.shape.deepest, self.top

    @property
    def _above(self) -> float:
        return max(self.top, _MARGIN * self.shape.radius)

    @cached_property
    def _cubes(self) -> tuple[np.ndarray, float]:
        """Lower corners (c, 3) [m] and edge [m] of the cubes that the domain is made of."""
        vertices = self.shape.solid.vertices
        low, high = vertices.min(axis=0) - self._above, vertices.max(axis=0) + self._above
        edge = float((high - low).max()) / _CELLS
        count = np.ceil((high - low) / edge).astype(np.int64)
        corner = low + edge * np.argwhere(np.ones(count, dtype=bool))
        near = self.shape.height(corner + 0.5 * edge) < self._above + 0.5 * math.sqrt(3.0) * edge
        return corner[near], edge

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        corner, edge = self._cubes
        return len(corner) * edge**3

    def even_points(self, uniform: np.ndarray) -> np.ndarray:
        """Map (n, 3) numbers in the unit cube to points of even density."""
        corner, edge = self._cubes
        scaled = uniform[:, 0] * len(corner)
        cube = np.minimum(scaled.astype(np.int64), len(corner) - 1)
        return corner[cube] + edge * np.column_stack([scaled - cube, uniform[:, 1:]])

    def depth_inside(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the edge of the domain, far above the datum, positive inside."""
        return np.asarray(self._above - self.shape.height(position))

    def between(self, position: np.ndarray) -> np.ndarray:
        """(n,) all matter belongs to the body."""
        return np.ones(len(position), dtype=bool)

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) no face cuts through matter: inf."""
        return np.full(len(position), math.inf)

    def wall_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) there are no walls: inf."""
        return np.full(len(position), math.inf)

    def flow(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Velocity (n, 3) [m/s] against the ground, which turns with the body."""
        return np.asarray(velocity - np.cross(self.omega, position))

    def inertial(self, position: np.ndarray, velocity: np.ndarray, spin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Velocities (n, 3) [m/s] and spins (n, 3) [rad/s] of what has these against the ground, at these
        positions."""
        return velocity + np.cross(self.omega, position), spin + self.omega

    def pace(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Speed (n,) [m/s] that errors of momentum count against: that of the flow, and where nothing flows a
        hundredth of that of the ground."""
        ground = np.cross(self.omega, position)
        return np.asarray(np.hypot(*(np.linalg.norm(v, axis=1) for v in (velocity - ground, _LEAST * ground))))

    # -- the datum

    @property
    def pole(self) -> np.ndarray:
        """Point of the datum (3,) [m] where the projectile hit."""
        return self.shape.site

    def on_datum(self, point: np.ndarray) -> np.ndarray:
        """The point of the datum (3,) [m] nearest to a ``point`` (3,)."""
        return np.asarray(self.shape.foot(point[None])[0])

    def polar(self, position: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance along the datum [m] and azimuth [rad] of points (n, 3) about a ``centre`` on the datum."""
        return self.shape.polar(position, centre)

    def part(self, radius: float) -> WholeBody:
        """The same, looked at within ``radius`` [m] of the site."""
        return replace(self, reach=radius)

    def volume_below(self, height: np.ndarray, area: float) -> float:
        """Volume [m^3] between the datum and ``height`` (n,) [m] over columns of this ``area`` [m^2] each; columns
        narrow with depth as on the ball of the body's volume."""
        radius = self.shape.radius
        return float(np.sum((radius**3 - (radius + height) ** 3) / 3.0) * area / radius**2)

    @cached_property
    def _pool(self) -> tuple[np.ndarray, float]:
        """Even points of the datum within reach (m, 3) [m], and the area that they stand for together [m^2]."""
        solid, site = self.shape.solid, self.shape.site
        corner = solid.vertices[solid.triangles]
        area = 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
        middle = corner.mean(axis=1)
        size = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1)
        near = np.flatnonzero(np.linalg.norm(middle - site, axis=1) - size < self.reach)
        edges = np.cumsum(area[near])
        stream = sobol.stream(5)
        feet, drawn = np.empty((0, 3)), 0
        while len(feet) < _POOL and drawn < 64 * _POOL:
            number = stream.random(_POOL)
            chosen = corner[near[np.minimum(np.searchsorted(edges, number[:, 0] * edges[-1]), len(near) - 1)]]
            u, v = np.sqrt(number[:, 1]), number[:, 2]
            weight = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
            trial = np.einsum("ij,ijk->ik", weight, chosen)
            feet = np.concatenate([feet, trial[self.shape.along(trial, site) <= self.arc]])
            drawn += _POOL
        return feet, float(edges[-1]) * len(feet) / drawn

    @property
    def area(self) -> float:
        """Area of the datum within reach [m^2]."""
        return self._pool[1]

    def feet(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Even points on the datum within reach (m, 3), at most ``count``, their distance along it from the site (m,),
        and the normal there (m, 3)."""
        foot = self._pool[0][:count]
        return foot, self.shape.along(foot, self.shape.site), self.shape.up(foot)


def read(attributes: Mapping[str, Any], target: Target | None) -> WholeBody:
    """The domain of a bed that is a whole body, of the surface of ``target``. Raises ``InputError`` where that is
    missing, or is another body."""
    if target is None or not target.solid:
        raise InputError('the bed is a solid body: [target] shape = "ellipsoid" or "mesh" must say which')
    return _with(attributes, target.placed.solid)


def of_file(attributes: Mapping[str, Any], path: Path) -> WholeBody:
    """The same, of the surface that a handoff has left in ``path``. Raises ``InputError``."""
    return _with(attributes, solids.read(path, 1.0))


def _with(attributes: Mapping[str, Any], solid: Solid) -> WholeBody:
    table = attributes.get("domain")
    missing = [name for name in ("radius_m", "angular_velocity_1_s") if name not in (table or {})]
    if not isinstance(table, Mapping) or missing:
        raise InputError(f"the bed's attribute 'domain' lacks {', '.join(missing)}")
    if abs(float(table["radius_m"]) / solid.radius - 1.0) > SAME:
        raise InputError(
            f"the bed is a body of {float(table['radius_m']):.6g} m radius (ball of its volume), that of [target] has "
            f"{solid.radius:.6g} m: they are two"
        )
    if not float(attributes.get("mean_radius_m", 0.0)) > 0.0:
        raise InputError("the bed carries no attribute 'mean_radius_m', the mean radius of its grains")
    omega = np.array(table["angular_velocity_1_s"], dtype=float)
    return WholeBody(_datum(solid), HEADROOM * float(attributes["mean_radius_m"]), omega)
