"""Heights of a cloud's surface along even columns of a bed's domain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handoff.domains.domain import Domain

_LEVELS = 96


def surface_heights(
    contains: Callable[[np.ndarray], np.ndarray], domain: Domain, columns: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height of the topmost matter along even columns of the domain.

    ``contains`` says which points hold matter. Returns foot points on the datum (m, 3), their distance along the datum
    from the axis (m,) and the heights (m,) [m]; a column without matter has the height of the domain's floor.
    """
    foot, distance, up = domain.feet(columns)
    low, high = domain.span
    step = (high - low) / _LEVELS
    levels = low + step * (np.arange(_LEVELS) + 0.5)
    points = foot[:, None] + levels[None, :, None] * up[:, None]
    matter = contains(points.reshape(-1, 3)).reshape(len(foot), _LEVELS)
    top = np.where(matter.any(axis=1), _LEVELS - 1 - np.argmax(matter[:, ::-1], axis=1), -1)
    height = np.where(top >= 0, levels[np.maximum(top, 0)], low)
    below, above = height, height + step
    for _ in range(3):
        middle = 0.5 * (below + above)
        full = contains(foot + middle[:, None] * up)
        below, above = np.where(full, middle, below), np.where(full, above, middle)
    return foot, distance, np.where(top >= 0, 0.5 * (below + above), low)
