"""Sums of mass, momentum and energy over particles, and the one global correction that closes linear and angular
momentum exactly.

Correction: dv_i = a + b x (r_i - r_c) on the grains of the bed, r_c their centre of mass. Then sum m dv = M a and the
angular momentum about r_c changes by I b with the inertia tensor I of the grains' centres, so that the six equations
fall apart into a = dp / M and b = I^-1 (dL - r_c x dp).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sums:
    """Mass [kg], momentum [kg m/s], angular momentum about the origin [kg m^2/s], kinetic energy [J]; and what they
    are measured by: ``momentum_scale`` = sum m |v|, ``angular_scale`` = sum m |r| |v|."""

    mass: float
    momentum: np.ndarray
    angular: np.ndarray
    kinetic: float
    momentum_scale: float
    angular_scale: float

    def __add__(self, other: Sums) -> Sums:
        return Sums(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))


def sums(
    mass: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    radius=None,
    spin=None,
    pace: np.ndarray | None = None,
) -> Sums:
    """Sums over particles; with ``radius`` and ``spin`` (rad/s) those of solid spheres, their inertia 2/5 m r^2
    included. ``pace`` (n,) [m/s] stands for |v| in the scales where what moves is not measured by it (ground that
    turns with a body)."""
    momentum = mass[:, None] * velocity
    angular = np.cross(position, momentum).sum(axis=0)
    speed = np.linalg.norm(velocity, axis=1)
    kinetic = 0.5 * float(np.sum(mass * speed**2))
    if spin is not None:
        inertia = 0.4 * mass * radius**2
        angular = angular + (inertia[:, None] * spin).sum(axis=0)
        kinetic += 0.5 * float(np.sum(inertia * np.einsum("ij,ij->i", spin, spin)))
    scale = mass * (speed if pace is None else pace)
    return Sums(
        float(mass.sum()),
        momentum.sum(axis=0),
        angular,
        kinetic,
        float(scale.sum()),
        float(np.sum(scale * np.linalg.norm(position, axis=1))),
    )


def closing_field(
    mass: np.ndarray, position: np.ndarray, lacking: np.ndarray, lacking_angular: np.ndarray
) -> np.ndarray:
    """The change of velocity (n, 3) [m/s] that adds momentum ``lacking`` and angular momentum ``lacking_angular``
    (about the origin)."""
    total = mass.sum()
    centre = (mass[:, None] * position).sum(axis=0) / total
    arm = position - centre
    inertia = np.eye(3) * np.sum(mass * np.einsum("ij,ij->i", arm, arm)) - np.einsum("i,ia,ib->ab", mass, arm, arm)
    spin = np.linalg.solve(inertia, lacking_angular - np.cross(centre, lacking))
    return lacking / total + np.cross(spin, arm)
