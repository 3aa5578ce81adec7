"""The pull of all grains on each other between two evaluations, in the inertial frame of the run.

A pull that is held while the body turns under it lags behind, by the angle that the body turns meanwhile, and brakes
the rotation. So it turns with the body,

    a_i(t) = R(omega (t - t_0)) a_i(t_0),   omega = I^-1 L of the grains in the contact search at t_0

and at every step what it lacks of Newton's third law is taken out by one rigid correction about the centre of mass,

    a_i <- a_i - alpha - beta x x_i',   sum m a = 0,   sum m x' x a = 0

with x' the present positions from the centre of mass: momentum and angular momentum are kept to rounding. The rms of
the correction over that of the pull, both weighted by mass, is kept (``REMOVED``, ``WORST``): the fraction of the
weight.

Then comes what acts from outside (``ExternalForce``): ``dem.grains.tide``, ``dem.grains.turning_frame``.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from dem.contact.columns import MASS, PX, PY, PZ, RADIUS
from dem.grains.grain_list import GrainList
from matter.compilation.jit import kernel
from matter.geometry.rotation import rotation

SINCE, SPIN, REMOVED, WORST, WORK = 0, slice(1, 4), 4, 5, 6
"""State of a held pull (7,): time since the evaluation [s], angular velocity of the body then [1/s], what was taken
out last and at most over the weight, work of what moves outside [J]."""
STATE = 7


class ExternalForce(Protocol):
    """A body force besides the grains' self-gravity."""

    def add(self, bed: GrainList, pull: np.ndarray) -> None:
        """Add its acceleration [m/s^2] at the present positions to ``pull`` (moving grains, 3)."""

    def energy(self, bed: GrainList, part: np.ndarray | slice) -> float:
        """Potential energy [J] of these grains in it."""


@kernel
def _turn(held, turn, pull):
    """``pull`` (n, 3) = ``turn`` (3, 3) times each row of ``held``."""
    for i in range(held.shape[0]):
        for c in range(3):
            pull[i, c] = turn[c, 0] * held[i, 0] + turn[c, 1] * held[i, 1] + turn[c, 2] * held[i, 2]


@kernel
def _sums(X, V, count, vectors, centre):
    """Centre of mass of the first ``count`` grains and, in ``centre[1]``, the sum of m a of the ``vectors`` a; returns
    the sums of m, of m |a|^2, of m x' x a (3) and of m (yy + zz, -xy, -xz, xx + zz, -yz, xx + yy)."""
    total = 0.0
    for k in range(3):
        centre[0, k], centre[1, k] = 0.0, 0.0
    for i in range(count):
        m = V[i, MASS]
        total += m
        for k in range(3):
            centre[0, k] += m * X[i, k]
            centre[1, k] += m * vectors[i, k]
    for k in range(3):
        centre[0, k] /= total
    square, lx, ly, lz = 0.0, 0.0, 0.0, 0.0
    ixx, ixy, ixz, iyy, iyz, izz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        m, x, y, z = V[i, MASS], X[i, PX] - centre[0, 0], X[i, PY] - centre[0, 1], X[i, PZ] - centre[0, 2]
        a, b, c = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        square += m * (a * a + b * b + c * c)
        lx += m * (y * c - z * b)
        ly += m * (z * a - x * c)
        lz += m * (x * b - y * a)
        ixx += m * (y * y + z * z)
        ixy -= m * x * y
        ixz -= m * x * z
        iyy += m * (x * x + z * z)
        iyz -= m * y * z
        izz += m * (x * x + y * y)
    return total, square, (lx, ly, lz), (ixx, ixy, ixz, iyy, iyz, izz)


@kernel
def _take_out(X, V, centre, shift, twist, pull):
    """``pull`` - shift - twist x x', in place; the sum of m times the square of what was taken out."""
    total = 0.0
    for i in range(pull.shape[0]):
        x, y, z = X[i, PX] - centre[0, 0], X[i, PY] - centre[0, 1], X[i, PZ] - centre[0, 2]
        a = shift[0] + twist[1] * z - twist[2] * y
        b = shift[1] + twist[2] * x - twist[0] * z
        c = shift[2] + twist[0] * y - twist[1] * x
        total += V[i, MASS] * (a * a + b * b + c * c)
        pull[i, 0] -= a
        pull[i, 1] -= b
        pull[i, 2] -= c
    return total


def _rigid(X: np.ndarray, V: np.ndarray, count: int, vectors: np.ndarray) -> tuple[Any, ...]:
    """Centre of mass (2, 3) as ``_sums`` leaves it, mean (3,) and rotation (3,) of ``vectors``: the rigid motion with
    their sum and moment; and the sum of m |a|^2."""
    centre = np.empty((2, 3))
    mass, square, moment, (a, b, c, d, e, f) = _sums(X, V, count, vectors, centre)
    # two grains, or grains in a line, have no inertia about it, and no moment either
    twist = np.linalg.lstsq(np.array([[a, b, c], [b, d, e], [c, e, f]]), np.array(moment), rcond=None)[0]
    return centre, centre[1] / mass, twist, square


def angular_velocity(bed: GrainList) -> np.ndarray:
    """Angular velocity (3,) [1/s] of the grains in the contact search as one body: I^-1 L, their own spins left
    out; zero where none is left in it."""
    return _rigid(bed.X, bed.V, bed.active, bed.W)[2] if bed.active else np.zeros(3)


def without_net(bed: GrainList, pull: np.ndarray) -> float:
    """Take net force and torque out of the acceleration ``pull`` (moving grains, 3), in place; returns the rms of the
    correction over that of the field."""
    centre, shift, twist, square = _rigid(bed.X, bed.V, len(pull), pull)
    taken = _take_out(bed.X, bed.V, centre, shift, twist, pull)
    return math.sqrt(taken / max(square, 1e-300))


def energy_with(bed: GrainList, where: np.ndarray) -> float:
    """Energy [J] that goes with the grains ``where`` (n,) bool: that of the attraction of all moving grains, less that
    of the rest alone, and theirs in what acts from outside."""
    own = sum(outer.energy(bed, where) for outer in bed.outer)
    if bed.self_gravity is None:
        return float(own)
    k = np.arange(len(bed.X)) < bed.moving
    rest = k & ~where
    whole, left = (
        bed.self_gravity.energy(bed.position[part], bed.mass[part], bed.X[part, RADIUS]) for part in (k, rest)
    )
    return float(own + whole - left)


def attract(bed: GrainList, renew: bool = False) -> None:
    """Set ``bed.self_acceleration`` for the present positions, half a step after the velocities; ``renew``: evaluate
    it."""
    if bed.moving == 0:
        return
    k = slice(0, bed.moving)
    state, pull, law = bed.pull_state, bed.self_acceleration[k], bed.self_gravity
    if law is None:
        pull[:] = 0.0
    else:
        state[SINCE] += bed.dt
        if renew or state[SINCE] >= bed.pull_interval * (1.0 - 1e-9):
            bed.cached_acceleration[k] = law.acceleration(bed.position[k], bed.mass[k], bed.X[k, RADIUS])
            state[SINCE], state[SPIN] = 0.0, angular_velocity(bed)
        _turn(bed.cached_acceleration[k], rotation(state[SPIN] * state[SINCE]), pull)
        state[REMOVED] = without_net(bed, pull)
        state[WORST] = max(state[WORST], state[REMOVED])
    for outer in bed.outer:
        outer.add(bed, pull)
