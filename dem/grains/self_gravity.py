"""The grains' own attraction, from the octree of ``matter``.

    a_i = sum_j G m_j x_ij / |x_ij|^3        (spheres that touch attract each other as points at their centres)

It is renewed every ``interval`` and held meanwhile (``dem.grains.cached_gravity``). The field of a body changes in the
time of an orbit at its surface, T = sqrt(3 pi / (G rho)), which is also the shortest period of rotation at which it
holds together: the default is T / ``SHARE``, in which what orbits goes 0.7 degrees of the way round, and what falls
from rest comes 8e-5 radii of the body nearer. What flies off at a speed v keeps the pull of where it was: per mass
that costs up to g v times half the interval of energy, and no momentum.

For aggregates and small bodies; a bed cut out of a body has that body's field (``dem.contact.gravity``) instead, and
both together would count the bed's own part twice.

Source: Barnes & Hut 1986, Nature 324, 446 (``matter.geometry.tree``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from matter.constants import G
from matter.geometry import tree

SOFTENING = 0.01
"""Softening over the radius: keeps the sum finite, changes the pull of two touching grains by 1e-4."""
FRACTION = 500.0
"""Evaluations in the time of an orbit at the surface, by default."""


@dataclass(frozen=True)
class SelfGravity:
    """``theta`` opening angle of the tree; ``interval`` [s] between two evaluations, 0: at every step, None: a
    ``SHARE``-th of the time of an orbit about a body as dense as its grains."""

    theta: float = 0.5
    interval: float | None = None

    def acceleration(self, position: np.ndarray, mass: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Acceleration [m/s^2] of each grain, shape (n, 3); the net force of the tree's own error is in it."""
        if len(mass) < 2:
            return np.zeros((len(mass), 3))
        return tree.gravity(np.ascontiguousarray(position), np.ascontiguousarray(mass), SOFTENING * radius, self.theta)

    def energy(self, position: np.ndarray, mass: np.ndarray, radius: np.ndarray) -> float:
        """Potential energy [J] by the same tree."""
        if len(mass) < 2:
            return 0.0
        return tree.potential_energy(
            np.ascontiguousarray(position), np.ascontiguousarray(mass), SOFTENING * radius, self.theta
        )

    def time_between(self, mass: np.ndarray, radius: np.ndarray) -> float:
        """``interval``, or its default for these grains [s]."""
        if self.interval is not None:
            return self.interval
        return orbit_time(float(np.sum(mass) / (4.0 / 3.0 * math.pi * np.sum(radius**3)))) / FRACTION


def orbit_time(density: float) -> float:
    """T [s] of an orbit at the surface of a sphere of this ``density`` [kg/m^3]: sqrt(3 pi / (G rho))."""
    return math.sqrt(3.0 * math.pi / (G * density))
