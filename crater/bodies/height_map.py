"""How the surface of a body changed: heights along the normals of its surface before the impact, before and after, and
how deep it is resurfaced.

    change = h_after - h_before                     h by the colour field of the particles (``crater.bodies.levels``)
    noise  = 1.4826 median |h_before - median|      in local spacings, of the undisturbed body

``noise`` is by how far a surface of particles departs from the one that they fill; two that have nothing in common
differ by sqrt(2) of it, and where nothing moved the change is far smaller.

A position is resurfaced where a particle that lay at the surface has gone or moved against the body by more than
``MOVED`` spacings, or where more than a spacing lies on it. How deep: from the surface of before down to the highest
particle under it that neither went nor moved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from crater.bodies import levels
from crater.bodies.body_state import BodyState
from matter.solids.body_shape import Points, Shape, enclosed

MOVED = 1.0
"""Spacings (two radii of a grain) by which matter has to move against the body to count as moved."""
UNDER = 0.75
"""A particle lies under a position where their feet are within this many spacings."""


class HeightMap(NamedTuple):
    """On ``points`` of the surface of before, with local ``spacing`` (n,) [m]: the ground ``before`` and ``after``
    (n,) [m] over it; ``noise`` [spacings]; ``deep`` (n,) [m], how deep the surface is resurfaced, 0 where it is
    not."""

    points: Points
    spacing: np.ndarray
    before: np.ndarray
    after: np.ndarray
    noise: float
    deep: np.ndarray

    @property
    def change(self) -> np.ndarray:
        """Change of height (n,) [m]."""
        return self.after - self.before

    @property
    def error(self) -> np.ndarray:
        """Error (n,) [m] of a change of height where the ground is resurfaced."""
        return np.sqrt(2.0) * self.noise * self.spacing

    def ground(self, after: bool) -> np.ndarray:
        """Places (n, 3) [m] of the ground before or after."""
        height = self.after if after else self.before
        return self.points.position + height[:, None] * self.points.normal

    @property
    def resurfaced_fraction(self) -> float:
        """Fraction of the surface that is resurfaced."""
        return float(self.points.area[self.deep > 0.0].sum() / self.points.area.sum())

    def gained(self) -> tuple[float, float]:
        """Volume [m^3] that the body gained, and its error: of patches of two spacings that are resurfaced, each with
        the error of its change of height."""
        volume = enclosed(self.ground(True), self.points.triangles) - enclosed(
            self.ground(False), self.points.triangles
        )
        resurfaced, patch = self.deep > 0.0, (2.0 * self.spacing) ** 2
        return volume, float(np.sqrt(np.sum((self.points.area * patch * self.error**2)[resurfaced])))


def surface_change(shape: Shape, before: BodyState, after: BodyState) -> HeightMap:
    """The map of a body between two looks at it."""
    points = shape.surface_points(lambda position: levels.local_spacing(before.cloud, position))
    spacing = levels.local_spacing(before.cloud, points.position)
    first = levels.heights(shape, points, before.cloud)
    last = levels.heights(shape, points, after.cloud)
    away = first - np.median(first)
    noise = 1.4826 * float(np.median(np.abs(away) / spacing))
    deep = resurfaced_depth(shape, points, spacing, first, last, before, after)
    return HeightMap(points, spacing, first, last, noise, deep)


def unmoved(before: BodyState, after: BodyState) -> np.ndarray:
    """(n,) of the particles of the body ``before``: whether they still belong to it, where they were against it."""
    one, two = before.particles, after.particles
    rows = np.flatnonzero(before.body)
    order = np.argsort(two.identity)
    at = order[np.minimum(np.searchsorted(two.identity, one.identity[rows], sorter=order), len(order) - 1)]
    same = (two.identity[at] == one.identity[rows]) & after.body[at]
    way = np.linalg.norm(after.position[at] - before.position[rows], axis=1)
    return same & (way < MOVED * before.size)


def resurfaced_depth(
    shape: Shape,
    points: Points,
    spacing: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    before: BodyState,
    after: BodyState,
) -> np.ndarray:
    """Depth (n,) [m] to which the ground under each point is resurfaced."""
    rests = unmoved(before, after)
    foot = shape.nearest_point(before.cloud.position)
    top = foot.height + 0.5 * before.size
    feet = cKDTree(foot.position)
    deep = np.zeros(len(points.position))
    for i, near in enumerate(feet.query_ball_point(points.position, UNDER * spacing)):
        if not near:
            near = [int(feet.query(points.position[i])[1])]
        here = np.asarray(near)
        was = top[here].max()
        held = here[rests[here]]
        deep[i] = was - (top[held].max() if len(held) else top[here].min() - spacing[i])
    # one particle of several at the surface is no depth; what lies on the old ground is at least as deep as itself
    deep[deep < 0.5 * spacing] = 0.0
    buried = last - first > spacing
    deep[buried] = np.maximum(deep[buried], 0.5 * spacing[buried])
    return deep
