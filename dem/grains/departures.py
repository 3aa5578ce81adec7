"""What leaves the run is booked: count, mass, momentum, angular momentum and energy, so that the sums over what stays
and what is booked are kept."""

from __future__ import annotations

import numpy as np

from dem.contact.columns import ANGULAR_GONE, ENERGY_GONE, GRAINS_GONE, MASS_GONE, MOMENTUM_GONE, RADIUS, WX
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
    row[GRAINS_GONE] += len(mass)
    row[MASS_GONE] += mass.sum()
    row[MOMENTUM_GONE] += p.sum(axis=0)
    row[ANGULAR_GONE] += (np.cross(x, p) + inertia[:, None] * W[:, WX:] + half * F[:, WX:]).sum(axis=0)
    row[ENERGY_GONE] += energy.sum()
