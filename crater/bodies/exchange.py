"""The momentum that an impact leaves in a body, and what it does to the body's orbit.

    dP = sum of m (v - v_b) over all that stays bound     v_b the velocity of the body's centre of mass before
    beta(e) = dP . e / (p . e)                  p the projectile's momentum, e a direction
    dv = dP / (mass that stays)

(Cheng et al. 2023, Nature 616, 457, eq. 1, along the normal of the surface; the other directions alike.) The frame is
that in which body and companion fall: a companion's tide takes no net momentum. v_b is not quite 0: the centre of a
packing of particles that turns is not quite on its axis.

The mutual orbit was a circle of radius d, v_0^2 = mu / d, mu = G (M + m). The body's velocity against its companion
is then v_0 t + dv, t along its track, and by the vis-viva equation

    1 / a = 2 / d - |v_0 t + dv|^2 / mu',   P = 2 pi sqrt(a^3 / mu')         mu' with the mass that stays

(Murray & Dermott 1999, Solar System Dynamics, eq. 2.34), for a small dv: dP / P = 3 dv . t / v_0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from crater.bodies.look import Look
from matter.constants import G

SOURCES = ("Cheng2023", "MurrayDermott1999")


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


def momentum_exchange(before: Look, seen: Look, brought: np.ndarray) -> Exchange:
    """What looks at the body before and after show of a projectile that ``brought`` a momentum (3,) [kg m/s]."""
    whole = before.particles.select(before.body)
    p = seen.particles
    momentum = p.mass[:, None] * (p.velocity - whole.mass @ whole.velocity / whole.mass.sum())
    target = p.layer >= 0 if "layer" in p else np.ones(len(p), dtype=bool)
    gone = ~seen.bound
    return Exchange(
        np.asarray(brought, dtype=float),
        momentum[seen.bound].sum(axis=0),
        np.sqrt(np.sum(momentum[gone] ** 2, axis=0)),
        float(p.mass[seen.bound].sum()),
        float(p.mass[gone].sum()),
        float(p.mass[target & ~seen.body].sum()),
    )


class Orbit(NamedTuple):
    """A circle about a companion of ``mass`` [kg] at ``distance`` [m]; ``track`` (3,): where the body flies to."""

    mass: float
    distance: float
    track: np.ndarray


def period(orbit: Orbit, body: float, change: np.ndarray) -> float:
    """Period [s] of the mutual orbit after the ``change`` (3,) [m/s] of the velocity of a ``body`` [kg] that was on
    the circle; NaN where it leaves its companion. The circle itself is that of this mass: the mass that is lost is
    nothing to it."""
    mu = G * (orbit.mass + body)
    velocity = math.sqrt(mu / orbit.distance) * orbit.track + change
    inverse = 2.0 / orbit.distance - float(velocity @ velocity) / mu
    return 2.0 * math.pi * math.sqrt(inverse**-3 / mu) if inverse > 0.0 else math.nan
