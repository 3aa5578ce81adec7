"""The momentum that an impact leaves in a body, and what it does to the body's orbit.

    dP = sum of m (v - v_b) over all that stays bound     v_b the velocity of the body's centre of mass before
    beta(e) = dP . e / (p . e)                  p the projectile's momentum, e a direction
    dv = dP / (mass that stays)

(Cheng et al. 2023, Nature 616, 457, eq. 1, along the normal of the surface; the other directions alike.) The frame is
that in which body and companion fall: a companion's tide takes no net momentum. v_b is not quite 0: the centre of a
packing of particles that turns is not quite on its axis.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from crater.bodies.body_state import BodyState

SOURCES = ("Cheng2023",)


class Exchange(NamedTuple):
    """``brought`` (3,) [kg m/s], ``stays`` (3,) [kg m/s] and its ``error`` (3,): that of counting the particles which
    leave; ``mass`` that stays, that is ``escaping``, and what of the target is not on the ground, ``ejected`` [kg]."""

    brought: np.ndarray
    stays: np.ndarray
    error: np.ndarray
    mass: float
    escaping: float
    ejected: float

    def beta(self, direction: np.ndarray) -> tuple[float, float]:
        """beta along a ``direction`` (3,), and its error; NaN where the projectile brought nothing along it."""
        brought = float(self.brought @ direction)
        if abs(brought) < 1e-6 * float(np.linalg.norm(self.brought)):
            return math.nan, math.nan
        return float(self.stays @ direction) / brought, float(np.linalg.norm(self.error * direction)) / abs(brought)

    @property
    def vector(self) -> np.ndarray:
        """dP (3,) over the projectile's momentum."""
        return np.asarray(self.stays / np.linalg.norm(self.brought))

    @property
    def change(self) -> np.ndarray:
        """Change of the body's velocity (3,) [m/s]."""
        return self.stays / self.mass


def momentum_exchange(before: BodyState, after: BodyState, brought: np.ndarray) -> Exchange:
    """What looks at the body before and after show of a projectile that ``brought`` a momentum (3,) [kg m/s]."""
    whole = before.particles.select(before.body)
    p = after.particles
    momentum = p.mass[:, None] * (p.velocity - whole.mass @ whole.velocity / whole.mass.sum())
    target = p.layer >= 0 if "layer" in p else np.ones(len(p), dtype=bool)
    escaped = ~after.bound
    return Exchange(
        np.asarray(brought, dtype=float),
        momentum[after.bound].sum(axis=0),
        np.sqrt(np.sum(momentum[escaped] ** 2, axis=0)),
        float(p.mass[after.bound].sum()),
        float(p.mass[escaped].sum()),
        float(p.mass[target & ~after.body].sum()),
    )
