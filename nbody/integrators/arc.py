"""The path of a particle within a step: the quintic Hermite curve through states and accelerations at both ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.compilation.jit import law
from nbody.masses.state_vector import distance2, r_dot_v

_HALVINGS = 40


class Arc(NamedTuple):
    """A step's path: states ``y``, ``new`` (6,) and accelerations ``a0``, ``a1`` (3,) at both ends, length ``h``
    [s]."""

    y: np.ndarray
    new: np.ndarray
    a0: np.ndarray
    a1: np.ndarray
    h: float


@law
def curve(u, arc, out):
    """Position and velocity at fraction ``u`` of a step: quintic Hermite through both ends, into ``out`` (6,)."""
    y, new, a0, a1, h = arc.y, arc.new, arc.a0, arc.a1, arc.h
    for d in range(3):
        rise = new[d] - y[d]
        v0, v1, b0, b1 = y[d + 3] * h, new[d + 3] * h, a0[d] * h * h, a1[d] * h * h
        c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * b0 + 0.5 * b1
        c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * b0 - b1
        c5 = 6.0 * rise - 3.0 * (v0 + v1) - 0.5 * (b0 - b1)
        out[d] = ((((c5 * u + c4) * u + c3) * u + 0.5 * b0) * u + v0) * u + y[d]
        out[d + 3] = ((((5.0 * c5 * u + 4.0 * c4) * u + 3.0 * c3) * u + b0) * u + v0) / h


@law
def struck(radius, arc, out):
    """Fraction of a step at which its path is below ``radius`` [m] from the origin: at its nearest point, where that
    lies within the step, else at the end; the state there goes into ``out`` (6,). -1 where it stays above.

    The nearest point is the root of r.v, by bisection: ends of steps alone miss a path that dips below the surface
    between two of them.
    """
    y, new = arc.y, arc.new
    low, high = 0.0, 1.0
    if r_dot_v(y) < 0.0 < r_dot_v(new):
        for _ in range(_HALVINGS):
            u = 0.5 * (low + high)
            curve(u, arc, out)
            if r_dot_v(out) < 0.0:
                low = u
            else:
                high = u
    curve(high, arc, out)
    return high if distance2(out) < radius * radius else -1.0
