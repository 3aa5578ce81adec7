"""The tide of a companion: a point mass M on a circle about the body, in the frame that falls with the body.

    a_i = g_i - <g>,   g_i = G M (d - x_i) / |d - x_i|^3,   <g> = sum m g / sum m,   d(t) = R(n t) d_0

The frame is that of the run, which does not turn and falls as the tide lets the body fall: <g> goes over the grains of
the contact search, so that the tide does not push the body, and what flies off does not push it by way of the frame.
The net force on what flies and the net torque are booked as outer impulses. A companion that moves does work,

    dE/dt = n . T - <g> . p,   T = sum m x x g,

with the momentum p of the grains (zero until something hits the body), which is summed in ``WORK``
(``dem.grains.cached_gravity``). The companion itself is not moved by the body: where it is follows from its distance
and Kepler's law, n^2 = G (M + m) / |d|^3.

Source: Murray & Dermott 1999, Solar System Dynamics, section 4.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dem.contact.columns import MASS, PX, PY, PZ
from dem.grains.cached_gravity import WORK
from dem.grains.grain_list import GrainList
from matter.compilation.jit import kernel
from matter.constants import G
from matter.geometry.rotation import rotation

SOURCES = ("MurrayDermott1999",)


@kernel
def _pull(X, V, body, position, strength, mean, torque, pull):
    """Add the pull of a point at ``position`` (3,) with G M = ``strength`` to ``pull`` (n, 3); its mean over the mass
    of the first ``body`` grains is taken out, and left with the torque on all about the origin in ``mean`` and
    ``torque`` (3,)."""
    total = 0.0
    for k in range(3):
        mean[k], torque[k] = 0.0, 0.0
    for turn in range(2):
        for i in range(pull.shape[0]):
            x, y, z = position[0] - X[i, PX], position[1] - X[i, PY], position[2] - X[i, PZ]
            r2 = x * x + y * y + z * z
            q = strength / (r2 * math.sqrt(r2))
            if turn == 0:
                m = V[i, MASS]
                if i < body:
                    total += m
                    mean[0] += m * q * x
                    mean[1] += m * q * y
                    mean[2] += m * q * z
                torque[0] += m * q * (X[i, PY] * z - X[i, PZ] * y)
                torque[1] += m * q * (X[i, PZ] * x - X[i, PX] * z)
                torque[2] += m * q * (X[i, PX] * y - X[i, PY] * x)
            else:
                pull[i, 0] += q * x - mean[0]
                pull[i, 1] += q * y - mean[1]
                pull[i, 2] += q * z - mean[2]
        if turn == 0:
            for k in range(3):
                mean[k] /= total


@dataclass(frozen=True)
class Tide:
    """``mass`` M [kg]; ``position`` d_0 (3,) from the body [m] at the time 0; ``rate`` n (3,) [1/s]: its direction is
    the axis of the circle. In a frame that turns with the body (``dem.grains.turning_frame``) n is that against the
    body."""

    mass: float
    position: np.ndarray
    rate: np.ndarray

    def add(self, bed: GrainList, pull: np.ndarray) -> None:
        """Add the tide to ``pull`` (moving grains, 3), and the companion's work over a step to the state."""
        mean, torque = np.empty(3), np.empty(3)
        _pull(bed.X, bed.V, bed.active or bed.moving, self._now(bed), G * self.mass, mean, torque, pull)
        moment = bed.momentum()
        bed.pull_state[WORK] += bed.dt * float(self.rate @ torque - mean @ moment)

    def energy(self, bed: GrainList, part: np.ndarray | slice) -> float:
        """-G M sum m (1/|d - x| - 1/|d|) [J]."""
        d = self._now(bed)
        away = 1.0 / np.linalg.norm(d - bed.position[part], axis=1) - 1.0 / np.linalg.norm(d)
        return float(-G * self.mass * (bed.mass[part] @ away))

    def _now(self, bed: GrainList) -> np.ndarray:
        return rotation(self.rate * bed.time) @ self.position


def rate(mass: float, body: float, distance: float) -> float:
    """n [1/s] of a companion and a ``body`` of these masses [kg]."""
    return math.sqrt(G * (mass + body) / distance**3)
