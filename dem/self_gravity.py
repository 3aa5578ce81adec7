"""The grains' own attraction, from the octree of ``matter``, renewed every few steps.

    a_i = sum_j G m_j x_ij / |x_ij|^3        (spheres that touch attract each other as points at their centres)

Between two evaluations the acceleration of a grain stays as it was: its grains move by a small part of a radius
meanwhile. The net force and torque of the tree's own error are removed. For aggregates and small bodies; a bed cut out
of a body has that body's field (``dem.gravity``) instead, and both together would count the bed's own part twice.

Source: Barnes & Hut 1986, Nature 324, 446 (``matter.tree``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from matter import tree

SOFTENING = 0.01
"""Softening over the radius: keeps the sum finite, changes the pull of two touching grains by 1e-4."""


@dataclass(frozen=True)
class SelfGravity:
    """``theta`` opening angle of the tree; ``every`` steps between two evaluations."""

    theta: float = 0.5
    every: int = 10

    def acceleration(self, position: np.ndarray, mass: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Acceleration [m/s^2] of each grain, shape (n, 3)."""
        if len(mass) < 2:
            return np.zeros((len(mass), 3))
        pull = tree.gravity(np.ascontiguousarray(position), np.ascontiguousarray(mass), SOFTENING * radius, self.theta)
        return tree.remove_net_force(pull, position, mass)[0]

    def energy(self, position: np.ndarray, mass: np.ndarray, radius: np.ndarray) -> float:
        """Potential energy [J] by the same tree."""
        if len(mass) < 2:
            return 0.0
        return tree.potential_energy(
            np.ascontiguousarray(position), np.ascontiguousarray(mass), SOFTENING * radius, self.theta
        )
