"""One step of all bodies by Runge-Kutta-Cash-Karp 4(5) with the step rules of the thesis, and the cubic Hermite
interpolant of a step.

Cash and Karp 1990, ACM Trans. Math. Softw. 16, 201; step control of Press et al., Numerical Recipes, section 16.2.
Winter 2017, section 2.1.3: the fifth-order solution is carried on, a step is accepted when

    |y5 - y4| < 0.1 eps mean|x_rel| (positions),  < eps mean|v_rel| (velocities),  eps = 1e-11,

the means taken over all pairs of bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.compilation.jit import law
from nbody.masses.newtonian import newton
from nbody.masses.state_vector import distance2, r_dot_v

SOURCES = ("CashKarp1990", "Winter2017")

EPSILON = 1e-11


A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0],
        [3 / 10, -9 / 10, 6 / 5, 0.0, 0.0],
        [-11 / 54, 5 / 2, -70 / 27, 35 / 27, 0.0],
        [1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096],
    ]
)
B5 = np.array([37 / 378, 0.0, 250 / 621, 125 / 594, 0.0, 512 / 1771])
B4 = np.array([2825 / 27648, 0.0, 18575 / 48384, 13525 / 55296, 277 / 14336, 1 / 4])
E = B5 - B4


class Leg(NamedTuple):
    """A step of all bodies: length ``h`` [s], states at both ends (n, 3)."""

    h: float
    x: np.ndarray
    v: np.ndarray
    x_new: np.ndarray
    v_new: np.ndarray


@law
def rkck(x, v, h, gm, kx, kv, xs, x_new, v_new):
    """One step of length ``h`` from (x, v), shape (n, 3); kv[0] holds the accelerations. Returns the error over the
    tolerances."""
    n = x.shape[0]
    for i in range(n):
        for d in range(3):
            kx[0, i, d] = v[i, d]
    for s in range(1, 6):
        for i in range(n):
            for d in range(3):
                dx, dv = 0.0, 0.0
                for j in range(s):
                    dx += A[s, j] * kx[j, i, d]
                    dv += A[s, j] * kv[j, i, d]
                xs[i, d] = x[i, d] + h * dx
                kx[s, i, d] = v[i, d] + h * dv
        newton(xs, gm, kv[s])
    worst_x, worst_v = 0.0, 0.0
    for i in range(n):
        for d in range(3):
            dx, dv, ex, ev = 0.0, 0.0, 0.0, 0.0
            for s in range(6):
                dx += B5[s] * kx[s, i, d]
                dv += B5[s] * kv[s, i, d]
                ex += E[s] * kx[s, i, d]
                ev += E[s] * kv[s, i, d]
            x_new[i, d] = x[i, d] + h * dx
            v_new[i, d] = v[i, d] + h * dv
            worst_x, worst_v = max(worst_x, abs(ex)), max(worst_v, abs(ev))
    distance, speed = 0.0, 0.0
    for i in range(n):
        for j in range(i + 1, n):
            dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
            distance += (dx * dx + dy * dy + dz * dz) ** 0.5
            dx, dy, dz = v[i, 0] - v[j, 0], v[i, 1] - v[j, 1], v[i, 2] - v[j, 2]
            speed += (dx * dx + dy * dy + dz * dz) ** 0.5
    pairs = 0.5 * n * (n - 1)
    return h * max(worst_x / (0.1 * EPSILON * distance / pairs), worst_v / (EPSILON * speed / pairs))


@law
def copy(x, v, x_to, v_to):
    """Copy states (n, 3)."""
    for i in range(x.shape[0]):
        for d in range(3):
            x_to[i, d], v_to[i, d] = x[i, d], v[i, d]


@law
def after(h, error):
    """Next step length by Numerical Recipes' rule."""
    if error > 1.0:
        return h * max(0.9 * error**-0.25, 0.1)
    return h * min(5.0, 0.9 * error**-0.2) if error > 0.0 else 5.0 * h


@law
def between(u, leg, last, other, out):
    """Relative state of bodies ``last`` and ``other`` at fraction ``u`` of a step (cubic Hermite) into ``out``;
    returns distance, r.v."""
    h, x, v, x_new, v_new = leg.h, leg.x, leg.v, leg.x_new, leg.v_new
    for d in range(3):
        x0, x1 = x[last, d] - x[other, d], x_new[last, d] - x_new[other, d]
        v0, v1 = h * (v[last, d] - v[other, d]), h * (v_new[last, d] - v_new[other, d])
        c2, c3 = 3.0 * (x1 - x0) - 2.0 * v0 - v1, 2.0 * (x0 - x1) + v0 + v1
        out[d] = ((c3 * u + c2) * u + v0) * u + x0
        out[3 + d] = ((3.0 * c3 * u + 2.0 * c2) * u + v0) / h
    r2 = distance2(out)
    return r2**0.5, r_dot_v(out)
