"""The surface of a body before the impact: the nearest point of it, the height over it, and points spread over it.

Everything is in the frame of the run at the moment of the impact (``matter.solids.placed``): about the centre of mass,
the site on +z.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from matter.solids import halved_sides
from matter.solids.body_datum import Datum
from matter.solids.placed import Placed

MOST_POINTS = 60_000
"""The surface is not divided further than to some so many points."""
_BEND = (0.6, 1.6)
"""Bounds of the factor by which an offset surface is larger: deep below an edge it has no meaning."""


class SurfacePoint(NamedTuple):
    """The nearest point of the surface ``position`` (n, 3) [m], the ``height`` (n,) [m] over it, positive outside, and
    the outward ``normal`` (n, 3)."""

    position: np.ndarray
    height: np.ndarray
    normal: np.ndarray


class Points(NamedTuple):
    """Points of the surface ``position`` (n, 3) [m], outward ``normal`` (n, 3), the ``area`` (n,) [m^2] that each
    stands for, and the ``triangles`` (m, 3) between them."""

    position: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    triangles: np.ndarray


class Shape:
    """The surface of a ``placed`` body, of an ellipsoid with its full ``axes`` [m]. Raises ``InputError`` where it
    cuts itself."""

    def __init__(self, placed: Placed, axes: tuple[float, float, float] | None = None):
        self.placed, self.solid = placed, placed.solid
        self.axes = axes
        self.datum = Datum(placed.solid)

    def nearest_point(self, position: np.ndarray) -> SurfacePoint:
        """The foot of every position (n, 3) [m]."""
        height, normal = self.datum.height(position), self.datum.up(position)
        return SurfacePoint(position - height[:, None] * normal, height, normal)

    def widening(self, position: np.ndarray, height: np.ndarray) -> np.ndarray:
        """By how much the surface at a ``height`` (n,) [m] is larger than its foot: (1 + h k)^2."""
        return np.clip((1.0 + height * self.curvature(position, height)) ** 2, *_BEND)

    def curvature(self, position: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Mean curvature k (n,) [1/m] of the surface under positions at a ``height`` (n,) [m], positive where it
        bulges out: from the divergence S = 2 k / (1 + h k) of the normals at the position."""
        step = 2.0 * self.datum.depths.cell
        divergence = np.zeros(len(position))
        for axis in range(3):
            ends = []
            for sign in (1.0, -1.0):
                moved = position.copy()
                moved[:, axis] += sign * step
                ends.append(self.datum.up(moved)[:, axis])
            divergence += (ends[0] - ends[1]) / (2.0 * step)
        return np.asarray(divergence / np.clip(2.0 - height * divergence, 0.5, None))

    def surface_points(self, spacing: Callable[[np.ndarray], np.ndarray]) -> Points:
        """Points no further apart than about ``spacing(position)`` [m]: corners of the surface's triangles, whose
        sides are halved until they are short enough, or ``MOST_POINTS`` are there. An ellipsoid begins with few."""
        import trimesh

        vertices, triangles = self.solid.vertices, self.solid.triangles
        if self.axes is not None:
            ball = trimesh.creation.icosphere(subdivisions=3)
            vertices, triangles = self._onto_ellipsoid(np.asarray(ball.vertices)), np.asarray(ball.faces)
        for _ in range(24):
            known = halved_sides.sides(triangles)
            one, two = vertices[known.ends].swapaxes(0, 1)
            ratio = np.linalg.norm(two - one, axis=1) / spacing(0.5 * (one + two))
            room = MOST_POINTS - len(vertices)
            long = np.flatnonzero(ratio > 1.0)
            if not len(long) or room < 1:
                break
            cut = np.zeros(len(ratio), dtype=bool)
            cut[long[np.argsort(-ratio[long], kind="stable")[:room]]] = True
            vertices, triangles = halved_sides.halved(vertices, triangles, known, cut)
            if self.axes is not None:
                vertices = self._onto_ellipsoid(vertices @ self.placed.turn / self.axes)
        return spread(np.asarray(vertices), np.asarray(triangles))

    def _onto_ellipsoid(self, direction: np.ndarray) -> np.ndarray:
        """Points of the ellipsoid under directions (n, 3) of the ball that it is a stretched one of."""
        unit = direction / np.linalg.norm(direction, axis=1)[:, None]
        return np.asarray(0.5 * unit * self.axes @ self.placed.turn.T)


def spread(vertices: np.ndarray, triangles: np.ndarray) -> Points:
    """Points at the corners of ``triangles``, each with a third of the area of those around it, and their mean
    normal."""
    corner = vertices[triangles]
    double = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area, normal = np.zeros(len(vertices)), np.zeros((len(vertices), 3))
    for k in range(3):
        np.add.at(area, triangles[:, k], np.linalg.norm(double, axis=1) / 6.0)
        np.add.at(normal, triangles[:, k], double)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    return Points(vertices, normal, area, triangles)


def enclosed(position: np.ndarray, triangles: np.ndarray) -> float:
    """Volume [m^3] inside triangles whose corners are at ``position`` (n, 3) (divergence theorem)."""
    corner = position[triangles]
    return float(np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6.0)
