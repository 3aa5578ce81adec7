"""Local tangent map: the ground round the impact site flattened, so that a crater on a body is measured like one on
flat ground.

With S the site, N the normal there and p the foot of a particle on the surface of before the impact, at the height h:

    azimuth = that of p - S in the tangent plane        distance s = sqrt(A(|p - S|) / pi)        z = h

A(c) is the area of that surface within the chord c of S, so that areas are kept: on a plane s = c and on a ball too (a
cap of chord c has the area pi c^2: Archimedes), whose map is then Lambert's azimuthal one. Where the surface curves a
volume at the height h stands on an area larger by (1 + h k)^2 (``Shape.widening``), by which it is divided. A
diameter is that of the circle which on flat ground has the area that the rim encloses on the surface of before.

A hollow so deep that the surface beside it is nearer to its floor than the one above (some half of the radius of
curvature), or so wide that little of the ground round the site lies outside it, is not found here: the body is then
made anew, and the map (``height_map``) shows it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from matter.errors import InputError
from matter.particles import Particles
from matter.solids.body_shape import Shape
from matter.solids.pose_tracker import PoseTracker

REACH = 1.3
"""Farthest chord from the site, in radii of the ball of the body's volume: some 80 deg on a ball."""
DEEP = 0.8
"""Deepest particles that are kept, in the body's largest depth."""
_GRID = 40


class TangentMap:
    """Map of the ground of a ``shape`` round its site, of a body whose particles stood as in ``tracker``."""

    def __init__(self, shape: Shape, tracker: PoseTracker):
        self.shape, self.tracker = shape, tracker
        placed = shape.placed
        self.site, self.normal = np.array([0.0, 0.0, placed.height]), placed.normal
        first = np.array([1.0, 0.0, 0.0]) - placed.normal[0] * placed.normal
        self.first = first / np.linalg.norm(first)
        self.second = np.cross(self.normal, self.first)

    @property
    def reach(self) -> float:
        """Farthest distance along the ground that is mapped [m]."""
        return float(self.distance(np.array([REACH * self.shape.solid.radius]))[0])

    @cached_property
    def _distance_ratio(self) -> tuple[np.ndarray, np.ndarray]:
        """Chords [m], and the distances of equal area over them."""
        radius = self.shape.solid.radius
        points = self.shape.surface_points(lambda position: np.full(len(position), 0.03 * radius))
        away = np.linalg.norm(points.position - self.site, axis=1)
        chord = np.linspace(0.4, 1.6, _GRID) * radius
        within = np.array([points.area[away < c].sum() for c in chord])
        return chord, np.sqrt(within / np.pi) / chord

    def distance(self, chord: np.ndarray) -> np.ndarray:
        """Distance along the flat ground [m] of points at a ``chord`` (n,) [m] from the site."""
        grid, ratio = self._distance_ratio
        # from a tangent at the site to the first chord that points tell apart
        return chord * np.interp(chord, np.concatenate([[0.0], grid]), np.concatenate([[1.0], ratio]))

    def flat(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Flat coordinates (n, 3) [m] of positions (n, 3) about the body as it stood before the impact, and their
        chords."""
        foot = self.shape.nearest_point(position)
        away = foot.position - self.site
        chord = np.linalg.norm(away, axis=1)
        azimuth = np.arctan2(away @ self.second, away @ self.first)
        s = self.distance(chord)
        return np.column_stack([s * np.cos(azimuth), s * np.sin(azimuth), foot.height]), chord

    def flattened(self, particles: Particles) -> Particles:
        """The flattened ground of a snapshot: positions, velocities against the body, and volumes (by ``radius`` or
        ``density``); what is far from the site or deep below it is left out. ``widening`` is added, by which volumes
        were divided: ``density / widening`` is that of the matter.

        ``initial_position`` becomes that from the site, z along its normal. Raises ``InputError`` where nothing is
        left.
        """
        pose = self.tracker.pose(particles)
        position = pose.back(particles.position)
        flat, chord = self.flat(position)
        here = (chord < REACH * self.shape.solid.radius) & (flat[:, 2] > -DEEP * self.shape.datum.deepest)
        if not here.any():
            raise InputError("nothing of the body lies about the site")
        seen = particles.select(here)
        position, flat = position[here], flat[here]
        seen["position"] = flat
        if "velocity" in seen:
            moving = pose.back_velocity(particles.position[here], particles.velocity[here])
            seen["velocity"] = self._turned(position, moving)
        widening = self.shape.widening(position, flat[:, 2])
        if "radius" in seen:
            seen["radius"] = seen.radius / np.cbrt(widening)
        elif "density" in seen:
            seen["density"] = seen.density * widening
        seen["widening"] = widening
        if "initial_position" in seen:
            seen["initial_position"] = self.shape.placed.from_site(seen.initial_position)
        return seen

    def curvature(self, within: float) -> float:
        """Mean curvature [1/m] of the surface within a chord of the site [m]."""
        points = self.shape.surface_points(lambda position: np.full(len(position), 0.1 * within))
        near = np.linalg.norm(points.position - self.site, axis=1) < within
        if not near.any():
            return 0.0
        bent = self.shape.curvature(points.position[near], np.zeros(int(near.sum())))
        return float(np.average(bent, weights=points.area[near]))

    def _turned(self, position: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Vectors (n, 3) at ``position`` with the local normal turned onto z, by the shortest way from the site's."""
        n = self.shape.nearest_point(position).normal
        up = np.einsum("ij,ij->i", vector, n)
        across = vector - up[:, None] * n
        # shortest turn of n onto N, of a vector that lies across n
        fraction = across @ self.normal / np.maximum(1.0 + n @ self.normal, 1e-3)
        level = across - fraction[:, None] * (n + self.normal)
        return np.column_stack([level @ self.first, level @ self.second, up])
