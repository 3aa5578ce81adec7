"""The domain of grains that are a whole body: no walls, no sides, no floor; and the frame in which it rests.

Grains move in the inertial frame. Where a body stands in it follows from its grains: the rotation about the centre of
mass that brings them nearest to where they began,

    R = argmin sum m |x - c - R (x_0 - c_0)|^2      (Kabsch 1976, Acta Cryst. A 32, 922).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dem.grains.grain_list import ACTIVE, BALLISTIC, GrainList
from matter.constants import G
from matter.errors import InputError
from matter.particles import Particles


@dataclass(frozen=True)
class WholeBody:
    """``datum`` [m]: radius of the ball of the body's volume; ``omega`` (3,) [1/s] its rotation at the start;
    ``hill_radius`` [m] that of its Hill sphere, where it has a companion."""

    datum: float
    omega: tuple[float, float, float]
    floor: float = 0.0
    top: float = 0.0
    half_angle: float = np.pi
    hill_radius: float = np.inf

    def drag(self, position: np.ndarray) -> np.ndarray:
        """Nothing is damped (n,) [1/s]."""
        return np.zeros(len(position))

    def polar_angle(self, position: np.ndarray) -> np.ndarray:
        """Angle from the site's axis [rad]."""
        return np.asarray(np.arctan2(np.hypot(position[:, 0], position[:, 1]), position[:, 2]))

    def side_depth(self, position: np.ndarray) -> np.ndarray:
        """There is no side: inf (n,)."""
        return np.full(len(position), np.inf)

    def outside(self, position: np.ndarray) -> np.ndarray:
        """Nothing is beyond it (n,)."""
        return np.zeros(len(position), dtype=bool)

    def as_attribute(self) -> dict[str, Any]:
        """Plain values for a snapshot's attribute ``domain`` (with the snapshot's ``frame`` = ``solid``)."""
        return {"shape": "whole", "radius_m": self.datum, "angular_velocity_1_s": list(self.omega)}

    @staticmethod
    def of_attribute(values: dict[str, Any]) -> WholeBody:
        """The domain that a snapshot records."""
        if missing := [key for key in ("radius_m", "angular_velocity_1_s") if key not in values]:
            raise InputError(f"the snapshot's attribute 'domain' lacks {', '.join(missing)}")
        x, y, z = (float(value) for value in values["angular_velocity_1_s"])
        return WholeBody(float(values["radius_m"]), (x, y, z))


class PoseTracker:
    """Where a body of grains stands: its centre, and its rotation since the ``start``."""

    def __init__(self, start: Particles):
        order = np.argsort(start.identity)
        self.identity, self.position = start.identity[order], start.position[order]

    def now(self, bed: GrainList) -> tuple[np.ndarray, np.ndarray]:
        """Centre of mass (3,) of the grains in the contact search (of all that move, where none is), and R (3, 3)."""
        here = bed.state == (ACTIVE if bed.active else BALLISTIC)
        m, x = bed.mass[here], bed.position[here]
        before = self.position[np.searchsorted(self.identity, bed.identity[here])]
        centre = m @ x / m.sum()
        u, _, v = np.linalg.svd(np.einsum("i,ij,ik->jk", m, x - centre, before - m @ before / m.sum()))
        u[:, 2] *= np.sign(np.linalg.det(u @ v))
        return centre, u @ v

    def turned_back(self, bed: GrainList) -> np.ndarray:
        """Places (n, 3) [m] of all grains from the centre, in the frame in which the body rests."""
        centre, turn = self.now(bed)
        return np.asarray((bed.position - centre) @ turn)


def bound(bed: GrainList, distance: np.ndarray) -> np.ndarray:
    """(n,) whether a grain at this ``distance`` [m] from the body's centre is slower than it can leave: as if all mass
    were there."""
    k = slice(0, bed.active or bed.moving)
    drift = bed.mass[k] @ bed.velocity[k] / bed.mass[k].sum()
    speed2 = np.sum((bed.velocity - drift) ** 2, axis=1)
    return np.asarray(0.5 * speed2 < G * bed.mass[k].sum() / np.maximum(distance, 1e-300))
