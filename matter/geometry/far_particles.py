"""Particles far from a cloud, and what a triangulation of all of them can resolve."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from matter.errors import InputError

NEAR, FAR = 1e5, 1e6
"""Spacings from end to end: below ``NEAR`` nothing is drawn in, what is still above ``FAR`` after it is refused."""


def drawn_near(points: np.ndarray, spacing: np.ndarray, factor: float) -> np.ndarray:
    """The points as they are triangulated: those that lie far out and belong to no kept tetrahedron are drawn in, to
    where they still belong to none.

    A triangulation in double precision resolves some 1e6 spacings from end to end. The corners of a kept tetrahedron
    lie within d = 2 ``factor`` max(spacing) of each other, so a point with fewer than three others within d is no
    corner of one, nor inside the sphere through one; neither is a point further than d from all that have three.

    Raises ``InputError``, naming the outermost point, where the others still lie too far apart.
    """
    if np.ptp(points, axis=0).max() <= NEAR * spacing.min():
        return points
    reach = 2.0 * factor * float(spacing.max())
    alone = cKDTree(points).query(points, k=4)[0][:, -1] > reach
    if alone.all():
        return points
    middle = np.median(points[~alone], axis=0)
    way = points - middle
    distance = np.linalg.norm(way, axis=1)
    rim = float(distance[~alone].max()) + reach
    drawn = alone & (distance > rim)
    near = np.where(drawn[:, None], middle + way * (rim / np.maximum(distance, rim))[:, None], points)
    size = float(np.median(spacing))
    if (span := float(np.ptp(near, axis=0).max())) > FAR * size:
        last = int(np.argmax(np.where(alone, 0.0, distance)))
        raise InputError(
            f"particle {last} lies {distance[last]:.3g} m from the middle of the others, {distance[last] / size:.3g} "
            f"spacings: a cloud of {span / size:.3g} spacings from end to end cannot be triangulated (the most is "
            f"{FAR:g}); leave out what is far away"
        )
    return near
