"""Heights of a cloud's surface along even columns of a bed's domain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handoff.domain import Cone, Domain

_LEVELS = 96


def surface_heights(
    contains: Callable[[np.ndarray], np.ndarray], domain: Domain, columns: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Height of the topmost matter along even columns of the domain.

    ``contains`` says which points hold matter. Returns foot points on the datum (m, 3), their distance along the datum
    from the axis (m,) and the heights (m,) [m]; a column without matter has the height of the domain's floor.
    """
    foot, distance, up = feet(domain, columns)
    low, high = span(domain)
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


def feet(domain: Domain, columns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Even points on the datum inside the domain (m, 3), their distance along it from the axis (m,), and the vertical
    there (m, 3)."""
    if isinstance(domain, Cone):
        direction, distance = domain.columns(columns)
        return domain.datum * direction, distance, direction
    number = np.arange(columns) + 0.5
    distance, azimuth = domain.radius * np.sqrt(number / columns), np.pi * (1.0 + np.sqrt(5.0)) * number
    foot = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), np.full(columns, domain.datum)], axis=1)
    return foot, distance, domain.frame.up(foot)


def span(domain: Domain) -> tuple[float, float]:
    """Heights above the datum [m] of the domain's floor and top."""
    if isinstance(domain, Cone):
        return domain.core - domain.datum, domain.top - domain.datum
    return domain.floor - domain.datum, domain.top - domain.datum
