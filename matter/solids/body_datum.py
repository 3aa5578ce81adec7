"""The surface of a solid as the datum that heights count from: the frame of bodies of any shape, beside
``matter.geometry.frame``'s plane and sphere.

    height(x) = distance of x from the surface, negative inside;   up(x) = grad height;   foot(x) = x - height up

Up is the surface's own normal at the foot, the nearest point of it. Within the grid of ``matter.solids.distance`` both
come from there; beyond it, where the grid ends, from the nearest of the points that the grid's cells hold of the
surface (off by cell^2 / 8 d at a distance d, which is three cells there).

Distances along the surface count from the site (on +z), by the chord c between feet as on the ball of the same volume,

    s = 2 R asin(c / 2 R),   at most pi R.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from matter.solids.distance import Distance, measured
from matter.solids.solid import Solid


@dataclass(frozen=True, eq=False)
class Datum:
    """The surface of a ``solid`` about its centre of mass, with the site on +z. Raises ``InputError`` where it cuts
    itself, or where +z meets no surface."""

    solid: Solid

    @cached_property
    def _site(self) -> tuple[np.ndarray, np.ndarray]:
        return self.solid.site(np.array([0.0, 0.0, 1.0]))

    @property
    def site(self) -> np.ndarray:
        """Place (3,) [m] on +z."""
        return self._site[0]

    @property
    def normal(self) -> np.ndarray:
        """Outward normal (3,) of the surface at the site."""
        return self._site[1]

    @property
    def radius(self) -> float:
        """Radius [m] of the ball of the same volume."""
        return self.solid.radius

    @cached_property
    def depths(self) -> Distance:
        """Depths on a grid."""
        return measured(self.solid, site=self.site)

    @cached_property
    def deepest(self) -> float:
        """Largest depth [m] of a point inside."""
        return float(self.depths.depth.max())

    @cached_property
    def _points(self) -> cKDTree:
        """Points of the surface: the feet of the grid's points within a cell of it."""
        low, cell, depth = self.depths[:3]
        near = low + cell * np.argwhere(np.abs(depth) < cell)
        found, inwards = self.depths.at(near)
        return cKDTree(np.concatenate([near - found[:, None] * inwards, self.solid.vertices]))

    def _beyond(self, position: np.ndarray) -> np.ndarray:
        """(n,) whether points lie beyond the grid."""
        low, cell, depth = self.depths[:3]
        high = low + cell * (np.array(depth.shape) - 1)
        return np.asarray(((position < low) | (position > high)).any(axis=1))

    def _heights(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        position = np.asarray(position, dtype=float)
        depth, inwards = self.depths.at(position)
        height, up = -depth, -inwards
        far = np.flatnonzero(self._beyond(position))
        if len(far):
            height[far], nearest = self._points.query(position[far])
            away = position[far] - self._points.data[nearest]
            up[far] = away / np.maximum(height[far], 1e-300)[:, None]
        return height, up

    def height(self, position: np.ndarray) -> np.ndarray:
        """Height above the surface [m], shape (n,)."""
        return self._heights(position)[0]

    def up(self, position: np.ndarray) -> np.ndarray:
        """Unit vectors of the normal at the foot, shape (n, 3)."""
        return self._heights(position)[1]

    def foot(self, position: np.ndarray) -> np.ndarray:
        """Nearest points of the surface, shape (n, 3) [m]."""
        height, up = self._heights(position)
        return np.asarray(position - height[:, None] * up)

    def along(self, feet: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Distance along the surface [m] of ``feet`` (n, 3) from a point ``centre`` of it, shape (n,)."""
        chord = np.linalg.norm(feet - centre, axis=1)
        return np.asarray(2.0 * self.radius * np.arcsin(np.minimum(0.5 * chord / self.radius, 1.0)))

    def polar(self, position: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance along the surface [m] and azimuth [rad] about a ``centre`` (3,) on it; azimuth 0 is towards +x."""
        up = self.up(centre[None])[0]
        aside = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        east = aside - (aside @ up) * up
        east /= np.linalg.norm(east)
        feet = self.foot(position)
        away = feet - centre
        return self.along(feet, centre), np.arctan2(away @ np.cross(up, east), away @ east)

    def distance(self, position: np.ndarray) -> np.ndarray:
        """Distance along the surface from the site [m], shape (n,)."""
        return self.along(self.foot(position), self.site)

    def azimuth(self, position: np.ndarray) -> np.ndarray:
        """Azimuth about the site [rad] in (-pi, pi], 0 along +x (downrange)."""
        return self.polar(position, self.site)[1]

    @property
    def half_round(self) -> float:
        """Largest distance along the surface [m]."""
        return math.pi * self.radius
