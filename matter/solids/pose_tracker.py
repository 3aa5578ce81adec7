"""Where a body stands that has moved, turned and lost matter: by the half of its mass that moved least against itself.

    (c, R) = argmin sum_{i in half} m_i |x_i - c - R x0_i|^2         (Kabsch 1976, Acta Cryst. A 32, 922)

with the half found by turns: fit, keep the nearer half, fit again (least trimmed squares: Rousseeuw 1984, J. Am. Stat.
Assoc. 79, 871). The centre of mass is no guide: it goes with what was thrown out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from matter.particles import Particles

SOURCES = ("Kabsch1976", "Rousseeuw1984")

SHARE = 0.5
TURNS = 30
FEWEST = 12


class Pose(NamedTuple):
    """``origin`` (3,) [m] and ``turn`` (3, 3): what was at x0 before is at origin + turn x0 where nothing moved
    against the body; its ``velocity`` (3,) [m/s] at the origin and ``rotation`` (3,) [1/s]."""

    origin: np.ndarray
    turn: np.ndarray
    velocity: np.ndarray
    rotation: np.ndarray

    def back(self, position: np.ndarray) -> np.ndarray:
        """Places (n, 3) in the frame of the body before the impact."""
        return np.asarray((position - self.origin) @ self.turn)

    def back_velocity(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Velocities (n, 3) against the turning body, in the same frame."""
        along = np.cross(self.rotation, position - self.origin)
        return np.asarray((velocity - self.velocity - along) @ self.turn)


class PoseTracker:
    """The positions of all particles of a body ``before`` the impact, by identity."""

    def __init__(self, before: Particles):
        before.need("identity", "position", "mass")
        here = of_body(before)
        order = np.flatnonzero(here)[np.argsort(before.identity[here])]
        self.identity, self.position = before.identity[order], before.position[order]

    def known(self, particles: Particles) -> tuple[np.ndarray, np.ndarray]:
        """Rows of ``particles`` that were there before and still belong to the body, and their rows here."""
        rows = np.flatnonzero(of_body(particles))
        at = np.minimum(np.searchsorted(self.identity, particles.identity[rows]), len(self.identity) - 1)
        same = self.identity[at] == particles.identity[rows]
        return rows[same], at[same]

    def pose(self, particles: Particles) -> Pose:
        """The pose of the body in ``particles``. Raises ``InputError`` where too little of it is left."""
        rows, at = self.known(particles)
        if len(rows) < FEWEST:
            raise InputError(f"{len(rows)} of the {len(self.identity)} particles of the body are left")
        x, x0, m = particles.position[rows], self.position[at], particles.mass[rows]
        kept, half = np.ones(len(rows), dtype=bool), m.sum() * SHARE
        for _ in range(TURNS):
            origin, turn = _fitted(x[kept], x0[kept], m[kept])
            order = np.argsort(np.sum((x - origin - x0 @ turn.T) ** 2, axis=1), kind="stable")
            nearer = np.zeros(len(rows), dtype=bool)
            nearer[order[: max(int(np.searchsorted(np.cumsum(m[order]), half)) + 1, FEWEST)]] = True
            if np.array_equal(nearer, kept):
                break
            kept = nearer
        if "velocity" not in particles:
            return Pose(origin, turn, np.zeros(3), np.zeros(3))
        velocity, rotation = motion(x[kept], particles.velocity[rows][kept], m[kept], origin)
        return Pose(origin, turn, velocity, rotation)


def of_body(particles: Particles) -> np.ndarray:
    """(n,) whether a particle is of the target, and not booked as gone."""
    here = np.ones(len(particles), dtype=bool)
    if "layer" in particles:
        here &= particles.layer >= 0
    if "state" in particles:
        here &= particles.state != 2
    return here


def _fitted(x: np.ndarray, x0: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    fraction = m / m.sum()
    centre, centre0 = fraction @ x, fraction @ x0
    u, _, v = np.linalg.svd(np.einsum("i,ij,ik->jk", fraction, x - centre, x0 - centre0))
    u[:, 2] *= np.sign(np.linalg.det(u @ v))
    turn = u @ v
    return centre - turn @ centre0, turn


def inertia(position: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Inertia (3, 3) [kg m^2] of points about the origin."""
    square = np.einsum("ij,ij->i", position, position)
    return np.asarray(np.eye(3) * (mass @ square) - np.einsum("i,ij,ik->jk", mass, position, position))


def motion(x: np.ndarray, v: np.ndarray, m: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity (3,) at ``origin`` and rotation (3,) of points as one rigid body of their momentum and angular
    momentum: omega = I^-1 sum m (x - c) x (v - v_c)."""
    centre, drift = (m @ values / m.sum() for values in (x, v))
    away = x - centre
    spin = (m[:, None] * np.cross(away, v - drift)).sum(axis=0)
    omega = np.linalg.solve(inertia(away, m), spin)
    return drift + np.cross(omega, origin - centre), omega
