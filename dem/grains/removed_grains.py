"""Budget of the grains that leave the domain: count, mass, momentum, angular momentum and energy, so that the sums
over the remaining and the removed grains are conserved."""

from __future__ import annotations

import numpy as np

from dem.contact.columns import (
    ANGULAR_REMOVED,
    ENERGY_REMOVED,
    GRAINS_REMOVED,
    MASS_REMOVED,
    MOMENTUM_REMOVED,
    RADIUS,
    WX,
)
from dem.contact.gravity import Field


def book(
    row: np.ndarray, mass: np.ndarray, X: np.ndarray, W: np.ndarray, F: np.ndarray, half: float, gravity: Field
) -> None:
    """Add grains to a ``row`` (``dem.contact.columns.BOOKS``,) at a full step: ``mass`` (n,) [kg] and their rows of
    the tables X, W and F, with the kick of ``half`` a step [s] that the contacts have just given them."""
    x = X[:, :3]
    p = mass[:, None] * W[:, :3] + half * F[:, :3]
    inertia = 0.4 * mass * X[:, RADIUS] ** 2
    energy = 0.5 * np.sum(p * W[:, :3], axis=1) + mass * gravity.potential(x)
    row[GRAINS_REMOVED] += len(mass)
    row[MASS_REMOVED] += mass.sum()
    row[MOMENTUM_REMOVED] += p.sum(axis=0)
    row[ANGULAR_REMOVED] += (np.cross(x, p) + inertia[:, None] * W[:, WX:] + half * F[:, WX:]).sum(axis=0)
    row[ENERGY_REMOVED] += energy.sum()
